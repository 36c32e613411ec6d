cimport cython
from libc.stdint cimport int8_t, int64_t

from cohaptic_server.mesh.search.point_tree cimport PointTree
from cohaptic_server.mesh.search.window_search cimport WindowSearch


@cython.final
cdef class WindowVertices:
    cdef PointTree surface
    cdef PointTree touch
    cdef WindowSearch ahead
    cdef readonly int64_t[::1] touched
    cdef const int64_t[::1] members
    cdef const double[:, ::1] normals
    cdef readonly int64_t[::1] vertices
    cdef readonly int64_t[::1] fitted
    cdef readonly int64_t[::1] carried
    cdef readonly Py_ssize_t count
    cdef readonly Py_ssize_t fits
    cdef readonly Py_ssize_t carries
    cdef int64_t[::1] found
    cdef int64_t[::1] place
    cdef int8_t[::1] member

    @cython.locals(x=double, y=double, z=double, near=Py_ssize_t, k=Py_ssize_t, vertex=int64_t,
                   facing=double)
    cpdef void choose(self, const double[::1] start, const double[::1] normal, double radius, double reach,
                      const double[::1] direction, double length, double step, double half_width,
                      Py_ssize_t limit) noexcept
    cdef void add(self, int64_t vertex) noexcept
