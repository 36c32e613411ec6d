# The functions of `dense.py` for compiled kernels: calls of BLAS and LAPACK by address. Linking to
# scipy's declarations in place of addresses would need scipy where the package is built.
from libc.stdint cimport int64_t

ctypedef fused real:
    float
    double

ctypedef void (*potrf_t)(char*, int*, void*, int*, int*) noexcept nogil
ctypedef void (*trsm_t)(char*, char*, char*, char*, int*, int*, void*, void*, int*, void*, int*) noexcept nogil
ctypedef void (*syrk_t)(char*, char*, int*, int*, void*, void*, int*, void*, void*, int*) noexcept nogil
ctypedef void (*gemm_t)(char*, char*, int*, int*, int*, void*, void*, int*, void*, int*, void*, void*, int*) noexcept nogil

cdef inline int cholesky(const int64_t[::1] routines, real[::1] values, Py_ssize_t at, Py_ssize_t size) noexcept nogil:
    cdef int n = <int>size, failed = 0
    (<potrf_t><size_t>routines[0])("L", &n, &values[at], &n, &failed)
    return failed

cdef inline void divide_rows(const int64_t[::1] routines, real[::1] values, Py_ssize_t at, Py_ssize_t width, Py_ssize_t height) noexcept nogil:
    cdef int n = <int>width, m = <int>height
    cdef real one = 1.0
    (<trsm_t><size_t>routines[1])("R", "L", "T", "N", &m, &n, &one, &values[at], &n, &values[at + width * width], &m)

cdef inline void negative_square(const int64_t[::1] routines, real[::1] values, Py_ssize_t at, Py_ssize_t width, Py_ssize_t height, real[::1] out, Py_ssize_t to) noexcept nogil:
    cdef int n = <int>width, m = <int>height
    cdef real minus = -1.0, zero = 0.0
    (<syrk_t><size_t>routines[2])("L", "N", &m, &n, &minus, &values[at + width * width], &m, &zero, &out[to], &m)

cdef inline void forward(const int64_t[::1] routines, real[::1] values, Py_ssize_t at, Py_ssize_t width, real[:, ::1] x, Py_ssize_t row) noexcept nogil:
    cdef int n = <int>width, r = <int>x.shape[1]
    cdef real one = 1.0
    (<trsm_t><size_t>routines[1])("R", "L", "T", "N", &r, &n, &one, &values[at], &n, &x[row, 0], &r)

cdef inline void backward(const int64_t[::1] routines, real[::1] values, Py_ssize_t at, Py_ssize_t width, real[:, ::1] x, Py_ssize_t row) noexcept nogil:
    cdef int n = <int>width, r = <int>x.shape[1]
    cdef real one = 1.0
    (<trsm_t><size_t>routines[1])("R", "L", "N", "N", &r, &n, &one, &values[at], &n, &x[row, 0], &r)

cdef inline void product(const int64_t[::1] routines, real[::1] values, Py_ssize_t at, Py_ssize_t width, Py_ssize_t height, real[:, ::1] x, Py_ssize_t row, real[:, ::1] out) noexcept nogil:
    cdef int n = <int>width, m = <int>height, r = <int>x.shape[1]
    cdef real one = 1.0, zero = 0.0
    (<gemm_t><size_t>routines[3])("N", "T", &r, &m, &n, &one, &x[row, 0], &r, &values[at + width * width], &m, &zero, &out[0, 0], &r)

cdef inline void subtract_product(const int64_t[::1] routines, real[::1] values, Py_ssize_t at, Py_ssize_t width, Py_ssize_t height, real[:, ::1] x, Py_ssize_t row, real[:, ::1] by) noexcept nogil:
    cdef int n = <int>width, m = <int>height, r = <int>x.shape[1]
    cdef real one = 1.0, minus = -1.0
    (<gemm_t><size_t>routines[3])("N", "N", &r, &n, &m, &minus, &by[0, 0], &r, &values[at + width * width], &m, &one, &x[row, 0], &r)
