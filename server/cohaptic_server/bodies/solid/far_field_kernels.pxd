cimport cython
from libc.stdint cimport int64_t

@cython.locals(p=Py_ssize_t, i=Py_ssize_t, j=Py_ssize_t, v=Py_ssize_t)
cpdef bint spread(
    const int64_t[:, ::1] near, const double[:, ::1] carries, const int64_t[::1] vertices,
    const double[::1] weights, double[::1] out,
) noexcept

@cython.locals(
    size=Py_ssize_t, j=Py_ssize_t, p=Py_ssize_t, used=Py_ssize_t, rest=Py_ssize_t,
    a=Py_ssize_t, b=Py_ssize_t, c=Py_ssize_t, d=Py_ssize_t, e=float, f=float, g=float, h=float,
)
cpdef Py_ssize_t respond(
    const float[:, ::1] compliance, const double[::1] fractions, float[::1] sums, double[::1] out,
) noexcept

@cython.locals(
    i=Py_ssize_t, j=Py_ssize_t, v=Py_ssize_t, p=Py_ssize_t, x=double, y=double, z=double,
    fraction=double,
)
cpdef bint interpolate(
    const int64_t[:, ::1] near, const double[:, ::1] carries, const int64_t[::1] vertices,
    const double[:, ::1] values, double[:, ::1] out,
) noexcept

@cython.locals(p=Py_ssize_t, b=Py_ssize_t, f=double, g=double, h=double, moved=double)
cpdef void subtract(
    const double[:, ::1] values, const double[:, :, ::1] field, const double[::1] force,
    double[:, ::1] out,
) noexcept

@cython.locals(
    count=Py_ssize_t, i=Py_ssize_t, j=Py_ssize_t, a=Py_ssize_t, b=Py_ssize_t, p=Py_ssize_t,
    fraction=double,
)
cpdef void between(
    const double[:, ::1] spreads, const double[:, :, :, ::1] fields, double[:, :, :, ::1] out,
) noexcept

@cython.locals(
    i=Py_ssize_t, v=Py_ssize_t, total=double, whole=double, x=double, y=double, z=double,
    fraction=double,
)
cpdef double own_compliance(
    const double[:, ::1] blocks, const int64_t[::1] vertices, const double[::1] weights,
    const double[::1] direction,
) noexcept
