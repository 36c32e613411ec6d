cimport cython
cimport libc.math as math
from libc.stdint cimport int16_t, int64_t

cdef Py_ssize_t _PLACE
cdef Py_ssize_t _AHEAD
cdef double _FAR

cdef class NearFieldKernel:
    cdef const double[:, ::1] points
    cdef const int64_t[::1] rank
    cdef const float[:, ::1] slab
    cdef const int16_t[:, ::1] position
    cdef public int64_t rows_read
    cdef int64_t[::1] index
    cdef double[::1] fraction
    cdef float[::1] sums
    cdef int64_t[:, ::1] runs
    cdef float[::1] ahead

    @cython.locals(
        i=Py_ssize_t, v=Py_ssize_t, k=Py_ssize_t, found=Py_ssize_t, left=double, right=double,
        front=double, back=double, low=double, high=double, x=double, y=double, z=double,
    )
    cpdef Py_ssize_t reachable(
        self, const int64_t[::1] vertices, const double[:, ::1] centres, double reach,
        int64_t[::1] out,
    ) noexcept

    @cython.locals(
        count=Py_ssize_t, r=Py_ssize_t, i=Py_ssize_t, v=Py_ssize_t, b=Py_ssize_t, j=Py_ssize_t,
        p=Py_ssize_t, f=double, g=double, h=double, change=double,
    )
    cpdef void correct(
        self, double[:, ::1] u, const int64_t[::1] vertices, const int64_t[::1] order,
        const double[::1] centre, double full, double none, const int64_t[::1] kinds,
        const int64_t[::1] slots, const double[::1] weights, const double[::1] force,
        const double[:, :, ::1] replaced, const int64_t[:, ::1] near,
        const double[:, ::1] carries,
    ) noexcept

    @cython.locals(count=Py_ssize_t, i=Py_ssize_t, c=Py_ssize_t, r=Py_ssize_t)
    cpdef void block(
        self, const int64_t[::1] vertices, const int64_t[::1] order, const double[::1] pressure,
        const double[::1] centre, double full, double none, const int64_t[::1] kinds,
        const int64_t[::1] slots, const double[::1] weights, double[::1] counted, double[::1] out,
    ) noexcept

    @cython.locals(
        found=Py_ssize_t, k=Py_ssize_t, i=Py_ssize_t, v=Py_ssize_t, x=double, y=double, z=double,
        square=double, part=double,
    )
    cdef Py_ssize_t _find(
        self, const int64_t[::1] vertices, const int64_t[::1] order, const double[::1] centre,
        double full, double none,
    ) noexcept

    @cython.locals(
        j=Py_ssize_t, number=Py_ssize_t, total=Py_ssize_t, s=Py_ssize_t, t=Py_ssize_t,
        slot=Py_ssize_t, kind=Py_ssize_t, i=Py_ssize_t, at=Py_ssize_t, first=Py_ssize_t,
        shift=Py_ssize_t, weight=float,
    )
    cdef void _add(
        self, const int64_t[::1] vertices, Py_ssize_t count, const int64_t[::1] kinds,
        const int64_t[::1] slots, const double[::1] weights,
    ) noexcept

    @cython.locals(
        number=Py_ssize_t, first=Py_ssize_t, rank=Py_ssize_t, place=Py_ssize_t, end=Py_ssize_t,
    )
    cdef Py_ssize_t _find_runs(self, const int64_t[::1] vertices, Py_ssize_t count) noexcept

    @cython.locals(i=Py_ssize_t, at=Py_ssize_t, j=Py_ssize_t, end=Py_ssize_t, total=float)
    cdef void _read(self, Py_ssize_t slot, Py_ssize_t kind, Py_ssize_t number) noexcept
