!> Receptances of a locally modified structure (2.31)-(2.36), and the modification that turns one set of receptances
!> into another (2.40), (2.47).
module jointfrf_modification
  use jointfrf_caller_memory, only: caller_memory
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lanes, only: element_matrix, element_space, lane_kernels, lanes, largest_solved, largest_product, &
    padded, real_lines
  use jointfrf_line_layout, only: all_finite, load, store, subtract
  use jointfrf_lines_lapack, only: product_line, room_to_solve, solve_line
  use jointfrf_lookahead, only: lookahead
  use jointfrf_status, only: line_good, line_not_finite, line_overflow
  use jointfrf_sweep, only: line_operation, line_space, run_sweep, worth_a_plan
  implicit none
  private
  public :: modify, find_modification
  public :: find_line_forces
  public :: modification_in_lanes, plan_modification, apply_in_lanes
  public :: forces_in_lanes, plan_forces, find_forces

  !> The matrices of one line of n DOFs that is modified at n_m coordinates.
  type :: modification_matrices
    complex(dp), pointer, contiguous :: h(:, :)          !< receptance, shape (n, n), changed in place
    complex(dp), pointer, contiguous :: d(:, :)          !< dynamic stiffness added, shape (n_m, n_m)
    complex(dp), pointer, contiguous :: columns(:, :)    !< receptance from forces at these coordinates, shape (n, n_m)
    complex(dp), pointer, contiguous :: rows(:, :)       !< receptance at these coordinates, shape (n_m, n)
    complex(dp), pointer, contiguous :: h_mm(:, :)       !< receptance among them, shape (n_m, n_m)
    complex(dp), pointer, contiguous :: system(:, :)     !< I + D H_mm
    complex(dp), pointer, contiguous :: forces(:, :)     !< (I + D H_mm)^-1 D rows
  end type modification_matrices

  !> Where the matrices lie in lanes from which the forces of a modification are found: D, [H_mm, rows], and the system
  !> [I + D H_mm, D rows].
  type :: forces_in_lanes
    integer :: n, n_m
    type(element_matrix) :: d, h_mm, rows
    integer :: right_before                        !< the element before [H_mm, rows], free when the forces are found
    integer, allocatable :: constant(:)            !< what the system begins with, [I, 0], and numbers without meaning
    complex(dp), allocatable :: constant_value(:)
    integer, allocatable :: d_row(:), right_row(:), panel_row(:)
    integer, allocatable :: right_rest_row(:), rest_row(:)     !< behind the first two columns
    integer :: n_rest                              !< columns of the system beside its first two
    integer :: system_before                       !< the element before the system
  end type forces_in_lanes

  !> The same, H, and columns.
  type :: modification_in_lanes
    type(forces_in_lanes) :: forces
    type(element_matrix) :: h, columns
    integer, allocatable :: columns_row(:), h_row(:)
  end type modification_in_lanes

  type, extends(line_operation) :: modification
    logical :: transposed
    integer :: n, n_m
    complex(dp), pointer, contiguous :: alpha(:, :, :), d(:, :, :)
    integer(ip), pointer, contiguous :: dofs(:)
    type(modification_in_lanes) :: plan
    real(dp), pointer, contiguous :: alpha_pairs(:, :, :), d_pairs(:, :, :), result_pairs(:, :, :)
    integer, allocatable :: h_place(:), d_place(:), taken(:), taken_from(:)
  contains
    procedure :: line => modify_one
    procedure :: line_block => modify_block
  end type modification

  type, extends(line_operation) :: inverse_modification
    logical :: transposed
    integer :: n
    complex(dp), pointer, contiguous :: alpha(:, :, :), gamma(:, :, :)
  contains
    procedure :: line => find_one
  end type inverse_modification

