cimport cython
from libc.stdint cimport int64_t

@cython.locals(n=Py_ssize_t, i=Py_ssize_t, c=Py_ssize_t, column=Py_ssize_t, e=Py_ssize_t, u=Py_ssize_t, v=Py_ssize_t, a=double, b=double, d=double)
cpdef void multiply(const double[:, ::1] blocks, const int64_t[::1] starts, const int64_t[::1] rows, const double[:, ::1] x, double[:, ::1] out) noexcept
