!> The noise kernels for any processor.
module jointfrf_noise_plain
  use, intrinsic :: iso_fortran_env, only: int64
  use jointfrf_kinds, only: dp
  use jointfrf_lanes, only: lane_kernels, lanes
#include "noise.inc"
end module jointfrf_noise_plain
