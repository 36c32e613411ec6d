cimport cython
cimport libc.math as math
from libc.stdint cimport int64_t

cdef double MARGIN, DEEPEST, FEW, UNKNOWN
cdef Py_ssize_t FACT, VERTEX, SUPPORT_AT, C_II_AT, INNER_AT, NORMAL_AT


@cython.final
cdef class RestSurface:
    cdef const double[::1] points
    cdef const double[::1] support
    cdef const int64_t[::1] starts
    cdef const int64_t[::1] ring
    cdef int64_t[::1] place
    cdef public object owner


@cython.locals(k=Py_ssize_t, i=Py_ssize_t, at=Py_ssize_t, c_ii=double)
cdef void _unpack(const short[::1] words, double scale, double c_scale, double least,
                  double[::1] facts, Py_ssize_t count) noexcept


@cython.final
cdef class MeshFit:
    cdef RestSurface rest
    cdef const double[::1] facts
    cdef double out_x, out_y, out_z
    cdef Py_ssize_t count
    cdef double[::1] vertices
    cdef int64_t[::1] near
    cdef Py_ssize_t gathered
    cdef readonly double deepest
    cdef double reached
    cdef double center_x, center_y, center_z

    @cython.locals(k=Py_ssize_t, i=Py_ssize_t, fact=Py_ssize_t, at=Py_ssize_t, number=int64_t,
                   total=double)
    cdef void begin(self) noexcept
    @cython.locals(k=Py_ssize_t, at=Py_ssize_t, below=double, total=double, inner=double, c=double,
                   along=double, spread=double, sx=double, sy=double, sz=double, nx=double,
                   ny=double, nz=double, dx=double, dy=double, dz=double, square=double, w=double,
                   ax=double, ay=double, az=double, ux=double, uy=double, uz=double,
                   length=double, bending=double, foot=double, deep=double,
                   v=double[::1])
    cpdef object evaluate(self, double px, double py, double pz, double depth)
    @cython.locals(square=double, fraction=double)
    cdef double below(self, double depth) noexcept
    @cython.locals(k=Py_ssize_t, at=Py_ssize_t, below=double, dx=double, dy=double, dz=double,
                   r=double, found=Py_ssize_t, v=double[::1])
    cdef void gather(self, double px, double py, double pz, double depth) noexcept
    @cython.locals(k=Py_ssize_t, i=Py_ssize_t, number=int64_t, first=int64_t, second=int64_t,
                   one=Py_ssize_t, two=Py_ssize_t, known=double, nx=double, ny=double, nz=double,
                   ax=double, ay=double, az=double, bx=double, by=double, bz=double, area=double,
                   length=double, v=double[::1])
    cdef void find_normal(self, Py_ssize_t at) noexcept
    @cython.locals(k=Py_ssize_t)
    cdef Py_ssize_t where(self, int64_t number) noexcept
    cdef double edge(self, Py_ssize_t at, Py_ssize_t place, int64_t number, Py_ssize_t i) noexcept
