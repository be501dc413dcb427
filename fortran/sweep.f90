!> A sweep: independent frequency lines, shared among threads, each with its own status and condition number.
!>
!> A physics module says what one line is (`line_operation`) and where its result goes; everything that is the same for
!> all of them is here, once: workspace (allocated before the loop, one piece a thread), threads, NaN in bad lines, the
!> count of bad lines.
module jointfrf_sweep
  !$ use omp_lib, only: omp_get_max_threads, omp_get_thread_num, omp_in_parallel
  use jointfrf_blas_threads, only: hold_blas_threads, release_blas_threads
  use jointfrf_kinds, only: dp, ip
  use jointfrf_line_layout, only: store_nan
  use jointfrf_status, only: info_no_memory, line_good
  implicit none
  private
  public :: line_operation, line_space, run_sweep

  !> Below this many floating-point operations a sweep costs less than waking the threads (about 100 microseconds).
  real(dp), parameter :: serial_flops = 2.0e5_dp

  !> The workspace of one thread, handed out line by line.
  type :: line_space
    complex(dp), allocatable :: z(:)
    real(dp), allocatable :: r(:)
    integer(ip), allocatable :: pivot(:)
    integer :: used = 0
  contains
    procedure :: matrix
  end type line_space

  !> What is done with one line. An extension holds pointers to the caller's arrays.
  type, abstract :: line_operation
    integer :: n_complex = 0       !< complex workspace of one line
    integer :: n_real = 0          !< real workspace of one line
    integer :: n_pivot = 0         !< integer workspace of one line
    real(dp) :: flops = 0.0_dp     !< estimated work of one line
    !> The caller's array for the results, one matrix a line.
    complex(dp), pointer, contiguous :: result(:, :, :) => null()
  contains
    procedure(line_routine), deferred :: line
  end type line_operation

  abstract interface
    !> Compute line i. `rcond` is the smallest reciprocal condition number (1-norm) of the matrices inverted.
    subroutine line_routine(self, i, space, line_info, rcond)
      import :: line_operation, line_space, dp, ip
      class(line_operation), intent(in) :: self
      integer, intent(in) :: i
      type(line_space), target, intent(inout) :: space
      integer(ip), intent(out) :: line_info
      real(dp), intent(out) :: rcond
    end subroutine line_routine
  end interface

contains

  !> The next n by m matrix of the workspace, valid until the line ends.
  function matrix(self, n, m) result(piece)
    class(line_space), target, intent(inout) :: self
    integer, intent(in) :: n, m
    complex(dp), pointer, contiguous :: piece(:, :)

    piece(1:n, 1:m) => self%z(self%used + 1:self%used + n*m)
    self%used = self%used + n*m
  end function matrix

  !> Run an operation over its lines.
  !> n_freq      number of lines; 0 is a good sweep of nothing
  !> line_info   shape (n_freq), status of each line
  !> rcond       shape (n_freq), reciprocal condition number of each line, 0 in a bad one
  !> info        0 good; > 0 number of bad lines; info_no_memory
  subroutine run_sweep(operation, n_freq, line_info, rcond, info)
    class(line_operation), intent(in) :: operation
    integer(ip), intent(in) :: n_freq
    integer(ip), intent(out) :: line_info(n_freq)
    real(dp), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    type(line_space), allocatable :: space(:)
    integer :: i, t, threads, stat
    logical :: hold

    threads = threads_for(operation%flops*n_freq, n_freq)
    allocate (space(threads), stat=stat)
    do t = 1, threads
      if (stat == 0) allocate (space(t)%z(operation%n_complex), space(t)%r(operation%n_real), &
                               space(t)%pivot(operation%n_pivot), stat=stat)
    end do
    if (stat /= 0) then
      info = info_no_memory
      return
    end if

    ! Threads of the BLAS serve a single line only. Over several they would get in the way, and their rounding differs.
    hold = .false.
    !$ hold = omp_in_parallel()
    !$ if (n_freq > 1) hold = .true.
    if (hold) call hold_blas_threads()
    t = 1
    !$omp parallel do num_threads(threads) if(threads > 1) schedule(static) default(none) &
    !$omp shared(operation, n_freq, space, line_info, rcond) firstprivate(t) private(i)
    do i = 1, n_freq
      !$ t = omp_get_thread_num() + 1
      space(t)%used = 0
      call operation%line(i, space(t), line_info(i), rcond(i))
      if (line_info(i) /= line_good) then
        rcond(i) = 0.0_dp
        call store_nan(operation%result(:, :, i))
      end if
    end do
    !$omp end parallel do
    if (hold) call release_blas_threads()
    info = count(line_info /= line_good, kind=ip)
  end subroutine run_sweep

  !> One thread for little work or inside somebody else's parallel region, else what OpenMP would take.
  function threads_for(flops, n_freq) result(threads)
    real(dp), intent(in) :: flops
    integer(ip), intent(in) :: n_freq
    integer :: threads

    threads = 1
    if (flops < serial_flops .or. n_freq < 2) return
    !$ if (.not. omp_in_parallel()) threads = min(omp_get_max_threads(), int(n_freq))
  end function threads_for
end module jointfrf_sweep
