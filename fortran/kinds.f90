!> Working precision and integer kind of the whole kernel.
module jointfrf_kinds
  use, intrinsic :: iso_c_binding, only: c_double, c_int
  implicit none
  private

  integer, parameter, public :: dp = c_double
  integer, parameter, public :: ip = c_int
end module jointfrf_kinds
