cimport cython
cimport cohaptic_server.cholesky.dense_calls as dense
from cohaptic_server.cholesky.dense_calls cimport real
from libc.stdint cimport int64_t

@cython.locals(k=Py_ssize_t, row=Py_ssize_t, width=Py_ssize_t, at=Py_ssize_t, nodes=Py_ssize_t, border=Py_ssize_t, p=Py_ssize_t, node=Py_ssize_t, to=Py_ssize_t, i=Py_ssize_t, c=Py_ssize_t)
cpdef void forward(Py_ssize_t begin, Py_ssize_t end, const int64_t[:, ::1] table, const int64_t[::1] borders, Py_ssize_t shared, Py_ssize_t shift, real[::1] values, real[:, ::1] x, real[:, ::1] scratch, const int64_t[::1] routines) noexcept

@cython.locals(back=Py_ssize_t, k=Py_ssize_t, row=Py_ssize_t, width=Py_ssize_t, at=Py_ssize_t, nodes=Py_ssize_t, border=Py_ssize_t, p=Py_ssize_t, i=Py_ssize_t, c=Py_ssize_t)
cpdef void backward(Py_ssize_t begin, Py_ssize_t end, const int64_t[:, ::1] table, const int64_t[::1] borders, real[::1] values, real[:, ::1] x, real[:, ::1] scratch, const int64_t[::1] routines) noexcept

