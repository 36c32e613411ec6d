cimport cython
from libc.stdint cimport int64_t, uint16_t

cdef double _TO_WHOLE, _HUGE

@cython.locals(i=Py_ssize_t, k=int64_t, axis=Py_ssize_t, widest=double, softest=double,
               size=double, usable=bint)
cpdef void largest(const int64_t[::1] starts, const double[:, ::1] displacement,
                   const double[::1] c_ii, double[:, ::1] found) noexcept
@cython.locals(i=Py_ssize_t, k=int64_t, axis=Py_ssize_t, before=int64_t, vertex=int64_t,
               whole=int64_t)
cpdef Py_ssize_t pack(const int64_t[::1] starts, const int64_t[::1] vertices,
                      const double[:, ::1] displacement, const double[::1] c_ii,
                      const double[:, ::1] per, uint16_t[:, ::1] numbers) noexcept
