!> How many complex normal numbers the kernel's random generator makes: no noise is made faster.
module benchmark_generator
  use, intrinsic :: iso_c_binding, only: c_double, c_int
  use, intrinsic :: iso_fortran_env, only: int64
  use jointfrf_engine, only: find_kernels, set_engine
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lanes, only: lane_kernels, lanes
  implicit none
  private
  public :: generator_rate

  !> Elements drawn at once: what stays in the first cache.
  integer, parameter :: n = 64
  integer, parameter :: passes = 200, repetitions = 12

contains

  !> Complex normal numbers a second, all threads together; 0 where the machine does not have the engine.
  !> engine   code of the engine
  function generator_rate(engine, threads) bind(C, name='generator_rate') result(rate)
    integer(c_int), value, intent(in) :: engine, threads
    real(c_double) :: rate
    type(lane_kernels) :: kernels
    logical :: found
    integer(ip) :: info
    integer(int64) :: start, finish, ticks
    real(dp) :: best, total
    integer :: repetition

    rate = 0.0_c_double
    call set_engine(int(engine, ip), info)
    if (info /= 0) return
    call find_kernels(kernels, found, info)
    if (info /= 0) return
    best = huge(best)
    total = 0.0_dp
    do repetition = 1, repetitions
      call system_clock(start, ticks)
      !$omp parallel num_threads(threads) reduction(+: total)
      call draw_many(kernels, total)
      !$omp end parallel
      call system_clock(finish)
      best = min(best, real(finish - start, dp)/real(ticks, dp))
    end do
    ! The sum is looked at, so that nothing is left out.
    if (abs(total) < huge(total) .and. best > 0.0_dp) rate = real(threads, dp)*passes*n*lanes/best
  end function generator_rate

  !> Numbers of one thread, again and again into the same memory.
  subroutine draw_many(kernels, total)
    type(lane_kernels), intent(in) :: kernels
    real(dp), intent(inout) :: total
    integer(int64) :: low(lanes, n), high(lanes)
    real(dp) :: x(lanes, 2, n)
    integer :: i, l, pass

    do i = 1, n
      do l = 1, lanes
        low(l, i) = int((i - 1)*lanes + l, int64)
      end do
    end do
    do pass = 1, passes
      high = int(pass, int64)
      call kernels%normals(n, 0.5_dp, [1_int64, 2_int64], low, high, x)
      total = total + x(1, 1, 1) + x(lanes, 2, n)
    end do
  end subroutine draw_many
end module benchmark_generator
