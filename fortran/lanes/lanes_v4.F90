!> The lane kernels for x86-64-v4 (AVX-512).
module jointfrf_lanes_v4
  use, intrinsic :: iso_fortran_env, only: int64
  use jointfrf_elimination_plan, only: elimination_plan
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lanes, only: doubtful, in_doubt, lane_kernels, lanes, largest_in_lanes, padded
  use jointfrf_lookahead, only: advance, lookahead, spread_over
#include "lanes.inc"
end module jointfrf_lanes_v4
