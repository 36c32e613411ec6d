cimport cython
from libc.stdint cimport int64_t


@cython.final
cdef class LoadedField:
    cdef int64_t[::1] row
    cdef const int64_t[::1] known
    cdef const double[:, ::1] values
    cdef bint whole
    cdef public bint lacking

    @cython.locals(k=Py_ssize_t)
    cpdef void load(self, const int64_t[::1] known, const double[:, ::1] values, bint whole) noexcept
    @cython.locals(k=Py_ssize_t, row=int64_t, axis=Py_ssize_t, value=double, before=double)
    cpdef void follow(self, const int64_t[::1] vertices, const double[:, ::1] values, double fraction,
                      double[:, ::1] followed) noexcept
    @cython.locals(row=int64_t)
    cdef double moved(self, int64_t vertex, Py_ssize_t axis) noexcept
