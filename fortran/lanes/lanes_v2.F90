!> The lane kernels for x86-64-v2 (SSE4.2).
module jointfrf_lanes_v2
  use, intrinsic :: iso_fortran_env, only: int64
  use jointfrf_kinds, only: dp
  use jointfrf_lanes, only: lane_kernels, lanes, largest_in_lanes, padded
#include "lanes.inc"
end module jointfrf_lanes_v2
