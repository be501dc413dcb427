!> Rotational receptances from translational ones by finite differences (2.57)-(2.59).
module jointfrf_finite_difference
  use jointfrf_caller_memory, only: caller_memory
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lanes, only: element_space, in_memory, lane_kernels, lanes, largest_in_lanes, real_lines, row_starts
  use jointfrf_line_layout, only: all_finite, load, load_real, store
  use jointfrf_lines_lapack, only: product_line
  use jointfrf_status, only: line_good, line_not_finite, line_overflow
  use jointfrf_sweep, only: line_operation, line_space, run_sweep, worth_a_plan
  implicit none
  private
  public :: difference_weights, central_difference, transform_receptance

  !> Where the matrices lie in lanes.
  type :: transformation_in_lanes
    real(dp), pointer, contiguous :: h(:, :, :), h_new(:, :, :)
    integer, allocatable :: h_place(:), new_place(:)             !< in the caller's order
    integer, allocatable :: weight(:), sums(:)                   !< T_out and T_in^T; what products are added to
    complex(dp), allocatable :: weight_value(:), nothing(:)
    integer, allocatable :: out_row(:), in_row(:), h_row(:), half_row(:), new_row(:)   !< the element before each row
  end type transformation_in_lanes

  type, extends(line_operation) :: transformation
    logical :: transposed
    integer :: n_out, n_in, m_out, m_in
    complex(dp), pointer, contiguous :: h(:, :, :)
    real(dp), pointer, contiguous :: t_out(:, :), t_in(:, :)
    type(transformation_in_lanes) :: plan
  contains
    procedure :: line => transform_one
    procedure :: line_block => transform_block
  end type transformation

