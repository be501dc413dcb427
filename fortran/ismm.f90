!> Inverse structural modification: the joint stiffness from receptances of the assembly (2.37)-(2.48).
module jointfrf_ismm
  use jointfrf_caller_memory, only: caller_memory
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lanes, only: element_matrix, element_space, lane_kernels, lanes, largest_in_lanes, padded, real_lines, &
    rows_in_memory, worse_of
  use jointfrf_line_layout, only: all_finite, load, store, subtract, take_block
  use jointfrf_lines_lapack, only: product_line, room_to_solve, solve_line
  use jointfrf_status, only: line_good, line_not_finite, line_overflow
  use jointfrf_sweep, only: line_operation, line_space, long_block, run_sweep, worth_a_plan
  implicit none
  private
  public :: ismm, inverse_substructuring

  !> Up to this order a matrix is inverted as a whole: that costs no more than to solve for half of the columns.
  integer, parameter :: largest_inverted = 6

  !> Where the matrices of ISMM lie in lanes. Elements are listed in the caller's order, unless said otherwise.
  type :: identification_in_lanes
    real(dp), pointer, contiguous :: alpha(:, :, :), gamma(:, :, :), k_initial(:, :, :), k_joint(:, :, :)
    integer, allocatable :: alpha_place(:)         !< in the system alpha Y = W, columns k, then j
    integer, allocatable :: gamma_place(:)         !< in the system gamma X = E_k
    integer, allocatable :: difference(:)          !< alpha - gamma
    integer, allocatable :: joint(:)               !< K0, then K*
    integer, allocatable :: unit(:)                !< right-hand sides E_k, row by row
    complex(dp), allocatable :: unit_value(:), zero(:)    !< E_k, and zeros
    integer, allocatable :: difference_row(:), w_row(:)   !< the element before each row
    integer, allocatable :: joint_row(:)           !< where alpha and gamma are inverted as a whole
    integer, allocatable :: columns_k(:), columns_k_row(:)   !< columns k of gamma^-1 then, row by row
    integer, allocatable :: w(:)                   !< W, row by row
    integer :: alpha_before, gamma_before          !< the element before each system
  end type identification_in_lanes

  !> The same for the short form.
  type :: short_identification_in_lanes
    real(dp), pointer, contiguous :: gamma(:, :, :), k_joint(:, :, :)
    integer, allocatable :: gamma_place(:), unit(:)
    integer, allocatable :: joint(:)               !< K*, where gamma is inverted as a whole
    complex(dp), allocatable :: unit_value(:)
    integer :: gamma_before
  end type short_identification_in_lanes

  type, extends(line_operation) :: identification
    logical :: transposed
    integer :: n
    complex(dp), pointer, contiguous :: alpha(:, :, :), gamma(:, :, :), k_initial(:, :, :)
    type(identification_in_lanes) :: plan
  contains
    procedure :: line => identify_one
    procedure :: line_block => identify_block
  end type identification

  type, extends(line_operation) :: short_identification
    logical :: transposed
    integer :: n
    complex(dp), pointer, contiguous :: gamma(:, :, :)
    type(short_identification_in_lanes) :: plan
  contains
    procedure :: line => invert_one
    procedure :: line_block => invert_block
  end type short_identification