contains

  !> gamma from alpha and a local modification D. Eqs. (2.34)-(2.36), for any order of the DOFs.
  !> alpha   receptance before, shape (n, n, n_freq), m/N
  !> d       dynamic stiffness added at the modified DOFs, shape (n_m, n_m, n_freq), N/m
  !> dofs    the modified DOFs, shape (n_m), counted from 1
  !> gamma   receptance after, shape (n, n, n_freq)
  subroutine modify(transposed, alpha, d, dofs, gamma, line_info, rcond, info, memory)
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: alpha(:, :, :), d(:, :, :)
    integer(ip), contiguous, target, intent(in) :: dofs(:)
    complex(dp), contiguous, target, intent(out) :: gamma(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory
    type(modification) :: operation
    integer :: n, n_m

    n = size(alpha, 1)
    n_m = size(dofs)
    operation%transposed = transposed
    operation%n = n
    operation%n_m = n_m
    operation%alpha => alpha
    operation%d => d
    operation%dofs => dofs
    operation%result => gamma
    operation%flops = 8.0_dp*n_m*(real(n, dp)**2 + 2.0_dp*real(n_m, dp)*n)
    if (worth_a_plan(size(alpha, 3), memory) .and. n_m >= 1 .and. n_m <= largest_solved .and. n <= largest_product) &
      call plan_block(operation)
    call run_sweep(operation, size(alpha, 3, kind=ip), line_info, rcond, info, memory)
  end subroutine modify

  subroutine plan_block(operation)
    type(modification), intent(inout) :: operation
    type(element_space) :: room
    integer :: n, n_m, used

    n = operation%n
    n_m = operation%n_m
    call plan_modification(n, n_m, room, operation%plan)
    operation%n_hint = padded(n_m)
    operation%alpha_pairs => real_lines(operation%alpha)
    operation%d_pairs => real_lines(operation%d)
    operation%result_pairs => real_lines(operation%result)
    call operation%reads(operation%alpha_pairs)
    call operation%reads(operation%d_pairs)
    associate (plan => operation%plan, dofs => operation%dofs)
      call room%in_memory(operation%transposed, plan%h, operation%h_place)
      call room%in_memory(operation%transposed, plan%forces%d, operation%d_place)
      call room%new_list(n_m*(2*n + n_m), operation%taken)
      used = 0
      call room%add(plan%columns, operation%taken, used)
      call room%add(plan%forces%rows, operation%taken, used)
      call room%add(plan%forces%h_mm, operation%taken, used)
      call room%new_list(n_m*(2*n + n_m), operation%taken_from)
      used = 0
      call room%add(plan%h, operation%taken_from, used, columns=dofs)
      call room%add(plan%h, operation%taken_from, used, rows=dofs)
      call room%add(plan%h, operation%taken_from, used, dofs, dofs)
    end associate
    call operation%lies_in(room, n_m)
  end subroutine plan_block

  subroutine modify_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(modification), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp) :: rcond_lanes(lanes), total(lanes)

    associate (x => space%x)
      call kernels%load(size(self%h_place), self%h_place, first, n_lines, self%alpha_pairs, x)
      call kernels%load(size(self%d_place), self%d_place, first, n_lines, self%d_pairs, x)
      call kernels%copy(size(self%taken), 1.0_dp, self%taken_from, self%taken, x)
      call apply_in_lanes(self%plan, kernels, x, space%hint, space%list, rcond_lanes, space%ahead)
      call kernels%store(size(self%h_place), self%h_place, first, n_lines, x, self%result_pairs)
      call kernels%total(size(self%h_place), self%h_place, x, total)
      rcond = rcond_lanes(:n_lines)
      call kernels%judge(n_lines, total, line_info, rcond)
    end associate
  end subroutine modify_block

  subroutine plan_modification(n, n_m, room, plan)
    integer, intent(in) :: n, n_m
    type(element_space), intent(inout) :: room
    type(modification_in_lanes), intent(out) :: plan

    plan%h = room%matrix(n, n)
    plan%columns = room%matrix(n, n_m)
    call room%row_starts(plan%h, plan%h_row)
    call room%row_starts(plan%columns, plan%columns_row)
    call plan_forces(n, n_m, room, plan%forces)
  end subroutine plan_modification

  !> The product of D and [H_mm, rows] is added up where the system lies, whose columns are in two pieces, with one more
  !> between them where n_m is odd.
  subroutine plan_forces(n, n_m, room, plan)
    integer, intent(in) :: n, n_m
    type(element_space), intent(inout) :: room
    type(forces_in_lanes), intent(out) :: plan
    type(element_matrix) :: right, a, b
    integer :: even, used, i

    even = padded(n_m)
    plan%n = n
    plan%n_m = n_m
    plan%d = room%matrix(n_m, n_m)
    right = room%matrix(n_m, even + n)
    plan%right_before = right%before
    plan%h_mm = right%block(0, n_m, 0, n_m)
    plan%rows = right%block(0, n_m, even, n)
    call room%system(n_m, n, plan%system_before, a, b)
    plan%n_rest = even - 2 + n
    call room%row_starts(plan%d, plan%d_row)
    call room%row_starts(right, plan%right_row)
    call room%row_starts(right%block(0, n_m, 2, plan%n_rest), plan%right_rest_row)
    call room%row_starts(a, plan%panel_row)
    call room%row_starts(b%block(0, n_m, 2 - even, plan%n_rest), plan%rest_row)
    call room%new_list(n_m*(2 + plan%n_rest + even - n_m), plan%constant)
    call room%new_values(n_m*(2 + plan%n_rest + even - n_m), plan%constant_value)
    if (room%no_memory) return
    used = 0
    do i = 1, 2
      plan%constant(used + 1:used + n_m) = plan%panel_row + i
      used = used + n_m
    end do
    do i = 1, plan%n_rest
      plan%constant(used + 1:used + n_m) = plan%rest_row + i
      used = used + n_m
    end do
    call room%add(right%block(0, n_m, n_m, even - n_m), plan%constant, used)
    do i = 1, n_m
      plan%constant_value((i - 1)*n_m + i) = 1
    end do
  end subroutine plan_forces

  !> (I + D H_mm)^-1 D rows in lanes, once D, H_mm and rows are there.
  !> force_row   the element before each row of the forces
  subroutine find_forces(plan, kernels, x, hint, force_row, rcond, ahead)
    type(forces_in_lanes), intent(in) :: plan
    type(lane_kernels), intent(in) :: kernels
    real(dp), contiguous, intent(inout) :: x(:, :, :)
    integer, contiguous, intent(inout) :: hint(:)
    integer, intent(out) :: force_row(plan%n_m)
    real(dp), intent(out) :: rcond(lanes)
    type(lookahead), intent(inout) :: ahead
    integer :: n_m

    n_m = plan%n_m
    call kernels%fill(size(plan%constant), plan%constant_value, plan%constant, x)
    call kernels%product(n_m, 2, n_m, 1.0_dp, plan%d_row, plan%right_row, plan%panel_row, x)
    call kernels%product(n_m, plan%n_rest, n_m, 1.0_dp, plan%d_row, plan%right_rest_row, plan%rest_row, x)
    call kernels%solve(n_m, plan%n, n_m, plan%system_before, x, hint, force_row, rcond, ahead)
  end subroutine find_forces

  !> `apply_modification` in lanes, once H, D, H_mm, rows and columns are there.
  !> force_row   workspace
  subroutine apply_in_lanes(plan, kernels, x, hint, force_row, rcond, ahead)
    type(modification_in_lanes), intent(in) :: plan
    type(lane_kernels), intent(in) :: kernels
    real(dp), contiguous, intent(inout) :: x(:, :, :)
    integer, contiguous, intent(inout) :: hint(:), force_row(:)
    real(dp), intent(out) :: rcond(lanes)
    type(lookahead), intent(inout) :: ahead
    integer :: n, n_m

    n = plan%forces%n
    n_m = plan%forces%n_m
    call find_forces(plan%forces, kernels, x, hint, force_row, rcond, ahead)
    call kernels%product(n, n, n_m, -1.0_dp, plan%columns_row, force_row, plan%h_row, x)
  end subroutine apply_in_lanes

  subroutine modify_one(self, i, space, line_info, rcond)
    class(modification), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    type(modification_matrices) :: m

    call take_matrices(self%n, self%n_m, space, m)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (space%only_counts) return
    if (.not. (all_finite(self%alpha(:, :, i)) .and. all_finite(self%d(:, :, i)))) return
    call load(self%transposed, self%alpha(:, :, i), m%h)
    call load(self%transposed, self%d(:, :, i), m%d)
    call take_modified(m%h, self%dofs, m%columns, m%rows, m%h_mm)
    call apply_modification(m, space, line_info, rcond)
    call store(self%transposed, m%h, self%result(:, :, i))
  end subroutine modify_one

  !> Columns, rows and square of the modified DOFs.
  pure subroutine take_modified(h, dofs, columns, rows, h_mm)
    complex(dp), contiguous, intent(in) :: h(:, :)
    integer(ip), contiguous, intent(in) :: dofs(:)
    complex(dp), contiguous, intent(out) :: columns(:, :), rows(:, :), h_mm(:, :)

    columns = h(:, dofs)
    rows = h(dofs, :)
    h_mm = h(dofs, dofs)
  end subroutine take_modified

  !> The matrices of one line, and room for `apply_modification`.
  subroutine take_matrices(n, n_m, space, m)
    integer, intent(in) :: n, n_m
    type(line_space), target, intent(inout) :: space
    type(modification_matrices), intent(out) :: m

    call space%take(n, n, m%h)
    call space%take(n_m, n_m, m%d)
    call space%take(n, n_m, m%columns)
    call space%take(n_m, n, m%rows)
    call space%take(n_m, n_m, m%h_mm)
    call space%take(n_m, n_m, m%system)
    call space%take(n_m, n, m%forces)
    call room_to_solve(n_m, space)
  end subroutine take_matrices

  !> H = H - columns (I + D H_mm)^-1 D rows: what (2.34)-(2.36) say of all DOFs at once. D may be singular.
  subroutine apply_modification(m, space, line_info, rcond)
    type(modification_matrices), intent(in) :: m
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond

    call find_line_forces(m%d, m%h_mm, m%rows, m%system, m%forces, space, line_info, rcond)
    if (line_info /= line_good) return
    call product_line('N', 'N', -1.0_dp, m%columns, m%forces, m%h)
    if (.not. all_finite(m%h)) line_info = line_overflow
  end subroutine apply_modification

  !> (I + D H_mm)^-1 D rows with LAPACK; the arguments are described in `modification_matrices`.
  subroutine find_line_forces(d, h_mm, rows, system, forces, space, line_info, rcond)
    complex(dp), contiguous, intent(in) :: d(:, :), h_mm(:, :), rows(:, :)
    complex(dp), contiguous, intent(inout) :: system(:, :), forces(:, :)
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    integer :: k

    system = 0
    do k = 1, size(d, 1)
      system(k, k) = 1
    end do
    call product_line('N', 'N', 1.0_dp, d, h_mm, system)
    forces = 0
    call product_line('N', 'N', 1.0_dp, d, rows, forces)
    call solve_line(system, forces, space, line_info, rcond)
  end subroutine find_line_forces

  !> The modification D = alpha^-1 (alpha - gamma) gamma^-1 between two structures. Eqs. (2.40), (2.47).
  !> The product form keeps its accuracy for a weak modification, where gamma^-1 - alpha^-1 cancels.
  !> alpha, gamma   receptances before and after at the modified DOFs, shape (n, n, n_freq), m/N
  !> d              dynamic stiffness added, shape (n, n, n_freq), N/m
  subroutine find_modification(transposed, alpha, gamma, d, line_info, rcond, info, memory)
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: alpha(:, :, :), gamma(:, :, :)
    complex(dp), contiguous, target, intent(out) :: d(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory
    type(inverse_modification) :: operation
    integer :: n

    n = size(alpha, 1)
    operation%transposed = transposed
    operation%n = n
    operation%alpha => alpha
    operation%gamma => gamma
    operation%result => d
    operation%flops = 21.0_dp*real(n, dp)**3
    call run_sweep(operation, size(alpha, 3, kind=ip), line_info, rcond, info, memory)
  end subroutine find_modification

  subroutine find_one(self, i, space, line_info, rcond)
    class(inverse_modification), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: alpha(:, :), gamma(:, :), d(:, :), d_transposed(:, :)
    real(dp) :: rcond_gamma

    call space%take(self%n, self%n, alpha)
    call space%take(self%n, self%n, gamma)
    call space%take(self%n, self%n, d)
    call space%take(self%n, self%n, d_transposed)
    call room_to_solve(self%n, space)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (space%only_counts) return
    if (.not. (all_finite(self%alpha(:, :, i)) .and. all_finite(self%gamma(:, :, i)))) return
    call load(self%transposed, self%alpha(:, :, i), alpha)
    call load(self%transposed, self%gamma(:, :, i), gamma)
    call subtract(alpha, gamma, d)
    call solve_line(alpha, d, space, line_info, rcond)                  ! alpha^-1 (alpha - gamma)
    if (line_info /= line_good) return
    call load(.true., d, d_transposed)
    call load(.not. self%transposed, self%gamma(:, :, i), gamma)
    call solve_line(gamma, d_transposed, space, line_info, rcond_gamma) ! its product with gamma^-1, transposed
    rcond = min(rcond, rcond_gamma)
    call store(.not. self%transposed, d_transposed, self%result(:, :, i))
  end subroutine find_one

end module jointfrf_modification
