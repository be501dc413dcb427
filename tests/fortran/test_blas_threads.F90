!> The hold on the threads of the BLAS is counted and given back, seen through the BLAS's own functions, which are
!> looked up by name. Skipped where the BLAS starts no threads of its own, or is of a kind that is not held.
module blas_probe
  use, intrinsic :: iso_c_binding, only: c_associated, c_char, c_f_procpointer, c_funptr, c_int, c_int64_t, &
    c_null_char, &
    c_null_ptr, c_ptr, c_size_t
  use jointfrf_kinds, only: blas_ip, dp, ip
  use jointfrf_lapack, only: zgemm
  use jointfrf_sweep, only: line_operation, line_space
  implicit none
  private
  public :: probe, skip, find_blas, is_blis, get_threads, set_threads_to

  abstract interface
    function getter() bind(C) result(number)
      import :: c_int
      implicit none
      integer(c_int) :: number
    end function getter

    subroutine setter(number) bind(C)
      import :: c_int
      implicit none
      integer(c_int), value :: number
    end subroutine setter

    function long_getter() bind(C) result(number)
      import :: c_int64_t
      implicit none
      integer(c_int64_t) :: number
    end function long_getter

    subroutine long_setter(number) bind(C)
      import :: c_int64_t
      implicit none
      integer(c_int64_t), value :: number
    end subroutine long_setter
  end interface

  interface
    subroutine c_exit(code) bind(C, name='exit')
      import :: c_int
      implicit none
      integer(c_int), value :: code
    end subroutine c_exit

    function dlsym(handle, name) bind(C, name='dlsym') result(symbol)
      import :: c_char, c_funptr, c_ptr
      implicit none
      type(c_ptr), value :: handle
      character(kind=c_char), intent(in) :: name(*)
      type(c_funptr) :: symbol
    end function dlsym
  end interface

  procedure(getter), pointer :: get_int => null()
  procedure(setter), pointer :: set_int => null()
  procedure(long_getter), pointer :: get_long => null()
  procedure(long_setter), pointer :: set_long => null()

  !> Calls the BLAS in each line, and records how many threads it has there.
  type, extends(line_operation) :: probe
    integer(c_int), pointer :: threads(:) => null()
  contains
    procedure :: line => look
    procedure :: void => do_nothing
  end type probe

contains

  !> The exit status by which the test driver knows that a test does not apply.
  subroutine skip()
    call c_exit(77_c_int)
  end subroutine skip

  !> OpenBLAS with threads of its own, MKL or BLIS.
  subroutine find_blas(found)
    logical, intent(out) :: found
    procedure(getter), pointer :: get_parallel
    type(c_funptr) :: parallel, mkl, blis

    parallel = symbol(JF_BLAS_PREFIX//'openblas_get_parallel')
    mkl = symbol('MKL_Get_Max_Threads')
    blis = symbol('bli_thread_get_num_threads')
    found = c_associated(parallel) .or. c_associated(mkl) .or. c_associated(blis)
    if (c_associated(parallel)) then
      call c_f_procpointer(parallel, get_parallel)
      found = get_parallel() == 1
      call c_f_procpointer(symbol(JF_BLAS_PREFIX//'openblas_get_num_threads'), get_int)
      call c_f_procpointer(symbol(JF_BLAS_PREFIX//'openblas_set_num_threads'), set_int)
    else if (c_associated(mkl)) then
      call c_f_procpointer(mkl, get_int)
      call c_f_procpointer(symbol('MKL_Set_Num_Threads'), set_int)
    else if (c_associated(blis)) then
      call c_f_procpointer(blis, get_long)
      call c_f_procpointer(symbol('bli_thread_set_num_threads'), set_long)
    end if
  end subroutine find_blas

  function is_blis()
    logical :: is_blis

    is_blis = associated(get_long)
  end function is_blis

  function get_threads() result(threads)
    integer(c_int) :: threads

    if (associated(get_long)) then
      threads = int(get_long(), c_int)
    else
      threads = get_int()
    end if
  end function get_threads

  subroutine set_threads_to(threads)
    integer(c_int), intent(in) :: threads

    if (associated(set_long)) then
      call set_long(int(threads, c_int64_t))
    else
      call set_int(threads)
    end if
  end subroutine set_threads_to

  !> Looked up in the whole program: the handle for that is null on Linux.
  function symbol(name)
    character(len=*), intent(in) :: name
    type(c_funptr) :: symbol

    symbol = dlsym(c_null_ptr, name//c_null_char)
  end function symbol

  subroutine look(self, i, space, line_info, rcond)
    class(probe), intent(in) :: self
    integer, intent(in) :: i
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond
    integer(blas_ip), parameter :: n = 1
    complex(dp) :: one(1, 1), square(1, 1)

    line_info = 0
    rcond = 0.0_dp
    if (space%only_counts) return
    one = 1.0_dp
    square = 0.0_dp
    call zgemm('N', 'N', n, n, n, one(1, 1), one, n, one, n, square(1, 1), square, n, 1_c_size_t, 1_c_size_t)
    self%threads(i) = get_threads()
    rcond = real(square(1, 1), dp)
    if (space%used /= 0) line_info = 1
  end subroutine look

  subroutine do_nothing(self, i)
    class(probe), intent(in) :: self
    integer, intent(in) :: i

    if (i > size(self%threads)) error stop 'a line that is none'
  end subroutine do_nothing
end module blas_probe

program test_blas_threads
  use, intrinsic :: iso_c_binding, only: c_int
  !$ use omp_lib, only: omp_get_thread_num
  use blas_probe, only: find_blas, get_threads, is_blis, probe, set_threads_to, skip
  use testing, only: check, dp, finish, ip, set_threads
  use jointfrf_blas_threads, only: hold_blas_threads, release_blas_threads
  use jointfrf_sweep, only: run_sweep
  implicit none
  integer(c_int), target :: seen(8)
  logical :: found, threaded

  call find_blas(found)
  if (.not. found) call skip()
  threaded = .false.
  !$ threaded = .true.
  call set_threads_to(2_c_int)
  if (get_threads() /= 2) call skip()
  call hold_blas_threads()
  call check(get_threads() == 1, 'one thread while held')
  call hold_blas_threads()
  call release_blas_threads()
  call check(get_threads() == 1, 'one thread while still held once')
  call release_blas_threads()
  call check(get_threads() == 2, 'given back')
  call hold_by_two()
  call check(get_threads() == 2, 'given back by two threads')

  call set_threads_to(1_c_int)
  call hold_blas_threads()
  call check(get_threads() == 1, 'one thread while held, one before')
  call release_blas_threads()
  call check(get_threads() == 1, 'one thread given back')

  call set_threads_to(2_c_int)
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
  call check(get_threads() == 2, 'given back after the sweeps')
  call finish('blas_threads')

contains

  !> Two holders at once, of which the one that began first ends first. With BLIS that one may let go for both.
  subroutine hold_by_two()
    integer :: me
    integer(c_int) :: most

    me = 0
    most = 0
    !$omp parallel num_threads(2) firstprivate(me) reduction(max: most)
    !$ me = omp_get_thread_num()
    if (me == 0) call hold_blas_threads()
    !$omp barrier
    if (me == 1) call hold_blas_threads()
    !$omp barrier
    if (me == 0) call release_blas_threads()
    !$omp barrier
    if (me == 1) then
      most = get_threads()
      call release_blas_threads()
    end if
    !$omp end parallel
    call check(most <= 1 .or. is_blis(), 'one thread while the second still holds')
  end subroutine hold_by_two

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
