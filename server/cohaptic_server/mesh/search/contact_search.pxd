cimport cython
cimport libc.math as math
from libc.stdint cimport int64_t

from cohaptic_server.mesh.search.loaded_field cimport LoadedField
from cohaptic_server.mesh.search.nearest_search cimport NearestSearch
from cohaptic_server.mesh.search.pressure_search cimport PressureSearch


cdef int _MAX_ITERATIONS, _FOOT, _POINT, _NORMAL
cdef double _MAX_RATIO


@cython.final
cdef class ContactSearch:
    cdef const double[:, ::1] vertices
    cdef const double[:, ::1] normals
    cdef const int64_t[:, ::1] faces
    cdef const int64_t[:, ::1] rings
    cdef NearestSearch near
    cdef LoadedField field
    cdef PressureSearch pressure
    cdef double size
    cdef double[:, ::1] frame
    cdef int64_t[::1] under
    cdef double[::1] weights
    cdef readonly Py_ssize_t count
    cdef readonly double slope
    cdef int64_t[::1] gathered
    cdef double[::1] parts

    @cython.locals(i=Py_ssize_t, j=Py_ssize_t, k=Py_ssize_t)
    cpdef void take(self, const double[:, ::1] frame, double slope, const int64_t[::1] under,
                    const double[::1] weights) noexcept
    @cython.locals(i=Py_ssize_t, j=Py_ssize_t, k=Py_ssize_t)
    cpdef void store(self, double[:, ::1] frame, int64_t[::1] under, double[::1] weights) noexcept
    @cython.locals(state=int, limit=double, slope=double, before_x=double, before_y=double,
                   before_z=double, factor=double, ratio=double, step=int, gx=double, gy=double,
                   gz=double, nx=double, ny=double, nz=double, height=double, ox=double, oy=double,
                   oz=double, square=double)
    cpdef int locate(self, double x, double y, double z, double radius, bint again, double keep,
                     double tolerance) noexcept
    cpdef int look(self) noexcept
    @cython.locals(axis=Py_ssize_t)
    cpdef void put(self, double[::1] place) noexcept
    @cython.locals(moved=double, k=Py_ssize_t)
    cdef double gap(self, Py_ssize_t axis, double place) noexcept
    @cython.locals(axis=Py_ssize_t)
    cdef void move_to(self, double x, double y, double z) noexcept
    cdef void settle(self, double radius) noexcept
    @cython.locals(x=double, y=double, z=double, nx=double, ny=double, nz=double)
    cpdef void press(self, double radius) noexcept
    @cython.locals(face=int64_t, a=int64_t, b=int64_t, c=int64_t, ax=double, ay=double, az=double,
                   ux=double, uy=double, uz=double, vx=double, vy=double, vz=double)
    cdef void face_up(self) noexcept
    @cython.locals(length=double)
    cdef void set_normal(self, double nx, double ny, double nz) noexcept
    @cython.locals(x=double, y=double, z=double, nx=double, ny=double, nz=double, length=double,
                   height=double, k=Py_ssize_t, vertex=int64_t, weight=double)
    cpdef void lift(self) noexcept
    @cython.locals(nx=double, ny=double, nz=double, k=Py_ssize_t, weight=double, face=int64_t,
                   faces=Py_ssize_t, a=int64_t, b=int64_t, c=int64_t,
                   ax=double, ay=double, az=double, ux=double, uy=double, uz=double, vx=double,
                   vy=double, vz=double)
    cpdef void turn(self) noexcept
    @cython.locals(k=Py_ssize_t, j=Py_ssize_t, vertex=int64_t, first=int64_t, face=int64_t,
                   faces=Py_ssize_t, weight=double)
    cdef Py_ssize_t gather(self) noexcept
    cdef double place(self, int64_t vertex, Py_ssize_t axis) noexcept
