!> The noise kernels: random numbers, noise on FRFs, and moments of what comes of it.
!>
!> One source for all instruction sets, as `lane_kernels.F90` is, loops written alike. Every bit is the same with every
!> instruction set: only operations that IEEE 754 rounds correctly, in a fixed order, and none contracted (the build
!> says so). Integers wrap around (the build says that too).
module JF_MODULE
  use, intrinsic :: iso_fortran_env, only: int64
  use jointfrf_kinds, only: dp
  use jointfrf_lanes, only: lane_kernels, lanes
  implicit none
  private
  public :: set_noise_kernels

contains

  !> The noise kernels of this module; other kernels are left as they are.
  subroutine set_noise_kernels(kernels)
    type(lane_kernels), intent(inout) :: kernels

    kernels%random_words => random_words
    kernels%normals => draw_normals
    kernels%uniforms => draw_uniforms
    kernels%pollute_flat => pollute_flat
    kernels%pollute_lanes => pollute_lanes
    kernels%largest => largest_modulus
    kernels%moments => update_moments
  end subroutine set_noise_kernels

#include "random_numbers.inc"
#include "pollution.inc"
end module JF_MODULE
