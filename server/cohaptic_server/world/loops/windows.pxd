cimport cython
from libc.stdint cimport int64_t

from cohaptic_server.mesh.search.point_tree cimport PointTree
from cohaptic_server.mesh.search.window_vertices cimport WindowVertices

cdef int _PLANE, _MESH


@cython.locals(i=Py_ssize_t, k=Py_ssize_t, row=int64_t, a=int64_t, c=int64_t, e=int64_t,
               fits=Py_ssize_t, carries=Py_ssize_t, count=Py_ssize_t)
cpdef Py_ssize_t choose_windows(
    PointTree surface, WindowVertices finder, int64_t[::1] found,
    const int64_t[::1] found_fitted, const int64_t[::1] found_touched,
    const int64_t[::1] found_carried, Py_ssize_t first,
    const int64_t[::1] geometry, const double[:, :, ::1] frames, const double[:, ::1] slides,
    const double[:, ::1] directions, const double[::1] horizons, const double[::1] lengths,
    const double[::1] half_widths, double radius, double reach, double step, Py_ssize_t most,
    double reuse, double speeding_up, const int64_t[::1] before, const int64_t[::1] old_geometry,
    const double[:, ::1] old_keys, const int64_t[:, ::1] old_starts,
    const int64_t[::1] old_vertices, const int64_t[::1] old_fitted,
    const int64_t[::1] old_touched, const int64_t[::1] old_carried, double[:, ::1] keys,
    int64_t[:, ::1] starts, int64_t[::1] vertices, int64_t[::1] fitted, int64_t[::1] touched,
    int64_t[::1] carried) noexcept
@cython.locals(k=Py_ssize_t, moved=double, turned=double)
cdef bint covers(const double[:, ::1] keys, int64_t row, const double[:, :, ::1] frames,
                 const double[:, ::1] slides, const double[::1] horizons, Py_ssize_t i,
                 double speeding_up, double reuse) noexcept
@cython.locals(part=Py_ssize_t, size=int64_t, a=int64_t, b=int64_t, k=Py_ssize_t, shift=int64_t)
cdef bint copied(int64_t row, const int64_t[:, ::1] old_starts, const int64_t[::1] old_vertices,
                 const int64_t[::1] old_fitted, const int64_t[::1] old_touched,
                 const int64_t[::1] old_carried, Py_ssize_t i, int64_t[:, ::1] starts,
                 int64_t[::1] vertices, int64_t[::1] fitted, int64_t[::1] touched,
                 int64_t[::1] carried) noexcept
