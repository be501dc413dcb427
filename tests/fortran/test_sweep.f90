!> A sweep visits every line once, on one thread or several, turns the bad ones into NaN and counts them.
module probes
  use jointfrf_kinds, only: blas_ip, dp, ip
  use jointfrf_lanes, only: lane_kernels, lanes
  use jointfrf_sweep, only: line_operation, line_space
  !$ use omp_lib, only: omp_get_thread_num
  implicit none
  private
  public :: block_probe, probe

  !> Records what is done to it; the lines in `codes` that are not 0 are bad.
  type, extends(line_operation) :: probe
    integer(ip), pointer :: codes(:) => null()
    integer, pointer :: visits(:) => null(), thread(:) => null(), spoilt(:) => null()
  contains
    procedure :: line => visit
  end type probe

  !> The same in blocks: lines of `doubts` that are not 0 are left to the line by line way.
  type, extends(probe) :: block_probe
    integer, pointer :: doubts(:) => null(), block_of(:) => null(), before(:) => null()
  contains
    procedure :: line_block => visit_block
  end type block_probe

contains

  !> A block leaves its first line in `hint`, so that the next one can tell what it finds there.
  subroutine visit_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(block_probe), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)
    integer :: i

    if (any(shape(space%x) /= [lanes, 2, self%n_element]) .or. size(space%hint) /= self%n_hint) self%spoilt(first) = 5
    if (.not. associated(kernels%invert)) self%spoilt(first) = 6
    space%x = first
    do i = first, first + n_lines - 1
      self%block_of(i) = first
      self%before(i) = space%hint(1)
      self%result(:, :, i) = -i                 ! lines in doubt write it once more
      if (self%doubts(i) == 0) self%result(:, :, i) = i
      if (self%doubts(i) == 0) self%visits(i) = self%visits(i) + 1
      !$ self%thread(i) = omp_get_thread_num()
    end do
    line_info = int(self%doubts(first:first + n_lines - 1), ip)
    rcond = 0.5_dp
    space%hint = first
  end subroutine visit_block

  subroutine visit(self, i, space, line_info, rcond)
    class(probe), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: a(:, :), b(:, :)
    real(dp), pointer, contiguous :: r(:)
    integer(blas_ip), pointer, contiguous :: pivot(:)
    logical :: fresh

    fresh = space%used == 0
    call space%take(2, 3, a)
    call space%take(3, 2, b)
    call space%take_reals(5, r)
    call space%take_pivots(7, pivot)
    line_info = 1
    rcond = 0.0_dp
    if (space%only_counts) then
      if (i /= 0 .or. associated(a) .or. associated(r) .or. associated(pivot)) error stop 'there is no memory yet'
      return
    end if
    if (.not. fresh) self%spoilt(i) = 1
    a = i
    b = -i
    r = i
    pivot = i
    if (any(nint(real(a)) /= i) .or. any(nint(real(b)) /= -i)) self%spoilt(i) = 2
    if (any(shape(a) /= [2, 3]) .or. any(shape(b) /= [3, 2]) .or. space%used /= 12) self%spoilt(i) = 3
    if (size(r) /= 5 .or. size(pivot) /= 7) self%spoilt(i) = 4
    if (size(space%z) /= 12 .or. size(space%r) /= 5 .or. size(space%pivot) /= 7) self%spoilt(i) = 4
    self%visits(i) = self%visits(i) + 1
    self%result(:, :, i) = i
    !$ self%thread(i) = omp_get_thread_num()
    line_info = self%codes(i)
    rcond = 1.0_dp/i
  end subroutine visit
end module probes

program test_sweep
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use probes, only: block_probe, probe
  use testing, only: check, check_same, dp, finish, ip, set_threads
  use jointfrf_engine, only: engine_automatic, engine_lapack, engine_plain, set_engine
  use jointfrf_sweep, only: run_sweep
  !$ use omp_lib, only: omp_set_max_active_levels
  implicit none
  integer, parameter :: n = 101
  logical :: threaded, as_written(n)
  integer(ip), target :: codes(n)
  integer, target :: visits(n), thread(n), spoilt(n), doubts(n), block_of(n), before(n)
  complex(dp), target :: results(2, 1, n)
  integer(ip) :: line_info(n), info
  real(dp) :: rcond(n), expected(n)
  integer :: i

  threaded = .false.
  !$ threaded = .true.
  expected = [(1.0_dp/i, i=1, n)]

  call set_threads(2)
  codes = 0
  call sweep(1.0_dp, n)
  call check(info == 0 .and. all(line_info == 0), 'good lines')
  call check_same(rcond, expected, 'rcond of each line')
  as_written = kept()
  call check(all(visits == 1) .and. all(as_written), 'each line once')
  call check(all(spoilt == 0), 'workspace')
  call check(all(thread == 0), 'little work stays on one thread')

  codes(2) = -1
  codes(50) = 3
  codes(n) = -2
  expected([2, 50, n]) = 0.0_dp
  call sweep(1.0e9_dp, n)
  call check(info == 3, 'number of bad lines')
  call check(all(line_info == codes), 'code of each line')
  call check_same(rcond, expected, 'rcond with bad lines')
  as_written = kept()
  call check(all(visits == 1) .and. all(as_written .eqv. (codes == 0)), 'bad lines, and only they, become NaN')
  call check(all(spoilt == 0), 'workspace with threads')
  if (threaded) call check(any(thread == 0) .and. any(thread == 1), 'much work goes to two threads')

  call sweep(1.0e9_dp, 1)
  call check(info == 0 .and. visits(1) == 1 .and. sum(visits) == 1, 'one line')
  call sweep(1.0e9_dp, 0)
  call check(info == 0 .and. sum(visits) == 0, 'no line')

  ! inside somebody else's parallel region a sweep starts no threads of its own
  if (threaded) then
    !$ call omp_set_max_active_levels(2)
    !$omp parallel num_threads(2)
    !$omp single
    call sweep(1.0e9_dp, n)
    !$omp end single
    !$omp end parallel
    call check(info == 3 .and. all(visits == 1), 'every line inside a parallel region')
    call check(all(thread == thread(1)), 'no threads inside a parallel region')
  end if
  call blocks()
  call finish('sweep')

