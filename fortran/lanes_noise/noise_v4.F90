!> The noise kernels for x86-64-v4 (AVX-512).
module jointfrf_noise_v4
  use, intrinsic :: iso_fortran_env, only: int64
  use jointfrf_kinds, only: dp
  use jointfrf_lanes, only: lane_kernels, lanes
#include "noise.inc"
end module jointfrf_noise_v4
