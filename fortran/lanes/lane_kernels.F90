!> The lane kernels: linear algebra, condensation, superposition of modes and propagation of noise, for eight lines side
!> by side.
!>
!> One source for all instruction sets: the build sets JF_MODULE, the name of the module, the instructions that the
!> compiler may use, and JF_OWN_INVERSES and JF_OWN_SOLUTIONS, the orders up to which every line has pivots of its own.
!> Loops over lanes (index l) are outermost or alone and have no branches; inner loops step by a fixed number of
!> elements and test at the bottom. The compiler then turns each statement into one instruction for all lanes.
module JF_MODULE
  use, intrinsic :: iso_fortran_env, only: int64
  use jointfrf_elimination_plan, only: elimination_plan
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lanes, only: doubtful, in_doubt, lane_kernels, lanes, largest_constant, largest_in_lanes, &
    padded, sparse_rows
  use jointfrf_lookahead, only: advance, lookahead, spread_over
  implicit none
  private
  public :: set_kernels

  real(dp), parameter :: not_a_number = transfer(int(z'7FF8000000000000', int64), 1.0_dp)

  integer(ip), parameter :: line_good = 0
  !> A pivot this large, of the largest candidate, is shared by all lanes. A half takes a fifth longer on
  !> noisy data; a quarter doubles the residual of partial pivoting.
  real(dp), parameter :: pivot_share = 1.0_dp/3.0_dp
  !> The same for inverses of small order, where a line loses more to one poor pivot and an exchange of rows costs less.
  real(dp), parameter :: small_pivot_share = 0.5_dp

contains

  !> The kernels of this module.
  subroutine set_kernels(kernels)
    type(lane_kernels), intent(out) :: kernels

    kernels%judge => judge_lines
    kernels%load => load_lanes
    kernels%pick => pick_lanes
    kernels%store => store_lanes
    kernels%total => total_of_lanes
    kernels%copy => copy_elements
    kernels%fill => fill_elements
    kernels%combine => combine_elements
    kernels%product => multiply
    kernels%invert => invert_lanes
    kernels%solve => solve_lanes
    kernels%invert_lines => invert_lines
    kernels%divide_lines => divide_lines
    kernels%identify_lines => identify_lines
    kernels%invert_joint_lines => invert_joint_lines
    kernels%eliminate => eliminate_by_plan
    kernels%superpose => superpose
    kernels%transform_lines => transform_lines
    kernels%weigh_lines => weigh_lines
    kernels%weigh_rows => weigh_rows_of_lanes
    kernels%propagate => propagate_noise
    kernels%add_moduli => add_moduli
  end subroutine set_kernels

  subroutine judge_lines(n_lines, total, line_info, rcond)
    integer, intent(in) :: n_lines
    real(dp), intent(in) :: total(n_lines)
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(inout) :: rcond(n_lines)
    integer :: l

    do l = 1, n_lines
      line_info(l) = merge(line_good, in_doubt, total(l) <= huge(1.0_dp) .and. rcond(l) > doubtful &
                           .and. rcond(l) <= huge(1.0_dp))
      rcond(l) = min(1.0_dp, rcond(l))
    end do
  end subroutine judge_lines

#include "layout.inc"
#include "product.inc"
#include "panel_elimination.inc"
#include "inverse.inc"
#include "small_inverse.inc"
#define JF_ORDER 3
#define JF_INVERT invert_order_3
#include "own_inverse.inc"
#include "constant_order.inc"
#undef JF_ORDER
#undef JF_INVERT
#define JF_ORDER 4
#define JF_INVERT invert_order_4
#include "own_inverse.inc"
#include "constant_order.inc"
#undef JF_ORDER
#undef JF_INVERT
#define JF_ORDER 5
#define JF_INVERT invert_order_5
#include "own_inverse.inc"
#include "constant_order.inc"
#undef JF_ORDER
#undef JF_INVERT
#define JF_ORDER 6
#define JF_INVERT invert_order_6
#include "own_inverse.inc"
#include "constant_order.inc"
#undef JF_ORDER
#undef JF_INVERT
#define JF_ORDER 7
#define JF_INVERT invert_order_7
#include "own_inverse.inc"
#include "constant_order.inc"
#undef JF_ORDER
#undef JF_INVERT
#include "solution.inc"
#include "small_solution.inc"
#define JF_ORDER 3
#define JF_SOLVE solve_order_3
#include "own_solution.inc"
#undef JF_ORDER
#undef JF_SOLVE
#define JF_ORDER 4
#define JF_SOLVE solve_order_4
#include "own_solution.inc"
#undef JF_ORDER
#undef JF_SOLVE
#define JF_ORDER 5
#define JF_SOLVE solve_order_5
#include "own_solution.inc"
#undef JF_ORDER
#undef JF_SOLVE
#include "closed_forms.inc"
#include "condensation.inc"
#include "modal_superposition.inc"
#include "transformation.inc"
#include "noise_propagation.inc"
#include "full_transformation.inc"
end module JF_MODULE
