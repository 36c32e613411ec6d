cimport cython
cimport libc.math as math
from libc.stdint cimport int64_t

@cython.locals(e=Py_ssize_t, i=Py_ssize_t, a=Py_ssize_t, b=Py_ssize_t, c=Py_ssize_t, c11=double, c22=double, c12=double, one=double, two=double, half=double, radius=double, cos=double, sin=double, c1=double)
cpdef void strains(const double[:, ::1] x, const int64_t[:, ::1] faces, const double[:, :, ::1] gradients, double[:, ::1] out) noexcept

@cython.locals(e=Py_ssize_t, c1=double, c2=double, total=double)
cpdef double energy(const double[:, ::1] strain, const double[::1] area) noexcept

@cython.locals(e=Py_ssize_t, k=Py_ssize_t, i=Py_ssize_t, c1=double, c2=double, s1=double, s2=double, cos=double, sin=double, along=double, across=double)
cpdef void add_forces(const double[:, ::1] strain, const int64_t[:, ::1] faces, const double[:, :, ::1] gradients, const double[::1] stiffness, double[:, ::1] out) noexcept

@cython.locals(e=Py_ssize_t, k=Py_ssize_t, i=Py_ssize_t, j=Py_ssize_t, a=Py_ssize_t, b=Py_ssize_t, pair=Py_ssize_t, target=Py_ssize_t, c1=double, c2=double, s1=double, s2=double, shear=double, k11=double, k22=double, k12=double, cos=double, sin=double, aa=double, cc=double, ac=double, ca=double, ff=double, gg=double, fg=double, gf=double, f=double, g=double, one=double, two=double)
cpdef void add_tangents(const double[:, ::1] strain, const double[:, :, ::1] gradients, const double[::1] stiffness, const int64_t[:, ::1] index, Py_ssize_t beyond, double[::1] scratch, double[:, ::1] blocks) noexcept

@cython.locals(e=Py_ssize_t, k=Py_ssize_t, a=Py_ssize_t, b=Py_ssize_t, c=Py_ssize_t)
cpdef void add_volume_gradient(const double[:, ::1] x, const int64_t[:, ::1] faces, double[:, ::1] out) noexcept

@cython.locals(e=Py_ssize_t, k=Py_ssize_t, target=Py_ssize_t, third=Py_ssize_t, sign=double, scale=double, u=double, v=double, w=double)
cpdef void add_pressure(const double[:, ::1] x, const int64_t[:, ::1] faces, double pressure, const int64_t[:, ::1] index, Py_ssize_t beyond, double[:, ::1] blocks) noexcept
