cimport cython
from libc.stdint cimport int64_t

from cohaptic_server.mesh.search.contact_search cimport ContactSearch
from cohaptic_server.mesh.search.loaded_field cimport LoadedField

cdef int _UNKNOWN


@cython.locals(i=Py_ssize_t, row=int64_t, a=int64_t, b=int64_t, c=int64_t, d=int64_t, x=double,
               y=double, z=double, state=int)
cpdef Py_ssize_t track(
    ContactSearch search, LoadedField field, Py_ssize_t first, const int64_t[::1] before,
    const double[:, ::1] tips, const double[::1] shares, double radius, double keep,
    double tolerance, const double[:, :, ::1] frames, const double[::1] slopes,
    const int64_t[::1] starts, const int64_t[::1] under, const double[::1] weights,
    const int64_t[::1] known_starts, const int64_t[::1] known, const double[:, ::1] free,
    const int64_t[::1] surface_of, const int64_t[::1] surface_starts,
    const int64_t[::1] surface_known, const double[:, ::1] surface, double[:, ::1] followed,
    double[:, :, ::1] new_frames, double[::1] new_slopes, int64_t[::1] new_starts,
    int64_t[::1] new_under, double[::1] new_weights, double[:, ::1] places) noexcept
@cython.locals(k=Py_ssize_t, axis=Py_ssize_t, a=int64_t, b=int64_t)
cdef void relax(
    LoadedField field, const int64_t[::1] known, const double[:, ::1] free, int64_t of,
    const int64_t[::1] starts, const int64_t[::1] surface_known, const double[:, ::1] surface,
    double share, double[:, ::1] followed) noexcept
