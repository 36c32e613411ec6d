cimport cython
from libc.stdint cimport int64_t, uint16_t

cdef double _TO_WHOLE, _HUGE

@cython.locals(k=Py_ssize_t, axis=Py_ssize_t, most=double, c_most=double, size=double)
cpdef bint largest(const double[:, ::1] displacement, const double[::1] c_ii,
                   double[::1] found) noexcept
@cython.locals(k=Py_ssize_t, axis=Py_ssize_t, before=int64_t, rising=bint, vertex=int64_t,
               whole=int64_t)
cpdef bint pack(const int64_t[::1] vertices, const double[:, ::1] displacement,
                const double[::1] c_ii, double per, double c_per,
                uint16_t[:, ::1] numbers) noexcept
