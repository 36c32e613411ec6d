cimport cython
from libc.stdint cimport int64_t


@cython.final
cdef class ContactRows:
    cdef readonly double[:, :, ::1] frames
    cdef readonly double[::1] slopes
    cdef readonly int64_t[::1] starts
    cdef readonly int64_t[::1] vertices
    cdef readonly double[::1] weights
    cdef readonly Py_ssize_t n


@cython.final
cdef class FieldRows:
    cdef readonly int64_t[::1] starts
    cdef readonly int64_t[::1] vertices
    cdef readonly double[:, ::1] values
    cdef readonly Py_ssize_t n


@cython.final
cdef class WindowRows:
    cdef readonly int64_t[::1] geometry
    cdef readonly double[:, ::1] keys
    cdef readonly int64_t[:, ::1] starts
    cdef readonly int64_t[::1] vertices
    cdef readonly int64_t[::1] fitted
    cdef readonly int64_t[::1] touched
    cdef readonly int64_t[::1] carried
    cdef readonly Py_ssize_t n


@cython.final
cdef class WindowRequests:
    cdef readonly int64_t[::1] geometry
    cdef readonly double[:, :, ::1] frames
    cdef readonly double[:, ::1] slides
    cdef readonly double[:, ::1] directions
    cdef readonly double[::1] horizons
    cdef readonly double[::1] lengths
    cdef readonly double[::1] half_widths
    cdef readonly Py_ssize_t n


@cython.final
cdef class WindowLimits:
    cdef readonly double radius
    cdef readonly double reach
    cdef readonly double step
    cdef readonly Py_ssize_t limit
    cdef readonly double reuse
    cdef readonly double speeding_up


cpdef int same(str name, Py_ssize_t found, Py_ssize_t wanted) except -1
@cython.locals(i=Py_ssize_t)
cpdef int check_starts(const int64_t[::1] starts, Py_ssize_t n, int64_t limit) except -1
@cython.locals(i=Py_ssize_t)
cpdef int check_rows(const int64_t[::1] before, Py_ssize_t n) except -1
