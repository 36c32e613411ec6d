cimport cython
from libc.stdint cimport int64_t


@cython.final
cdef class PointTree:
    cdef readonly int64_t levels
    cdef readonly int64_t count
    cdef readonly const int64_t[::1] order
    cdef readonly int64_t[::1] rank
    cdef readonly const double[:, ::1] points
    cdef readonly const double[:, ::1] boxes
    cdef readonly int64_t[::1] stack

    @cython.locals(best=double, square=double, node=int64_t, size=Py_ssize_t, found=int64_t,
                   k=int64_t, nearer=int64_t)
    cpdef int64_t nearest(self, double x, double y, double z) noexcept
    @cython.locals(count=Py_ssize_t, k=Py_ssize_t)
    cpdef Py_ssize_t within(self, double x, double y, double z, double radius,
                            int64_t[::1] found) noexcept
    @cython.locals(limit=double, node=int64_t, size=Py_ssize_t, count=Py_ssize_t, k=int64_t)
    cdef Py_ssize_t inside(self, double x, double y, double z, double radius,
                           int64_t[::1] found) noexcept
    @cython.locals(leaf=int64_t)
    cdef int64_t first(self, int64_t node) noexcept
    @cython.locals(dx=double, dy=double, dz=double)
    cdef double square(self, int64_t k, double x, double y, double z) noexcept
    @cython.locals(dx=double, dy=double, dz=double)
    cdef double apart(self, int64_t node, double x, double y, double z) noexcept
    @cython.locals(gap=Py_ssize_t, i=Py_ssize_t, j=Py_ssize_t, number=int64_t)
    cpdef void sort(self, int64_t[::1] numbers, Py_ssize_t count) noexcept
