cimport cython
from libc.stdint cimport int64_t


@cython.locals(j=Py_ssize_t, k=Py_ssize_t, a=int64_t, b=int64_t, c=int64_t, d=int64_t, wa=double,
               wb=double, wc=double, wd=double, pair=double)
cpdef void combine(const float[:, ::1] rows, const int64_t[::1] vertices,
                   const double[::1] weights, double[::1] combined) noexcept
@cython.locals(i=Py_ssize_t, k=Py_ssize_t, v=int64_t, moved=double,
               x=double, y=double, z=double)
cpdef void seen_by(const double[:, :, ::1] fields, const int64_t[::1] vertices,
                   const double[::1] weights, const double[::1] direction, double[::1] C) noexcept
@cython.locals(i=Py_ssize_t, k=Py_ssize_t, axis=Py_ssize_t, v=int64_t)
cpdef void subtract(const double[:, ::1] displacement, const double[:, :, ::1] fields,
                    Py_ssize_t first, const double[::1] forces, const int64_t[::1] vertices,
                    double[:, ::1] left) noexcept
