!> The lane kernels for any processor.
module jointfrf_lanes_plain
  use, intrinsic :: iso_fortran_env, only: int64
  use jointfrf_kinds, only: dp
  use jointfrf_lanes, only: lane_kernels, lanes, largest_in_lanes, padded
#include "lanes.inc"
end module jointfrf_lanes_plain