contains

  !> Weights that give displacement and slope at the reference from the displacements of points along a line: value and
  !> derivative at 0 of the polynomial through the points. Three points at -dx, 0, dx give T_2c of (2.59); unequal
  !> spacing, two points, and a reference between the points come from the same rule.
  !> offset    positions of the points from the reference, shape (m), all different, m
  !> weights   shape (2, m): displacement (no unit), slope (1/m)
  pure subroutine difference_weights(offset, weights)
    real(dp), intent(in) :: offset(:)
    real(dp), intent(out) :: weights(:, :)
    real(dp) :: value, slope
    integer :: p, q

    do p = 1, size(offset)
      value = 1.0_dp                       ! of the Lagrange polynomial of point p, factor by factor
      slope = 0.0_dp
      do q = 1, size(offset)
        if (q == p) cycle
        slope = (slope*(-offset(q)) + value)/(offset(p) - offset(q))
        value = value*(-offset(q))/(offset(p) - offset(q))
      end do
      weights(1, p) = value
      weights(2, p) = slope
    end do
  end subroutine difference_weights

  !> Displacement and slope at the reference from points along a line: the transformation by their weights.
  !> offset    positions of the points from the reference, shape (m), all different, m
  !> h         measured receptance of the points, shape (m, m, n_freq), m/N
  !> h_new     shape (2, 2, n_freq)
  subroutine central_difference(transposed, offset, h, h_new, line_info, rcond, info)
    logical, intent(in) :: transposed
    real(dp), intent(in) :: offset(:)
    complex(dp), contiguous, target, intent(in) :: h(:, :, :)
    complex(dp), contiguous, target, intent(out) :: h_new(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    real(dp), target :: weights(2, size(offset)), weights_transposed(size(offset), 2)

    call difference_weights(offset, weights)
    if (transposed) then
      weights_transposed = transpose(weights)
      call transform_receptance(.true., h, weights_transposed, weights_transposed, h_new, line_info, rcond, info)
    else
      call transform_receptance(.false., h, weights, weights, h_new, line_info, rcond, info)
    end if
  end subroutine central_difference

  !> H_new = T_out H T_in^T on every line. Eq. (2.57).
  !> h         measured receptance, shape (m_out, m_in, n_freq), m/N
  !> t_out     shape (n_out, m_out), (m_out, n_out) where transposed
  !> t_in      shape (n_in, m_in), (m_in, n_in) where transposed
  !> h_new     shape (n_out, n_in, n_freq)
  subroutine transform_receptance(transposed, h, t_out, t_in, h_new, line_info, rcond, info, memory)
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: h(:, :, :)
    real(dp), contiguous, target, intent(in) :: t_out(:, :), t_in(:, :)
    complex(dp), contiguous, target, intent(out) :: h_new(:, :, :)
    integer(ip), contiguous, intent(out) :: line_info(:)
    real(dp), contiguous, intent(out) :: rcond(:)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory
    type(transformation) :: operation

    operation%transposed = transposed
    operation%h => h
    operation%result => h_new
    operation%t_out => t_out
    operation%t_in => t_in
    operation%n_out = size(t_out, merge(2, 1, transposed))
    operation%m_out = size(t_out, merge(1, 2, transposed))
    operation%n_in = size(t_in, merge(2, 1, transposed))
    operation%m_in = size(t_in, merge(1, 2, transposed))
    operation%flops = 8.0_dp*operation%n_out*operation%m_in*(operation%m_out + operation%n_in)
    if (worth_a_plan(size(h, 3), memory) &
        .and. min(operation%n_out, operation%n_in, operation%m_out, operation%m_in) >= 1 &
        .and. max(operation%n_out, operation%n_in, operation%m_out, operation%m_in) <= largest_in_lanes) &
      call plan_transformation(operation)
    call run_sweep(operation, size(h, 3, kind=ip), line_info, rcond, info, memory)
  end subroutine transform_receptance

  subroutine plan_transformation(operation)
    type(transformation), intent(inout) :: operation
    integer :: t_out(operation%n_out, operation%m_out), t_in(operation%m_in, operation%n_in)
    integer :: h(operation%m_out, operation%m_in), half(operation%n_out, operation%m_in)
    integer :: h_new(operation%n_out, operation%n_in)
    type(element_space) :: room

    associate (n_out => operation%n_out, n_in => operation%n_in, m_out => operation%m_out, m_in => operation%m_in, &
               plan => operation%plan)
      t_out = room%matrix(n_out, m_out)
      t_in = room%matrix(m_in, n_in)
      h = room%matrix(m_out, m_in)
      half = room%matrix(n_out, m_in)
      h_new = room%matrix(n_out, n_in)
      operation%n_element = room%taken
      plan%h => real_lines(operation%h)
      plan%h_new => real_lines(operation%result)
      plan%h_place = in_memory(operation%transposed, h)
      plan%new_place = in_memory(operation%transposed, h_new)
      plan%weight = [in_memory(.true., t_out), in_memory(.true., t_in)]
      if (operation%transposed) then
        plan%weight_value = [reshape(operation%t_out, [n_out*m_out]), reshape(transpose(operation%t_in), [m_in*n_in])]
      else
        plan%weight_value = [reshape(transpose(operation%t_out), [n_out*m_out]), reshape(operation%t_in, [m_in*n_in])]
      end if
      plan%sums = [in_memory(.true., half), in_memory(.true., h_new)]
      allocate (plan%nothing(size(plan%sums)), source=(0.0_dp, 0.0_dp))
      plan%out_row = row_starts(t_out)
      plan%in_row = row_starts(t_in)
      plan%h_row = row_starts(h)
      plan%half_row = row_starts(half)
      plan%new_row = row_starts(h_new)
    end associate
  end subroutine plan_transformation

  subroutine transform_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(transformation), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp) :: total(lanes), well(lanes)

    well = 1.0_dp
    associate (plan => self%plan, x => space%x)
      call kernels%fill(size(plan%weight), plan%weight_value, plan%weight, x)
      call kernels%fill(size(plan%sums), plan%nothing, plan%sums, x)
      call kernels%load(size(plan%h_place), plan%h_place, first, n_lines, plan%h, x)
      call kernels%product(self%n_out, self%m_in, self%m_out, 1.0_dp, plan%out_row, plan%h_row, plan%half_row, x)
      call kernels%product(self%n_out, self%n_in, self%m_in, 1.0_dp, plan%half_row, plan%in_row, plan%new_row, &
                           x)                                                             ! (2.57)
      call kernels%store(size(plan%new_place), plan%new_place, first, n_lines, x, self%plan%h_new)
      call kernels%total(size(plan%new_place), plan%new_place, x, total)
      rcond = well(:n_lines)
      call kernels%judge(n_lines, total, line_info, rcond)
    end associate
  end subroutine transform_block

  subroutine transform_one(self, i, space, line_info, rcond)
    class(transformation), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: t_out(:, :), t_in(:, :), h(:, :), half(:, :), h_new(:, :)

    call space%take(self%n_out, self%m_out, t_out)
    call space%take(self%n_in, self%m_in, t_in)
    call space%take(self%m_out, self%m_in, h)
    call space%take(self%n_out, self%m_in, half)
    call space%take(self%n_out, self%n_in, h_new)
    line_info = line_not_finite
    rcond = 0.0_dp
    if (space%only_counts) return
    if (.not. all_finite(self%h(:, :, i))) return
    line_info = line_good
    rcond = 1.0_dp
    call load_real(self%transposed, self%t_out, t_out)
    call load_real(self%transposed, self%t_in, t_in)
    call load(self%transposed, self%h(:, :, i), h)
    half = 0
    call product_line('N', 'N', 1.0_dp, t_out, h, half)
    h_new = 0
    call product_line('N', 'T', 1.0_dp, half, t_in, h_new)            ! (2.57)
    if (.not. all_finite(h_new)) line_info = line_overflow
    call store(self%transposed, h_new, self%result(:, :, i))
  end subroutine transform_one

end module jointfrf_finite_difference
