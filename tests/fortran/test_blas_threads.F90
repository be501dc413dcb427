!> The hold on the threads of the BLAS is counted and given back. Skipped where the BLAS starts no threads of its own.
#ifdef JF_OPENBLAS
module blas_probe
  use jointfrf_kinds, only: dp, ip
  use jointfrf_sweep, only: line_operation, line_space
  implicit none
  private
  public :: probe, skip, openblas_get_num_threads, openblas_get_parallel, openblas_set_num_threads

  interface
    function openblas_get_parallel() bind(C, name=JF_BLAS_PREFIX//"openblas_get_parallel") result(model)
      import :: ip
      integer(ip) :: model
    end function openblas_get_parallel

    subroutine c_exit(code) bind(C, name='exit')
      import :: ip
      integer(ip), value :: code
    end subroutine c_exit

    function openblas_get_num_threads() bind(C, name=JF_BLAS_PREFIX//"openblas_get_num_threads") result(threads)
      import :: ip
      integer(ip) :: threads
    end function openblas_get_num_threads

    subroutine openblas_set_num_threads(threads) bind(C, name=JF_BLAS_PREFIX//"openblas_set_num_threads")
      import :: ip
      integer(ip), value :: threads
    end subroutine openblas_set_num_threads
  end interface

  !> Records how many threads the BLAS has in each line.
  type, extends(line_operation) :: probe
    integer(ip), pointer :: threads(:) => null()
  contains
    procedure :: line => look
    procedure :: void => do_nothing
  end type probe

contains

  !> The exit status by which the test driver knows that a test does not apply.
  subroutine skip()
    call c_exit(77_ip)
  end subroutine skip

  subroutine look(self, i, space, line_info, rcond)
    class(probe), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond

    self%threads(i) = openblas_get_num_threads()
    line_info = 0
    rcond = 1.0_dp
    if (space%used /= 0) line_info = 1
  end subroutine look

  subroutine do_nothing(self, i)
    class(probe), intent(in) :: self
    integer, intent(in) :: i

    if (i > size(self%threads)) error stop 'a line that is none'
  end subroutine do_nothing
end module blas_probe

program test_blas_threads
  use blas_probe, only: openblas_get_num_threads, openblas_get_parallel, openblas_set_num_threads, probe, skip
  use testing, only: check, dp, finish, ip, set_threads
  use jointfrf_blas_threads, only: hold_blas_threads, release_blas_threads
  use jointfrf_sweep, only: run_sweep
  implicit none
  integer(ip), target :: seen(8)
  integer(ip) :: before
  logical :: threaded

  if (openblas_get_parallel() /= 1) call skip()
  threaded = .false.
  !$ threaded = .true.
  call openblas_set_num_threads(2_ip)
  before = openblas_get_num_threads()
  call hold_blas_threads()
  call check(openblas_get_num_threads() == 1, 'one thread while held')
  call hold_blas_threads()
  call release_blas_threads()
  call check(openblas_get_num_threads() == 1, 'one thread while still held once')
  call release_blas_threads()
  call check(openblas_get_num_threads() == before .and. before == 2, 'given back')

  call openblas_set_num_threads(1_ip)
  call hold_blas_threads()
  call check(openblas_get_num_threads() == 1, 'one thread while held, one before')
  call release_blas_threads()
  call check(openblas_get_num_threads() == 1, 'one thread given back')

  call openblas_set_num_threads(2_ip)
  call sweep(1, 1)
  call check(seen(1) == 2, 'a single line has the threads of the BLAS')
  if (threaded) then
    call sweep(1, 8)
    call check(all(seen == 1), 'several lines on one thread have not')
    call sweep(2, 8)
    call check(all(seen == 1), 'several lines on two threads have not')
    !$omp parallel num_threads(2)
    !$omp single
    call sweep(2, 1)
    !$omp end single
    !$omp end parallel
    call check(seen(1) == 1, 'a single line inside a parallel region has not')
  end if
  call check(openblas_get_num_threads() == 2, 'given back after the sweeps')
  call finish('blas_threads')

contains

  subroutine sweep(threads, lines)
    integer, intent(in) :: threads, lines
    type(probe) :: operation
    integer(ip) :: line_info(lines), info
    real(dp) :: rcond(lines)

    call set_threads(threads)
    operation%threads => seen
    operation%flops = 1.0e9_dp
    seen = 0
    call run_sweep(operation, int(lines, ip), line_info, rcond, info)
    call check(info == 0, 'good')
  end subroutine sweep
end program test_blas_threads
#else
program test_blas_threads
  use, intrinsic :: iso_c_binding, only: c_int
  implicit none
  interface
    subroutine c_exit(code) bind(C, name='exit')
      import :: c_int
      integer(c_int), value :: code
    end subroutine c_exit
  end interface

  call c_exit(77_c_int)
end program test_blas_threads
#endif
