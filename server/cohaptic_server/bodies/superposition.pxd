cimport cython
from libc.stdint cimport int64_t


@cython.locals(i=Py_ssize_t, j=Py_ssize_t, k=int64_t, a=int64_t, b=int64_t, x=double, y=double,
               z=double, ax=double, ay=double, az=double, bx=double, by=double, bz=double, one=double)
cpdef void superpose(const float[:, ::1] C, const int64_t[::1] starts, const int64_t[::1] ends,
                     const int64_t[::1] vertices, const double[::1] weights,
                     const double[:, ::1] directions, double[:, ::1] fields) noexcept
@cython.locals(i=Py_ssize_t, j=Py_ssize_t, k=int64_t, a=int64_t, moved=double, along=double,
               x=double, y=double, z=double)
cpdef void seen_by(const double[:, ::1] fields, const int64_t[::1] starts,
                   const int64_t[::1] ends, const int64_t[::1] vertices,
                   const double[::1] weights, const double[:, ::1] directions,
                   double[:, ::1] C) noexcept
@cython.locals(user=Py_ssize_t, first=int64_t, last=int64_t, k=int64_t, v=int64_t,
               axis=Py_ssize_t, i=int64_t, force=double)
cpdef void subtract_own(const double[:, ::1] displacement, const double[:, :, ::1] fields,
                        const int64_t[::1] spans, const double[::1] forces,
                        const int64_t[::1] starts, const int64_t[::1] vertices,
                        double[:, ::1] left) noexcept
