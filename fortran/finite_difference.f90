!> Rotational receptances from translational ones by finite differences (2.57)-(2.59).
module jointfrf_finite_difference
  use jointfrf_caller_memory, only: caller_memory
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lanes, only: find_rows, has_weight, lane_kernels, lanes, real_lines, sparse_rows
  use jointfrf_line_layout, only: all_finite, load, load_real, store
  use jointfrf_lines_lapack, only: product_line
  use jointfrf_status, only: info_no_memory, line_good, line_not_finite, line_overflow
  use jointfrf_sweep, only: line_operation, line_space, long_block, run_sweep, worth_a_plan
  implicit none
  private
  public :: difference_weights, central_difference, transform_receptance

  !> Up to this number of products of two weights these are formed once, and a line is one sum of few for each entry.
  integer, parameter :: few_products = 100
  !> From this share of weights that are not zero on, leaving out the others costs more than it saves.
  real(dp), parameter :: full_share = 0.4_dp

  type, extends(line_operation) :: transformation
    logical :: transposed
    integer :: n_out, n_in, m_out, m_in
    complex(dp), pointer, contiguous :: h(:, :, :)
    real(dp), pointer, contiguous :: t_out(:, :), t_in(:, :)
    real(dp), pointer, contiguous :: h_pairs(:, :, :), new_pairs(:, :, :)
    type(sparse_rows) :: slow, fast          !< the transformations of the slow and of the fast index of storage
    type(sparse_rows) :: both                !< and of both, where there are few products of weights
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
    real(dp), allocatable, target :: weights(:, :), weights_transposed(:, :)
    integer :: stat

    info = info_no_memory
    allocate (weights(2, size(offset)), weights_transposed(size(offset), 2), stat=stat)
    if (stat /= 0) return
    call difference_weights(offset, weights)
    if (transposed) then
      weights_transposed(:, 1) = weights(1, :)
      weights_transposed(:, 2) = weights(2, :)
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
    operation%flops = 4.0_dp*(real(operation%m_in, dp)*count(has_weight(t_out)) &
                              + real(operation%n_out, dp)*count(has_weight(t_in)))
    if (worth_a_plan(size(h, 3), memory) &
        .and. min(operation%n_out, operation%n_in, operation%m_out, operation%m_in) >= 1) &
      call plan_transformation(operation)
    call run_sweep(operation, size(h, 3, kind=ip), line_info, rcond, info, memory)
  end subroutine transform_receptance

  subroutine plan_transformation(operation)
    type(transformation), intent(inout) :: operation
    integer :: stat

    operation%h_pairs => real_lines(operation%h)
    operation%new_pairs => real_lines(operation%result)
    call operation%reads(operation%h_pairs)
    if (operation%transposed) then
      call find_weights(operation%t_out, .true., operation%slow, stat)
      if (stat == 0) call find_weights(operation%t_in, .true., operation%fast, stat)
    else
      call find_weights(operation%t_in, .false., operation%slow, stat)
      if (stat == 0) call find_weights(operation%t_out, .false., operation%fast, stat)
    end if
    if (stat == 0) then
      if (size(operation%slow%weight)*size(operation%fast%weight) <= few_products) &
        call multiply(operation%transposed, operation%slow, operation%fast, size(operation%h, 1), operation%both, stat)
    end if
    operation%no_memory = stat /= 0
    operation%block_lines = long_block
    associate (m_slow => size(operation%h, 2), m_fast => size(operation%h, 1), slow => operation%slow, &
               fast => operation%fast)
      operation%n_element = max(m_fast*max(1, slow%n), fast%n*m_slow)/lanes + m_slow + 1
    end associate
  end subroutine plan_transformation

  !> The entries of a line made of those of the line before, in one step.
  !> slow_is_out   whether the slow index counts responses: terms are summed response by response
  !> m_fast        numbers side by side in memory
  subroutine multiply(slow_is_out, slow, fast, m_fast, rows, stat)
    logical, intent(in) :: slow_is_out
    type(sparse_rows), intent(in) :: slow, fast
    integer, intent(in) :: m_fast
    type(sparse_rows), intent(out) :: rows
    integer, intent(out) :: stat
    integer :: i, j, k, s, t

    k = size(slow%weight)*size(fast%weight)
    allocate (rows%start(slow%n*fast%n + 1), rows%from(k), rows%weight(k), stat=stat)
    if (stat /= 0) return
    rows%n = slow%n*fast%n
    k = 1
    do i = 1, slow%n
      do j = 1, fast%n
        rows%start((i - 1)*fast%n + j) = k
        if (slow_is_out) then
          do s = slow%start(i), slow%start(i + 1) - 1
            do t = fast%start(j), fast%start(j + 1) - 1
              call add_product()
            end do
          end do
        else
          do t = fast%start(j), fast%start(j + 1) - 1
            do s = slow%start(i), slow%start(i + 1) - 1
              call add_product()
            end do
          end do
        end if
      end do
    end do
    rows%start(rows%n + 1) = k
    rows%unused = slow%unused .or. fast%unused

  contains

    subroutine add_product()
      rows%from(k) = (slow%from(s) - 1)*m_fast + fast%from(t)
      rows%weight(k) = slow%weight(s)*fast%weight(t)
      k = k + 1
    end subroutine add_product
  end subroutine multiply

  !> The rows of a matrix, or its columns, as the kernels take them: what is not zero, and where that is much, all.
  subroutine find_weights(t, by_columns, rows, stat)
    real(dp), intent(in) :: t(:, :)
    logical, intent(in) :: by_columns
    type(sparse_rows), intent(out) :: rows
    integer, intent(out) :: stat
    integer :: j

    call find_rows(1.0_dp, t, by_columns, rows, stat)
    if (stat /= 0) return
    if (size(rows%weight) < full_share*size(t)) return
    allocate (rows%full(lanes, size(t)/rows%n, (rows%n - 1)/lanes + 1), stat=stat)
    if (stat /= 0) return
    rows%full = 0.0_dp
    do j = 1, rows%n
      if (by_columns) then
        rows%full(mod(j - 1, lanes) + 1, :, (j - 1)/lanes + 1) = t(:, j)
      else
        rows%full(mod(j - 1, lanes) + 1, :, (j - 1)/lanes + 1) = t(j, :)
      end if
    end do
  end subroutine find_weights

  subroutine transform_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(transformation), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    real(dp) :: total(n_lines)

    if (self%both%n > 0) then
      call kernels%weigh_lines(size(self%h_pairs, 2), self%both, first, n_lines, self%h_pairs, self%new_pairs, total)
    else
      call kernels%transform_lines(self%transposed, size(self%h, 2), size(self%h, 1), self%slow, self%fast, first, &
                                   n_lines, self%h_pairs, space%x, self%new_pairs, total)   ! (2.57)
    end if
    rcond = 1.0_dp
    call kernels%judge(n_lines, total, line_info, rcond)
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
