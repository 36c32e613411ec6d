cimport cython
cimport libc.math as math
from libc.stdint cimport int64_t


@cython.locals(i=Py_ssize_t, axis=Py_ssize_t, height=double)
cpdef void heights(const double[:, :, ::1] frames, const double[:, ::1] tips,
                   const double[:, ::1] places, double[::1] found) noexcept
@cython.locals(i=Py_ssize_t, axis=Py_ssize_t, along=double)
cpdef void pressed(const double[:, :, ::1] frames, const double[:, ::1] forces,
                   const double[::1] limit, double[::1] found) noexcept
@cython.locals(i=Py_ssize_t, axis=Py_ssize_t, along=double)
cpdef void tangential_parts(const double[:, :, ::1] frames, const double[:, ::1] vectors,
                            double[:, ::1] found) noexcept
@cython.locals(i=Py_ssize_t, axis=Py_ssize_t, row=int64_t, interval=double, mean=double,
               newest=double)
cpdef void smoothed(const int64_t[::1] before, const double[:, ::1] tips,
                    const double[:, ::1] old_tips, const double[:, ::1] old,
                    const double[::1] times, const double[::1] old_times,
                    const double[::1] fresh, double least, double fraction,
                    double[:, ::1] found) noexcept
@cython.locals(i=Py_ssize_t, axis=Py_ssize_t, row=int64_t, square=double, way=double,
               anybody=bint)
cpdef bint jumped(const double[:, :, ::1] frames, const int64_t[::1] before,
                  const double[:, :, ::1] old, double limit, int64_t[::1] found) noexcept