contains

  !> K* = K0 - D_jk with D = alpha^-1 (alpha - gamma) gamma^-1. Eqs. (2.47), (2.48): D holds -Delta off its diagonal.
  !>
  !> Only the block jk is formed: rows j of alpha^-1 and columns k of gamma^-1. It holds for any alpha; where alpha was
  !> assembled through K0, it reduces to -(gamma^-1)_jk, see `inverse_substructuring`.
  !> alpha       receptance of the assembly with K0 at DOFs j, then k, shape (2 n, 2 n, n_freq), m/N
  !> gamma       measured receptance of the assembly, same DOFs and shape
  !> k_initial   K0, shape (n, n, n_freq), N/m
  !> k_joint     K*, shape (n, n, n_freq), N/m
  subroutine ismm(transposed, alpha, gamma, k_initial, k_joint, line_info, rcond, info, memory)
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: alpha(:, :, :), gamma(:, :, :), k_initial(:, :, :)
    complex(dp), contiguous, target, intent(out) :: k_joint(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory
    type(identification) :: operation
    integer :: n, m

    n = size(k_initial, 1)
    m = 2*n
    operation%transposed = transposed
    operation%n = n
    operation%alpha => alpha
    operation%gamma => gamma
    operation%k_initial => k_initial
    operation%result => k_joint
    operation%flops = 8.0_dp*real(m, dp)**3*(5.0_dp/3.0_dp)
    if (worth_a_plan(size(alpha, 3), memory) .and. n >= 1 .and. m <= largest_in_lanes) &
      call plan_identification(operation)
    call run_sweep(operation, size(alpha, 3, kind=ip), line_info, rcond, info, memory)
  end subroutine ismm

  subroutine plan_identification(operation)
    type(identification), intent(inout) :: operation
    type(element_matrix) :: alpha, w, gamma, unit, difference, joint
    type(element_space) :: room
    integer :: n, m

    n = operation%n
    m = 2*n
    operation%plan%alpha => real_lines(operation%alpha)
    operation%plan%gamma => real_lines(operation%gamma)
    operation%plan%k_initial => real_lines(operation%k_initial)
    operation%plan%k_joint => real_lines(operation%result)
    call operation%reads(operation%plan%alpha)
    call operation%reads(operation%plan%gamma)
    call operation%reads(operation%plan%k_initial)
    if (n == 1) then
      operation%block_lines = long_block
      operation%n_element = 1
      return
    else if (m <= largest_inverted) then
      call plan_inversions(operation)
      return
    end if
    call room%system(m, n, operation%plan%gamma_before, gamma, unit)
    call room%system(m, n, operation%plan%alpha_before, alpha, w)
    alpha%turn = n
    difference = room%matrix(m, m)
    joint = room%matrix(n, n)
    operation%n_hint = 2*padded(m)
    associate (plan => operation%plan)
      call room%in_memory(operation%transposed, gamma, plan%gamma_place)
      call room%in_memory(operation%transposed, alpha, plan%alpha_place)
      call room%in_memory(operation%transposed, difference, plan%difference)
      call room%in_memory(operation%transposed, joint, plan%joint)
      call room%in_memory(.true., unit, plan%unit)
      call unit_block(1.0_dp, m, n, room, plan%unit_value)
      call room%new_values(m*n, plan%zero)
      call room%in_memory(.true., w, plan%w)
      call room%row_starts(difference, plan%difference_row)
      call room%row_starts(w, plan%w_row)
    end associate
    call operation%lies_in(room, 2*m + n*n)
  end subroutine plan_identification

  !> Small matrices are inverted as a whole.
  subroutine plan_inversions(operation)
    type(identification), intent(inout) :: operation
    type(element_matrix) :: gamma, alpha, difference, columns_k, w, joint
    type(element_space) :: room
    integer :: n, m

    n = operation%n
    m = 2*n
    call room%system(m, 0, operation%plan%gamma_before, gamma)
    call room%system(m, 0, operation%plan%alpha_before, alpha)
    difference = room%matrix(m, m)
    columns_k = room%matrix(m, n)
    w = room%matrix(m, n)
    joint = room%matrix(n, n)
    operation%n_hint = 2*m
    associate (plan => operation%plan)
      call room%in_memory(operation%transposed, gamma, plan%gamma_place)
      call room%in_memory(operation%transposed, alpha, plan%alpha_place)
      call room%in_memory(operation%transposed, difference, plan%difference)
      call room%in_memory(operation%transposed, joint, plan%joint)
      call room%in_memory(.true., columns_k, plan%columns_k)
      call room%in_memory(.true., w, plan%w)
      call room%new_values(m*n, plan%zero)
      call room%row_starts(difference, plan%difference_row)
      call room%row_starts(columns_k, plan%columns_k_row)
      call room%row_starts(w, plan%w_row)
      call room%row_starts(joint, plan%joint_row)
    end associate
    call operation%lies_in(room, 0)
  end subroutine plan_inversions

  !> `identify_block` for two and three joint DOFs.
  subroutine identify_by_inverses(self, kernels, first, n_lines, space, line_info, rcond)
    class(identification), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp) :: rcond_alpha(lanes), rcond_gamma(lanes), total(lanes)
    integer, dimension(2*self%n, 2*self%n) :: gamma_inverse, alpha_inverse            ! where (column, row) lies; small
    integer :: columns_k(2*self%n**2), row(self%n), w_row(2*self%n), n, m, i

    n = self%n
    m = 2*n
    associate (plan => self%plan, x => space%x)
      call kernels%load(m*m, plan%gamma_place, first, n_lines, plan%gamma, x)
      call kernels%load(m*m, plan%alpha_place, first, n_lines, plan%alpha, x)
      call kernels%load(n*n, plan%joint, first, n_lines, plan%k_initial, x)
      call kernels%combine(m*m, 1.0_dp, plan%alpha_place, -1.0_dp, plan%gamma_place, plan%difference, x)
      call kernels%invert(m, plan%gamma_before, x, space%hint(:m), gamma_inverse, rcond_gamma, space%ahead)
      call kernels%invert(m, plan%alpha_before, x, space%hint(m + 1:), alpha_inverse, rcond_alpha)
      do i = 1, m
        columns_k((i - 1)*n + 1:i*n) = gamma_inverse(n + 1:, i)
      end do
      call kernels%copy(m*n, 1.0_dp, columns_k, plan%columns_k, x)
      call kernels%fill(m*n, plan%zero, plan%w, x)
      call kernels%product(m, n, m, 1.0_dp, plan%difference_row, plan%columns_k_row, plan%w_row, x)
      call rows_as_they_lie(alpha_inverse, plan%w_row, row, w_row)
      call kernels%product(n, n, m, -1.0_dp, row, w_row, plan%joint_row, x)   ! (2.47), (2.48)
      call kernels%store(n*n, plan%joint, first, n_lines, x, self%plan%k_joint)
      call kernels%total(n*n, plan%joint, x, total)
      rcond = worse_of(rcond_alpha(:n_lines), rcond_gamma(:n_lines))
      call kernels%judge(n_lines, total, line_info, rcond)
    end associate
  end subroutine identify_by_inverses

  !> The columns of an inverse lie in one order in all rows: a product takes the rows of its second factor in it.
  !> place     where the inverse lies, (column, row)
  !> b_row     the element before each row of the second factor
  !> row       the element before each of the first rows of the inverse
  !> ordered   b_row in the order of the inverse's columns
  pure subroutine rows_as_they_lie(place, b_row, row, ordered)
    integer, intent(in) :: place(:, :), b_row(:)
    integer, intent(out) :: row(:), ordered(:)
    integer :: i

    do i = 1, size(row)
      row(i) = minval(place(:, i)) - 1
    end do
    do i = 1, size(b_row)
      ordered(place(i, 1) - row(1)) = b_row(i)
    end do
  end subroutine rows_as_they_lie

  !> X = gamma^-1 E_k, W = (alpha - gamma) X, and of Y = alpha^-1 W the rows j, which are eliminated last: D_jk.
  subroutine identify_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(identification), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp) :: rcond_alpha(lanes), rcond_gamma(lanes), total(lanes)
    integer :: n, m

    if (self%n == 1) then
      call kernels%identify_lines(self%transposed, first, n_lines, self%plan%alpha, self%plan%gamma, &
                                  self%plan%k_initial, self%plan%k_joint, rcond)
      call kernels%judge(n_lines, 0*rcond, line_info, rcond)
      return
    else if (2*self%n <= largest_inverted) then
      call identify_by_inverses(self, kernels, first, n_lines, space, line_info, rcond)
      return
    end if
    n = self%n
    m = 2*n
    associate (plan => self%plan, x => space%x, x_row => space%list(:m), y_row => space%list(m + 1:2*m), &
               y => space%list(2*m + 1:))
      call kernels%load(m*m, plan%gamma_place, first, n_lines, plan%gamma, x)
      call kernels%load(m*m, plan%alpha_place, first, n_lines, plan%alpha, x)
      call kernels%load(n*n, plan%joint, first, n_lines, plan%k_initial, x)
      call kernels%combine(m*m, 1.0_dp, plan%alpha_place, -1.0_dp, plan%gamma_place, plan%difference, x)
      call kernels%fill(m*n, plan%unit_value, plan%unit, x)
      call kernels%solve(m, n, m, plan%gamma_before, x, space%hint(:padded(m)), x_row, rcond_gamma, space%ahead)
      call kernels%fill(m*n, plan%zero, plan%w, x)
      call kernels%product(m, n, m, 1.0_dp, plan%difference_row, x_row, plan%w_row, x)
      call kernels%solve(m, n, n, plan%alpha_before, x, space%hint(padded(m) + 1:), y_row, rcond_alpha)
      call rows_in_memory(self%transposed, y_row(n + 1:), n, y)
      call kernels%combine(n*n, 1.0_dp, plan%joint, -1.0_dp, y, plan%joint, x)      ! (2.47), (2.48): K* = K0 - D_jk
      call kernels%store(n*n, plan%joint, first, n_lines, x, self%plan%k_joint)
      call kernels%total(n*n, plan%joint, x, total)
      rcond = worse_of(rcond_alpha(:n_lines), rcond_gamma(:n_lines))
      call kernels%judge(n_lines, total, line_info, rcond)
    end associate
  end subroutine identify_block

  !> A factor times E_k row by row: zeros above the unit matrix.
  subroutine unit_block(factor, m, n, room, values)
    real(dp), intent(in) :: factor
    integer, intent(in) :: m, n
    type(element_space), intent(inout) :: room
    complex(dp), allocatable, intent(out) :: values(:)
    integer :: i

    call room%new_values(m*n, values)
    if (room%no_memory) return
    do i = 1, n
      values((m - n + i - 1)*n + i) = factor
    end do
  end subroutine unit_block

  subroutine identify_one(self, i, space, line_info, rcond)
    class(identification), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: alpha(:, :), gamma(:, :), difference(:, :), rows_j(:, :), columns_k(:, :)
    complex(dp), pointer, contiguous :: product(:, :), k_joint(:, :)
    real(dp) :: rcond_gamma
    integer :: n, m

    n = self%n
    m = 2*n
    call space%take(m, m, alpha)
    call space%take(m, m, gamma)
    call space%take(m, m, difference)
    call space%take(m, n, rows_j)
    call space%take(m, n, columns_k)
    call space%take(m, n, product)
    call space%take(n, n, k_joint)
    call room_to_solve(m, space)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (space%only_counts) return
    if (.not. (all_finite(self%alpha(:, :, i)) .and. all_finite(self%gamma(:, :, i)) &
               .and. all_finite(self%k_initial(:, :, i)))) return
    call load(self%transposed, self%alpha(:, :, i), alpha)
    call load(self%transposed, self%gamma(:, :, i), gamma)
    call load(self%transposed, self%k_initial(:, :, i), k_joint)
    call subtract(alpha, gamma, difference)
    call load(.not. self%transposed, self%alpha(:, :, i), alpha)        ! alpha^T
    call unit_columns(0, rows_j)
    call solve_line(alpha, rows_j, space, line_info, rcond)             ! rows j of alpha^-1, as columns
    if (line_info /= line_good) return
    call unit_columns(n, columns_k)
    call solve_line(gamma, columns_k, space, line_info, rcond_gamma)    ! columns k of gamma^-1
    rcond = min(rcond, rcond_gamma)
    if (line_info /= line_good) return
    product = 0
    call product_line('N', 'N', 1.0_dp, difference, columns_k, product)
    call product_line('T', 'N', -1.0_dp, rows_j, product, k_joint)      ! (2.47), (2.48): K* = K0 - D_jk
    if (.not. all_finite(k_joint)) line_info = line_overflow
    call store(self%transposed, k_joint, self%result(:, :, i))
  end subroutine identify_one

  !> K* = -(gamma^-1)_jk: what ISMM reduces to where alpha was assembled through K0.
  !>
  !> gamma^-1 = [[Z_A + K*, -K*], [-K*, Z_B + K*]], so the joint stands alone off the diagonal; no model is needed.
  !> gamma     measured receptance of the assembly at DOFs j, then k, shape (2 n, 2 n, n_freq), m/N
  !> k_joint   K*, shape (n, n, n_freq), N/m
  subroutine inverse_substructuring(transposed, gamma, k_joint, line_info, rcond, info, memory)
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: gamma(:, :, :)
    complex(dp), contiguous, target, intent(out) :: k_joint(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory
    type(short_identification) :: operation
    integer :: n, m

    n = size(k_joint, 1)
    m = 2*n
    operation%transposed = transposed
    operation%n = n
    operation%gamma => gamma
    operation%result => k_joint
    operation%flops = 8.0_dp*real(m, dp)**3*(5.0_dp/6.0_dp)
    if (worth_a_plan(size(gamma, 3), memory) .and. n >= 1 .and. m <= largest_in_lanes) &
      call plan_short_identification(operation)
    call run_sweep(operation, size(gamma, 3, kind=ip), line_info, rcond, info, memory)
  end subroutine inverse_substructuring

  subroutine plan_short_identification(operation)
    type(short_identification), intent(inout) :: operation
    type(element_matrix) :: gamma, unit
    type(element_space) :: room
    integer :: n, m

    n = operation%n
    m = 2*n
    operation%plan%gamma => real_lines(operation%gamma)
    operation%plan%k_joint => real_lines(operation%result)
    call operation%reads(operation%plan%gamma)
    operation%n_hint = padded(m)
    if (n == 1) then
      operation%block_lines = long_block
      operation%n_element = 1
      return
    else if (m <= largest_inverted) then
      call room%system(m, 0, operation%plan%gamma_before, gamma)
      call room%in_memory(operation%transposed, gamma, operation%plan%gamma_place)
      call room%in_memory(operation%transposed, room%matrix(n, n), operation%plan%joint)
      call operation%lies_in(room, 0)
      return
    end if
    call room%system(m, n, operation%plan%gamma_before, gamma, unit)
    gamma%turn = n
    associate (plan => operation%plan)
      call room%in_memory(operation%transposed, gamma, plan%gamma_place)
      call room%in_memory(.true., unit, plan%unit)
      call unit_block(-1.0_dp, m, n, room, plan%unit_value)
    end associate
    call operation%lies_in(room, m + n*n)
  end subroutine plan_short_identification

  !> gamma X = -E_k with the columns k before j, so that the wanted rows j of X are found first.
  subroutine invert_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(short_identification), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp) :: rcond_lanes(lanes), total(lanes)
    integer :: inverse(largest_inverted**2), of_joint(largest_inverted**2/4), n, m, i, j

    n = self%n
    m = 2*n
    if (n == 1) then
      call kernels%invert_joint_lines(self%transposed, first, n_lines, self%plan%gamma, self%plan%k_joint, rcond)
      call kernels%judge(n_lines, 0*rcond, line_info, rcond)
      return
    end if
    associate (plan => self%plan, x => space%x)
      call kernels%load(m*m, plan%gamma_place, first, n_lines, plan%gamma, x)
      if (m <= largest_inverted) then
        call kernels%invert(m, plan%gamma_before, x, space%hint, inverse, rcond_lanes, space%ahead)
        do j = 1, n
          do i = 1, n
            of_joint((j - 1)*n + i) = inverse(merge((j - 1)*m + n + i, (i - 1)*m + n + j, self%transposed))
          end do
        end do
        call kernels%copy(n*n, -1.0_dp, of_joint, plan%joint, x)
        call kernels%store(n*n, plan%joint, first, n_lines, x, self%plan%k_joint)
        call kernels%total(n*n, plan%joint, x, total)
        rcond = rcond_lanes(:n_lines)
        call kernels%judge(n_lines, total, line_info, rcond)
        return
      end if
      associate (row => space%list(:m), joint => space%list(m + 1:))
        call kernels%fill(m*n, plan%unit_value, plan%unit, x)
        call kernels%solve(m, n, n, plan%gamma_before, x, space%hint, row, rcond_lanes, space%ahead)
        call rows_in_memory(self%transposed, row(n + 1:), n, joint)
        call kernels%store(n*n, joint, first, n_lines, x, self%plan%k_joint)
        call kernels%total(n*n, joint, x, total)
        rcond = rcond_lanes(:n_lines)
        call kernels%judge(n_lines, total, line_info, rcond)
      end associate
    end associate
  end subroutine invert_block

  subroutine invert_one(self, i, space, line_info, rcond)
    class(short_identification), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: gamma(:, :), columns_k(:, :), k_joint(:, :)
    integer :: n

    n = self%n
    call space%take(2*n, 2*n, gamma)
    call space%take(2*n, n, columns_k)
    call space%take(n, n, k_joint)
    call room_to_solve(2*n, space)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (space%only_counts) return
    if (.not. all_finite(self%gamma(:, :, i))) return
    call load(self%transposed, self%gamma(:, :, i), gamma)
    call unit_columns(n, columns_k)
    call solve_line(gamma, columns_k, space, line_info, rcond)
    call take_block(.false., -1.0_dp, columns_k, 0, 0, k_joint)
    call store(self%transposed, k_joint, self%result(:, :, i))
  end subroutine invert_one

  !> The unit vectors first + 1, first + 2, ... as columns.
  pure subroutine unit_columns(first, columns)
    integer, intent(in) :: first
    complex(dp), contiguous, intent(out) :: columns(:, :)
    integer :: m

    columns = 0
    do m = 1, size(columns, 2)
      columns(first + m, m) = 1
    end do
  end subroutine unit_columns
end module jointfrf_ismm
