cimport cython
from libc.stdint cimport int64_t

from cohaptic_server.mesh.search.bulge_fit cimport fit_bulge
from cohaptic_server.mesh.search.contact_search cimport ContactSearch
from cohaptic_server.mesh.search.loaded_field cimport LoadedField


@cython.locals(i=Py_ssize_t, a=int64_t, b=int64_t, c=int64_t, d=int64_t)
cpdef Py_ssize_t put_contacts(
    ContactSearch search, LoadedField field, Py_ssize_t first, const double[:, :, ::1] frames,
    const int64_t[::1] starts, const int64_t[::1] under, const double[::1] weights,
    const int64_t[::1] known_starts, const int64_t[::1] known, const double[:, ::1] values,
    double[:, ::1] places) noexcept
@cython.locals(i=Py_ssize_t, axis=Py_ssize_t, a=int64_t, b=int64_t, sharp=double, share=double,
               k=int64_t, moved=double)
cpdef void flatten(
    const double[:, ::1] rest, const double[:, ::1] normals, const double[:, :, ::1] frames,
    const double[:, ::1] x_free, const double[::1] depths, double radius, double largest,
    double[:, ::1] matrix, const int64_t[::1] known_starts, const int64_t[::1] known,
    double[:, ::1] values, double[:, ::1] shown) noexcept
