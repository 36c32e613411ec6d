cimport cython
from libc.stdint cimport int64_t

from cohaptic_server.mesh.search.point_tree cimport PointTree


@cython.final
cdef class NearestSearch:
    cdef const double[:, ::1] vertices
    cdef const int64_t[:, ::1] faces
    cdef const int64_t[:, ::1] around
    cdef PointTree tree
    cdef int64_t split
    cdef readonly double[::1] foot
    cdef readonly int64_t face

    @cython.locals(face=int64_t, best=double, square=double, k=Py_ssize_t)
    cpdef void nearest(self, double x, double y, double z) noexcept
    @cython.locals(a=int64_t, b=int64_t, c=int64_t, ax=double, ay=double, az=double, ux=double,
                   uy=double, uz=double, vx=double, vy=double, vz=double, wx=double, wy=double,
                   wz=double, uu=double, uv=double, vv=double, wu=double, wv=double, det=double,
                   s=double, t=double, along=double)
    cdef double nearer(self, int64_t face, double x, double y, double z, double best) noexcept
    @cython.locals(px=double, py=double, pz=double, square=double)
    cdef double nearer_point(self, double ax, double ay, double az, double s, double t, double ux,
                             double uy, double uz, double vx, double vy, double vz, double x,
                             double y, double z, double best) noexcept
