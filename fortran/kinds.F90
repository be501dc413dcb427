!> Working precision and integer kinds of the whole kernel. JF_ILP64 is set by the build for programs whose default
!> integers have eight bytes, JF_LAPACK_ILP64 for a LAPACK that has such integers.
module jointfrf_kinds
  use, intrinsic :: iso_c_binding, only: c_double, c_int, c_int64_t
  implicit none
  private

  integer, parameter, public :: dp = c_double
  !> Integers of the caller.
#ifdef JF_ILP64
  integer, parameter, public :: ip = c_int64_t
#else
  integer, parameter, public :: ip = c_int
#endif
  !> Integers of LAPACK and BLAS.
#ifdef JF_LAPACK_ILP64
  integer, parameter, public :: blas_ip = c_int64_t
#else
  integer, parameter, public :: blas_ip = c_int
#endif
  !> Numbers of elements in memory.
  integer, parameter, public :: long = c_int64_t
end module jointfrf_kinds
