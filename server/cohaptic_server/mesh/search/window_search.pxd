cimport cython
cimport libc.math as math
from libc.stdint cimport int64_t

from cohaptic_server.mesh.search.point_tree cimport PointTree


@cython.final
cdef class WindowSearch:
    cdef const double[:, ::1] points
    cdef const double[:, ::1] normals
    cdef const int64_t[:, ::1] beside
    cdef PointTree tree
    cdef int64_t[::1] found
    cdef double[:, ::1] path
    cdef double[:, ::1] tilt
    cdef int64_t[::1] reached
    cdef double[::1] least
    cdef double[::1] squares
    cdef double[::1] sorted
    cdef readonly Py_ssize_t places

    @cython.locals(x=double, y=double, z=double, near=Py_ssize_t, count=Py_ssize_t, k=Py_ssize_t,
                   first=int64_t, limit=double, kept=Py_ssize_t)
    cpdef Py_ssize_t along(self, const double[::1] start, const double[::1] normal,
                           const double[::1] direction, double length, double step,
                           double half_width, Py_ssize_t largest) noexcept
    @cython.locals(first=int64_t, best=double, k=Py_ssize_t, vertex=int64_t, least=double,
                   w=Py_ssize_t, dx=double, dy=double, dz=double, square=double)
    cdef int64_t mark(self, Py_ssize_t near, double widest) noexcept
    @cython.locals(count=Py_ssize_t, done=Py_ssize_t, vertex=int64_t, k=Py_ssize_t, other=int64_t)
    cdef Py_ssize_t spread(self, int64_t first) noexcept
    @cython.locals(x=double, y=double, z=double)
    cdef double facing(self, int64_t vertex, double nx, double ny, double nz) noexcept
    @cython.locals(x=double, y=double, z=double, hx=double, hy=double, hz=double,
                   places=Py_ssize_t, left=double, stride=double, fraction=double, k=int64_t,
                   nx=double, ny=double, nz=double, off=double)
    cpdef void walk(self, Py_ssize_t near, const double[::1] start, const double[::1] normal,
                          const double[::1] direction, double length, double step) noexcept
    @cython.locals(best=double, closest=int64_t, k=Py_ssize_t, vertex=int64_t, dx=double,
                   dy=double, dz=double, square=double)
    cdef int64_t closest(self, Py_ssize_t near, double x, double y, double z,
                         double nx, double ny, double nz) noexcept
    @cython.locals(k=Py_ssize_t, low=Py_ssize_t, high=Py_ssize_t, wanted=Py_ssize_t, pivot=double,
                   i=Py_ssize_t, j=Py_ssize_t)
    cdef double smallest(self, Py_ssize_t count, Py_ssize_t rank) noexcept