contains

  !> Blocks of eight lines; what was in doubt is done line by line, and only that.
  subroutine blocks()
    integer(ip) :: ignored
    integer :: i

    codes = 0
    codes([4, 71]) = [2_ip, -1_ip]
    doubts = 0
    doubts([1, 4, 16, 17, 71, n]) = 1
    expected = 0.5_dp
    expected([1, 16, 17, n]) = 1.0_dp/[1, 16, 17, n]
    expected([4, 71]) = 0.0_dp
    call set_engine(engine_plain, ignored)
    do i = 1, 2
      call sweep_blocks(merge(1.0_dp, 1.0e9_dp, i == 1), n)
      call check(info == 2 .and. all(line_info == codes), 'blocks: codes')
      call check_same(rcond, expected, 'blocks: rcond of the block, or of the line that was in doubt')
      as_written = kept()
      call check(all(visits == 1) .and. all(as_written .eqv. (codes == 0)), 'blocks: each line once')
      call check(all(spoilt == 0), 'blocks: workspace')
      call check(all(block_of == expected_block()), 'blocks: first lines')
      call check(all(before == expected_hint(merge(64, 8, i == 1))), &
                 'blocks: what the block before left, anew in every share: of 64 lines, or of a block of much work')
      if (i == 1) call check(all(thread == 0), 'blocks: little work stays on one thread')
      if (i == 2 .and. threaded) call check(any(thread == 0) .and. any(thread == 1), 'blocks: much work')
    end do

    call sweep_blocks(1.0e9_dp, 2)
    call check(all(block_of(:2) == 0) .and. info == 0 .and. all(visits(:2) == 1), 'two lines are not worth a block')
    call sweep_blocks(1.0e9_dp, 3)
    call check(all(block_of(:3) == 1) .and. sum(visits) == 3, 'three lines are')
    call set_engine(engine_lapack, ignored)
    call sweep_blocks(1.0e9_dp, n)
    call check(all(block_of == 0) .and. all(visits == 1) .and. info == 2, 'the reference engine has no blocks')
    call set_engine(engine_automatic, ignored)
  end subroutine blocks

  function expected_block() result(first)
    integer :: first(n), j

    first = [(j - mod(j - 1, 8), j=1, n)]
  end function expected_block

  function expected_hint(share) result(hint)
    integer, intent(in) :: share
    integer :: hint(n)

    hint = expected_block() - 8
    where (mod(expected_block(), share) == 1) hint = 0
  end function expected_hint

  subroutine sweep_blocks(flops, lines)
    real(dp), intent(in) :: flops
    integer, intent(in) :: lines
    type(block_probe) :: operation

    operation%doubts => doubts
    operation%block_of => block_of
    operation%before => before
    operation%n_element = 5
    operation%n_hint = 2
    block_of = 0
    before = -1
    call start(operation, flops, lines)
  end subroutine sweep_blocks

  !> Whether the result of each line is what the line wrote; where it is not, it must be NaN throughout.
  function kept() result(same)
    logical :: same(n)
    integer :: j

    do j = 1, n
      same(j) = all(abs(results(:, :, j) - j) <= 0.0_dp)
      if (.not. same(j)) call check(all(ieee_is_nan(real(results(:, :, j)))), 'a bad line is NaN throughout')
    end do
  end function kept

  subroutine sweep(flops, lines)
    real(dp), intent(in) :: flops
    integer, intent(in) :: lines
    type(probe) :: operation

    call start(operation, flops, lines)
  end subroutine sweep

  subroutine start(operation, flops, lines)
    class(probe), intent(inout) :: operation
    real(dp), intent(in) :: flops
    integer, intent(in) :: lines

    operation%codes => codes
    operation%visits => visits
    operation%result => results(:, :, :lines)
    operation%thread => thread
    operation%spoilt => spoilt
    operation%flops = flops
    visits = 0
    results = -1
    thread = 0
    spoilt = 0
    call run_sweep(operation, int(lines, ip), line_info(:lines), rcond(:lines), info)
  end subroutine start
end program test_sweep
