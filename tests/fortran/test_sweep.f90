!> A sweep visits every line once, on one thread or several, turns the bad ones into NaN and counts them.
module probes
  use jointfrf_kinds, only: dp, ip
  use jointfrf_sweep, only: line_operation, line_space
  !$ use omp_lib, only: omp_get_thread_num
  implicit none
  private
  public :: probe

  !> Records what is done to it; the lines in `codes` that are not 0 are bad.
  type, extends(line_operation) :: probe
    integer(ip), pointer :: codes(:) => null()
    integer, pointer :: visits(:) => null(), thread(:) => null(), spoilt(:) => null()
  contains
    procedure :: line => visit
  end type probe

contains

  subroutine visit(self, i, space, line_info, rcond)
    class(probe), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    complex(dp), pointer, contiguous :: a(:, :), b(:, :)

    if (space%used /= 0) self%spoilt(i) = 1
    a => space%matrix(2, 3)
    b => space%matrix(3, 2)
    a = i
    b = -i
    space%r = i
    space%pivot = i
    if (any(nint(real(a)) /= i) .or. any(nint(real(b)) /= -i)) self%spoilt(i) = 2
    if (any(shape(a) /= [2, 3]) .or. any(shape(b) /= [3, 2]) .or. space%used /= 12) self%spoilt(i) = 3
    if (size(space%r) /= self%n_real .or. size(space%pivot) /= self%n_pivot) self%spoilt(i) = 4
    self%visits(i) = self%visits(i) + 1
    self%result(:, :, i) = i
    !$ self%thread(i) = omp_get_thread_num()
    line_info = self%codes(i)
    rcond = 1.0_dp/i
  end subroutine visit
end module probes

program test_sweep
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use probes, only: probe
  use testing, only: check, check_same, dp, finish, ip, set_threads
  use jointfrf_sweep, only: run_sweep
  !$ use omp_lib, only: omp_set_max_active_levels
  implicit none
  integer, parameter :: n = 101
  logical :: threaded, as_written(n)
  integer(ip), target :: codes(n)
  integer, target :: visits(n), thread(n), spoilt(n)
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
  call finish('sweep')

contains

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

    operation%codes => codes
    operation%visits => visits
    operation%result => results(:, :, :lines)
    operation%thread => thread
    operation%spoilt => spoilt
    operation%n_complex = 12
    operation%n_real = 5
    operation%n_pivot = 7
    operation%flops = flops
    visits = 0
    results = -1
    thread = 0
    spoilt = 0
    call run_sweep(operation, int(lines, ip), line_info(:lines), rcond(:lines), info)
  end subroutine sweep
end program test_sweep
