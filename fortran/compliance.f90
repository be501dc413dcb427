!> Joint compliance K*^-1 straight from receptances of the assembly at the joint, without model, first estimate or band.
module jointfrf_compliance
  use jointfrf_caller_memory, only: caller_memory
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lanes, only: element_matrix, element_space, lane_kernels, lanes, largest_solved, padded, real_lines
  use jointfrf_line_layout, only: all_finite, load, store, take_block
  use jointfrf_lines_lapack, only: product_line, room_to_solve, solve_line
  use jointfrf_status, only: line_good, line_not_finite, line_overflow
  use jointfrf_sweep, only: line_operation, line_space, run_sweep, worth_a_plan
  implicit none
  private
  public :: joint_compliance

  !> Where the blocks of gamma and C lie in lanes.
  type :: compliance_in_lanes
    real(dp), pointer, contiguous :: gamma(:, :, :), c_joint(:, :, :)
    integer, allocatable :: gamma_place(:), c(:)          !< in the caller's order
    integer, allocatable :: kk_row(:), c_row(:)           !< the element before each row
    integer :: jk_before                                  !< the element before the system gamma_jk X = gamma_jj
  end type compliance_in_lanes

  type, extends(line_operation) :: compliance
    logical :: transposed
    integer :: n
    complex(dp), pointer, contiguous :: gamma(:, :, :)
    type(compliance_in_lanes) :: plan
  contains
    procedure :: line => compliance_one
    procedure :: line_block => compliance_block
  end type compliance

contains

  !> C = gamma_kk gamma_jk^-1 gamma_jj - gamma_kj = K*^-1.
  !>
  !> Exact, because with gamma^-1 = [[Z_A + K*, -K*], [-K*, Z_B + K*]] one has gamma_kk gamma_jk^-1 = K*^-1 (Z_A + K*)
  !> and (Z_A + K*) gamma_jj - K* gamma_kj = I. Noise enters C almost linearly; it enters K* through an inverse.
  !> gamma     receptance of the assembly at DOFs j, then k, shape (2 n, 2 n, n_freq), m/N
  !> c_joint   joint compliance, shape (n, n, n_freq), m/N
  subroutine joint_compliance(transposed, gamma, c_joint, line_info, rcond, info, memory)
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: gamma(:, :, :)
    complex(dp), contiguous, target, intent(out) :: c_joint(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory
    type(compliance) :: operation
    integer :: n

    n = size(c_joint, 1)
    operation%transposed = transposed
    operation%n = n
    operation%gamma => gamma
    operation%result => c_joint
    operation%flops = 19.0_dp*real(n, dp)**3
    if (worth_a_plan(size(gamma, 3), memory) .and. n >= 1 .and. n <= largest_solved) call plan_compliance(operation)
    call run_sweep(operation, size(gamma, 3, kind=ip), line_info, rcond, info, memory)
  end subroutine joint_compliance

  subroutine plan_compliance(operation)
    type(compliance), intent(inout) :: operation
    type(element_matrix) :: jk, jj, kk, kj
    type(element_space) :: room
    integer :: n

    n = operation%n
    call room%system(n, n, operation%plan%jk_before, jk, jj)     ! jk is to be inverted, jj the right-hand sides
    kk = room%matrix(n, n)
    kj = room%matrix(n, n)                                       ! where C will be
    operation%n_hint = padded(n)
    operation%plan%gamma => real_lines(operation%gamma)
    call operation%reads(operation%plan%gamma)
    associate (plan => operation%plan)
      plan%c_joint => real_lines(operation%result)
      call room%in_memory(operation%transposed, jj, jk, kj, kk, plan%gamma_place)
      call room%in_memory(operation%transposed, kj, plan%c)
      call room%row_starts(kk, plan%kk_row)
      call room%row_starts(kj, plan%c_row)
    end associate
    call operation%lies_in(room, n)
  end subroutine plan_compliance

  subroutine compliance_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(compliance), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp) :: rcond_lanes(lanes), total(lanes)
    integer :: n

    n = self%n
    associate (plan => self%plan, x => space%x, row => space%list)
      call kernels%load(4*n*n, plan%gamma_place, first, n_lines, plan%gamma, x)
      call kernels%solve(n, n, n, plan%jk_before, x, space%hint, row, rcond_lanes, space%ahead)  ! gamma_jk^-1 gamma_jj
      call kernels%copy(n*n, -1.0_dp, plan%c, plan%c, x)
      call kernels%product(n, n, n, 1.0_dp, plan%kk_row, row, plan%c_row, x)
      call kernels%store(n*n, plan%c, first, n_lines, x, self%plan%c_joint)
      call kernels%total(n*n, plan%c, x, total)
      rcond = rcond_lanes(:n_lines)
      call kernels%judge(n_lines, total, line_info, rcond)
    end associate
  end subroutine compliance_block

  subroutine compliance_one(self, i, space, line_info, rcond)
    class(compliance), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: gamma(:, :), gamma_jk(:, :), gamma_kk(:, :), right(:, :), c(:, :)
    integer :: n

    n = self%n
    call space%take(2*n, 2*n, gamma)
    call space%take(n, n, gamma_jk)
    call space%take(n, n, gamma_kk)
    call space%take(n, n, right)
    call space%take(n, n, c)
    call room_to_solve(n, space)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (space%only_counts) return
    if (.not. all_finite(self%gamma(:, :, i))) return
    call load(self%transposed, self%gamma(:, :, i), gamma)
    call take_block(.false., 1.0_dp, gamma, 0, n, gamma_jk)
    call take_block(.false., 1.0_dp, gamma, n, n, gamma_kk)
    call take_block(.false., 1.0_dp, gamma, 0, 0, right)
    call solve_line(gamma_jk, right, space, line_info, rcond)       ! gamma_jk^-1 gamma_jj
    if (line_info /= line_good) return
    call take_block(.false., -1.0_dp, gamma, n, 0, c)
    call product_line('N', 'N', 1.0_dp, gamma_kk, right, c)
    if (.not. all_finite(c)) line_info = line_overflow
    call store(self%transposed, c, self%result(:, :, i))
  end subroutine compliance_one
end module jointfrf_compliance
