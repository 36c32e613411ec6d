cimport cython
from libc.stdint cimport int64_t

cdef int _UNKNOWNS, MIN_POINTS
cdef double _TIKHONOV


@cython.locals(i=Py_ssize_t, a=int64_t, b=int64_t, c=int64_t, d=int64_t)
cpdef void fit_spheres(const double[:, ::1] rest, const int64_t[:, ::1] starts,
                       const int64_t[::1] vertices, const double[:, ::1] displacement,
                       const int64_t[::1] rows, const double[:, ::1] points,
                       const double[:, ::1] normals, double radius, double[:, ::1] matrix,
                       double[::1] curvature) noexcept
@cython.locals(nx=double, ny=double, nz=double, used=int, i=Py_ssize_t, j=Py_ssize_t, r=Py_ssize_t,
               k=int64_t, v=int64_t, x=double, y=double, z=double, height=double, square=double,
               weight=double, trace=double, per=double)
cdef double fit_sphere(const double[:, ::1] rest, const int64_t[::1] vertices,
                       const double[:, ::1] displacement, const int64_t[::1] rows,
                       const double[::1] point, const double[::1] normal, double radius,
                       double[:, ::1] matrix) noexcept
cdef void add_point(double[:, ::1] matrix, double square, double x, double y, double z,
                    double height, double weight) noexcept
@cython.locals(i=Py_ssize_t, row=Py_ssize_t, j=Py_ssize_t, factor=double)
cdef double first_unknown(double[:, ::1] matrix) noexcept
