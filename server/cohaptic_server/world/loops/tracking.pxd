cimport cython
from libc.stdint cimport int64_t

from cohaptic_server.mesh.search.contact_search cimport ContactSearch
from cohaptic_server.mesh.search.loaded_field cimport LoadedField
from cohaptic_server.world.loops.rows cimport ContactRows, FieldRows, check_rows, same

cdef int _UNKNOWN


@cython.final
cdef class Reach:
    cdef readonly double radius
    cdef readonly double keep
    cdef readonly double tolerance


@cython.locals(n=Py_ssize_t, length=Py_ssize_t, i=Py_ssize_t, row=int64_t, a=int64_t, b=int64_t,
               c=int64_t, d=int64_t, x=double, y=double, z=double, state=int)
cpdef Py_ssize_t track(
    ContactSearch search, LoadedField field, Py_ssize_t first, const int64_t[::1] before,
    const double[:, ::1] tips, const double[::1] fractions, Reach reach, ContactRows old,
    FieldRows free, const int64_t[::1] surface_of, FieldRows surfaces, double[:, ::1] followed,
    ContactRows new, double[:, ::1] places) except -1
@cython.locals(k=Py_ssize_t, axis=Py_ssize_t, a=int64_t, b=int64_t)
cdef void relax(
    LoadedField field, const int64_t[::1] known, const double[:, ::1] free, int64_t of,
    FieldRows surfaces, double fraction, double[:, ::1] followed) noexcept
