!> The manifold kernels: FRFs that fit a joint, nearest to measured ones, and what the measured ones say of the joint.
!>
!> One source for all instruction sets, as `lane_kernels.F90` is, loops written alike. A lane does not know its
!> neighbours: a line alone has the same bits as in a sweep.
module JF_MODULE
  use jointfrf_kinds, only: dp
  use jointfrf_lanes, only: lane_kernels, lanes
  use jointfrf_manifold_plan, only: entry_group, manifold_plan
  implicit none
  private
  public :: set_manifold_kernels

contains

  !> The manifold kernels of this module; other kernels are left as they are.
  subroutine set_manifold_kernels(kernels)
    type(lane_kernels), intent(inout) :: kernels

    kernels%project => project_lanes
    kernels%expect => expect_lanes
    kernels%joint_form => joint_form_lanes
    kernels%diagonal_form => diagonal_form_lanes
    kernels%joint_normal => joint_normal_lanes
  end subroutine set_manifold_kernels

#include "product.inc"
#include "tangents.inc"
#include "normal_equations.inc"
#include "projection.inc"
#include "joint_form.inc"
#include "diagonal_joint.inc"
#include "pair_products.inc"
end module JF_MODULE
