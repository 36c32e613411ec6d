cimport cython
from libc.stdint cimport int64_t

from cohaptic_server.mesh.search.bulge_fit cimport fit_bulge
from cohaptic_server.mesh.search.contact_search cimport ContactSearch
from cohaptic_server.mesh.search.loaded_field cimport LoadedField
from cohaptic_server.world.loops.rows cimport ContactRows, FieldRows, same


@cython.locals(i=Py_ssize_t, a=int64_t, b=int64_t, c=int64_t, d=int64_t)
cpdef Py_ssize_t put_contacts(
    ContactSearch search, LoadedField field, Py_ssize_t first, ContactRows contacts,
    FieldRows free, double[:, ::1] places) except -1
@cython.locals(n=Py_ssize_t, length=Py_ssize_t, i=Py_ssize_t, axis=Py_ssize_t, a=int64_t,
               b=int64_t, vertices="const int64_t[::1]", values="double[:, ::1]", sharp=double,
               fraction=double, k=int64_t, moved=double)
cpdef int flatten(
    const double[:, ::1] rest, const double[:, ::1] normals, const double[:, :, ::1] frames,
    const double[:, ::1] x_free, const double[::1] depths, double radius, double largest,
    double[:, ::1] matrix, FieldRows fields, double[:, ::1] shown) except -1
