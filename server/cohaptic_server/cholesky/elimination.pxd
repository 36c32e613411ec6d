cimport cython
cimport cohaptic_server.cholesky.dense_calls as dense
from cohaptic_server.cholesky.dense_calls cimport real
from libc.stdint cimport int64_t

@cython.locals(k=Py_ssize_t, width=Py_ssize_t, height=Py_ssize_t, at=Py_ssize_t)
cpdef int eliminate(Py_ssize_t begin, Py_ssize_t end, const int64_t[:, ::1] table, const int64_t[:, ::1] where, const int64_t[::1] children, const int64_t[::1] starts, const int64_t[::1] places, const double[:, ::1] blocks, real[::1] updates, real[::1] values, const int64_t[::1] routines) noexcept

@cython.locals(first=Py_ssize_t, last=Py_ssize_t, start=Py_ssize_t, width=Py_ssize_t, height=Py_ssize_t, below=Py_ssize_t, column=Py_ssize_t, at=Py_ssize_t, e=Py_ssize_t, row=Py_ssize_t, j=Py_ssize_t, target=Py_ssize_t, c=Py_ssize_t, child=Py_ssize_t, nodes=Py_ssize_t, inner=Py_ssize_t, rows=Py_ssize_t, q=Py_ssize_t, source=Py_ssize_t, p=Py_ssize_t, end=Py_ssize_t, i=Py_ssize_t)
cpdef void load_front(Py_ssize_t k, const int64_t[:, ::1] table, const int64_t[:, ::1] where, const int64_t[::1] children, const int64_t[::1] starts, const int64_t[::1] places, const double[:, ::1] blocks, real[::1] updates, real[::1] values) noexcept nogil

@cython.locals(width=Py_ssize_t, height=Py_ssize_t, c=Py_ssize_t, child=Py_ssize_t, nodes=Py_ssize_t, inner=Py_ssize_t, rows=Py_ssize_t, q=Py_ssize_t, j=Py_ssize_t, into=Py_ssize_t, source=Py_ssize_t, p=Py_ssize_t, end=Py_ssize_t, target=Py_ssize_t, i=Py_ssize_t)
cdef void add_updates(Py_ssize_t k, const int64_t[:, ::1] table, const int64_t[:, ::1] where, const int64_t[::1] children, real[::1] updates) noexcept nogil
