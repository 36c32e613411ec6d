cimport cython
from libc.stdint cimport int64_t

from cohaptic_server.mesh.search.point_tree cimport PointTree
from cohaptic_server.mesh.search.window_vertices cimport WindowVertices
from cohaptic_server.world.loops.rows cimport WindowLimits, WindowRequests, WindowRows, check_rows, same

cdef int _PLANE, _MESH


@cython.locals(i=Py_ssize_t, k=Py_ssize_t, row=int64_t, a=int64_t, c=int64_t, e=int64_t,
               fits=Py_ssize_t, carries=Py_ssize_t, count=Py_ssize_t, foot="const double[::1]")
cpdef Py_ssize_t choose_windows(
    PointTree surface, int64_t[::1] found, WindowVertices finder, Py_ssize_t first,
    WindowRequests asked, WindowLimits limits, const int64_t[::1] before, WindowRows old,
    WindowRows new) except -1
@cython.locals(k=Py_ssize_t, reuse=double, moved=double, turned=double)
cdef bint covers(WindowRows old, int64_t row, WindowRequests asked, Py_ssize_t i,
                 WindowLimits limits) noexcept
@cython.locals(part=Py_ssize_t, size=int64_t, a=int64_t, b=int64_t, k=Py_ssize_t, shift=int64_t)
cdef bint copied(WindowRows old, int64_t row, WindowRows new, Py_ssize_t i) noexcept
