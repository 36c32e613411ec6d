cimport cython
cimport libc.math as math
from libc.stdint cimport int64_t

@cython.locals(e=Py_ssize_t, c=Py_ssize_t, i=Py_ssize_t, p=Py_ssize_t, y0=double, y1=double, y2=double, y3=double)
cpdef void corner_gradients(const double[:, ::1] x, const int64_t[:, ::1] elements, const double[:, :, ::1] gradients, const int64_t[:, ::1] nodes, const double[:, :, ::1] factors, double[:, :, ::1] out) noexcept

@cython.locals(e=Py_ssize_t, c=Py_ssize_t, s=Py_ssize_t, i=Py_ssize_t, f=double)
cpdef void nodal_forces(const double[:, :, ::1] stresses, const int64_t[:, ::1] elements, const double[:, :, ::1] gradients, const int64_t[:, ::1] nodes, const double[:, :, ::1] factors, double[:, ::1] out) noexcept

@cython.locals(a=double, b=double, c=double, d=double, f=double, g=double, h=double, k=double, m=double)
cdef inline double cofactors(const double[:, :, ::1] F, Py_ssize_t e, Py_ssize_t q, double[::1] cof) noexcept nogil

@cython.locals(e=Py_ssize_t, q=Py_ssize_t, i=Py_ssize_t, det=double, w=double, swell=double, squares=double, spread=double, energy=double)
cpdef double stresses(double[:, :, ::1] F, const double[:, ::1] weights, const double[::1] mu, const double[::1] lame, double[:, ::1] J, double[::1] cof) noexcept

@cython.locals(e=Py_ssize_t)
cpdef void moduli(double[:, :, ::1] F, const double[:, :, ::1] gradients, const double[:, ::1] weights, const double[:, :, ::1] shapes, const int64_t[:, ::1] terms, const double[::1] mu, const double[::1] lame, double[::1] cof, double[:, ::1] scratch, double[:, :, ::1] swell, double[:, :, ::1] weighted) noexcept

@cython.locals(points=Py_ssize_t, q=Py_ssize_t, i=Py_ssize_t, a=Py_ssize_t, s=Py_ssize_t, t=Py_ssize_t, k=Py_ssize_t, det=double, first=double, w=double, inverse=double, log_part=double, first_constant=double, slope=double, g0=double, g1=double, g2=double)
cdef void moduli_of_element(Py_ssize_t e, double[:, :, ::1] F, const double[:, :, ::1] gradients, const double[:, ::1] weights, const double[:, :, ::1] shapes, const int64_t[:, ::1] terms, const double[::1] mu, const double[::1] lame, double[::1] cof, double[:, ::1] scratch, double[:, :, ::1] swell, double[:, :, ::1] weighted) noexcept nogil

@cython.locals(e=Py_ssize_t, k=Py_ssize_t, r=Py_ssize_t, s=Py_ssize_t)
cpdef void turns(const double[:, :, ::1] moments, const double[:, :, ::1] normals, double[:, :, :, ::1] out) noexcept

@cython.locals(e=Py_ssize_t, a=Py_ssize_t, b=Py_ssize_t, i=Py_ssize_t, j=Py_ssize_t, k=Py_ssize_t, pair=Py_ssize_t, t0=double, t1=double, t2=double)
cpdef void add_tangents(const double[:, :, ::1] swell, const double[:, :, ::1] turn, const int64_t[:, ::1] index, Py_ssize_t count, Py_ssize_t beyond, double[:, ::1] blocks) noexcept
