cimport cython
from libc.stdint cimport int64_t

from cohaptic_server.mesh.search.point_tree cimport PointTree

cdef double _BESIDE, _BEHIND


@cython.final
cdef class PressureSearch:
    cdef PointTree tree
    cdef const double[::1] areas
    cdef const int64_t[:, ::1] corners
    cdef const double[:, ::1] fractions
    cdef const double[:, ::1] outward
    cdef int64_t[::1] under
    cdef double[::1] weights
    cdef int64_t[::1] found
    cdef double[::1] table
    cdef Py_ssize_t count
    cdef double total

    @cython.locals(limit=double, points=Py_ssize_t, k=Py_ssize_t, point=int64_t, facing=double,
                   fraction=double, profile=double, vertex=int64_t)
    cpdef Py_ssize_t spread(self, double x, double y, double z, double nx, double ny, double nz,
                            double radius) noexcept
    @cython.locals(corner=Py_ssize_t, vertex=int64_t, part=double)
    cdef void load(self, int64_t point, double force) noexcept
