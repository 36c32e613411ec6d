cimport cython
cimport libc.math as math
from libc.stdint cimport int64_t

cdef int _UNKNOWNS
cdef double _TIKHONOV
cdef int _POINT
cdef int _NORMAL


@cython.locals(nx=double, ny=double, nz=double, sign=double, a=double, b=double, ux=double,
               uy=double, uz=double, vx=double, vy=double, vz=double, used=int, i=Py_ssize_t,
               j=Py_ssize_t, k=Py_ssize_t, vertex=int64_t, facing=double, x=double, y=double,
               z=double, weight=double, height=double, s=double, t=double, trace=double, ss=double,
               st=double, tt=double, half=double)
cpdef double fit_bulge(const double[:, ::1] rest, const double[:, ::1] normals,
                       const int64_t[::1] vertices, const double[:, ::1] displacement,
                       const double[:, ::1] frame, double radius, double[:, ::1] matrix) noexcept
@cython.locals(i=Py_ssize_t, j=Py_ssize_t, row=Py_ssize_t, fraction=double)
cdef void add_height(double[:, ::1] matrix, double s, double t, double height,
                     double weight) noexcept
@cython.locals(i=Py_ssize_t, j=Py_ssize_t, row=Py_ssize_t, factor=double)
cdef void solve(double[:, ::1] matrix) noexcept
