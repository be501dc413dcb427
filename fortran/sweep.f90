!> A sweep: independent frequency lines, shared among threads, each with its own status and condition number.
!>
!> A physics module says what one line is (`line_operation`) and where its result goes; everything that is the same for
!> all of them is here, once: workspace (allocated before the loop, one piece a thread), threads, NaN in bad lines, the
!> count of bad lines. It may also say how a block of lines is done side by side (`line_block`); lines of a block that are
!> in doubt are done again one by one, so that both ways give the same codes.
module jointfrf_sweep
  use, intrinsic :: iso_c_binding, only: c_intptr_t, c_loc
  !$ use omp_lib, only: omp_get_max_threads, omp_get_thread_num, omp_in_parallel
  use jointfrf_blas_threads, only: hold_blas_threads, release_blas_threads
  use jointfrf_engine, only: find_kernels
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lanes, only: lane_kernels, lanes
  use jointfrf_line_layout, only: store_nan
  use jointfrf_status, only: info_good, info_no_memory, line_good
  implicit none
  private
  public :: line_operation, line_space, run_sweep, judge

  !> Below this many floating-point operations a sweep costs less than waking the threads (about 100 microseconds).
  real(dp), parameter :: serial_flops = 2.0e5_dp
  !> Lanes do about ten times as many in that time.
  real(dp), parameter :: serial_flops_lanes = 2.0e6_dp
  !> Lines that a thread takes at a time; pivot rows are remembered within them only, so that results do not depend on
  !> the number of threads.
  integer, parameter :: chunk = 8*lanes
  !> Fewer lines than these are not worth a block.
  integer, parameter :: fewest_lines = 3
  !> Below this reciprocal condition number a line of a block is in doubt: LAPACK may find it exactly singular.
  real(dp), parameter :: doubtful = 1.0e-14_dp

  !> What a block says of a line that it leaves to the reference engine; no line keeps it.
  integer(ip), parameter :: in_doubt = huge(1_ip)

  !> The workspace of one thread, handed out line by line.
  type :: line_space
    complex(dp), allocatable :: z(:)
    real(dp), allocatable :: r(:)
    integer(ip), allocatable :: pivot(:)
    integer :: used = 0
    real(dp), pointer, contiguous :: x(:, :, :) => null()   !< elements of a block, shape (lanes, 2, n_element)
    real(dp), allocatable :: room(:)         !< where x lies
    integer, allocatable :: hint(:)          !< pivot rows of the block before
  contains
    procedure :: matrix
  end type line_space

  !> What is done with one line. An extension holds pointers to the caller's arrays.
  type, abstract :: line_operation
    integer :: n_complex = 0       !< complex workspace of one line
    integer :: n_real = 0          !< real workspace of one line
    integer :: n_pivot = 0         !< integer workspace of one line
    real(dp) :: flops = 0.0_dp     !< estimated work of one line
    integer :: n_element = 0       !< elements that a block takes, see jointfrf_lanes; 0: no block form
    integer :: n_hint = 0          !< pivot rows that a block remembers
    !> The caller's array for the results, one matrix a line.
    complex(dp), pointer, contiguous :: result(:, :, :) => null()
  contains
    procedure(line_routine), deferred :: line
    procedure :: line_block => no_block
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

  !> What an operation without block form has.
  !> kernels     what lanes can do
  !> first       the first line of the block
  !> n_lines     its number of lines, 1..lanes
  !> line_info   shape (n_lines): 0 good; anything else: in doubt, to be done again
  !> rcond       shape (n_lines)
  subroutine no_block(self, kernels, first, n_lines, space, line_info, rcond)
    class(line_operation), intent(in) :: self
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, n_lines
    type(line_space), target, intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp), intent(out) :: rcond(n_lines)

    line_info = in_doubt
    rcond = 0.0_dp
    associate (unused => self%flops, also => kernels, and => first, with => space)
    end associate
  end subroutine no_block

  !> Which lines of a block are in doubt.
  !> total         sums in which NaN, Inf and overflow of the results show
  !> rcond_lanes   reciprocal condition numbers
  pure subroutine judge(total, rcond_lanes, line_info, rcond)
    real(dp), intent(in) :: total(lanes), rcond_lanes(lanes)
    integer(ip), intent(out) :: line_info(:)
    real(dp), intent(out) :: rcond(:)
    integer :: l

    do l = 1, size(line_info)
      rcond(l) = min(1.0_dp, rcond_lanes(l))
      line_info(l) = in_doubt
      if (total(l) <= huge(1.0_dp) .and. rcond_lanes(l) > doubtful .and. rcond_lanes(l) <= huge(1.0_dp)) &
        line_info(l) = line_good
    end do
  end subroutine judge

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
    type(line_space), allocatable, target :: space(:)
    type(lane_kernels) :: kernels
    integer :: t, threads, n_chunks, c, stat
    logical :: hold, blocks

    call find_kernels(kernels, blocks, info)
    if (info /= info_good) return
    blocks = blocks .and. operation%n_element > 0 .and. n_freq >= fewest_lines
    n_chunks = (n_freq + chunk - 1)/chunk
    threads = threads_for(operation%flops*n_freq, merge(n_chunks, int(n_freq), blocks), &
                          merge(serial_flops_lanes, serial_flops, blocks))
    call prepare(operation, blocks, threads, space, stat)
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
    if (blocks) then
      !$omp parallel do num_threads(threads) if(threads > 1) schedule(static) default(none) &
      !$omp shared(operation, kernels, n_freq, n_chunks, space, line_info, rcond) firstprivate(t)
      do c = 1, n_chunks
        !$ t = omp_get_thread_num() + 1
        call run_blocks(operation, kernels, (c - 1)*chunk + 1, min(c*chunk, int(n_freq)), space(t), line_info, rcond)
      end do
      !$omp end parallel do
    else
      !$omp parallel do num_threads(threads) if(threads > 1) schedule(static) default(none) &
      !$omp shared(operation, n_freq, space, line_info, rcond) firstprivate(t)
      do c = 1, n_freq
        !$ t = omp_get_thread_num() + 1
        call run_line(operation, c, space(t), line_info(c), rcond(c))
      end do
      !$omp end parallel do
    end if
    if (hold) call release_blas_threads()
    info = count(line_info /= line_good, kind=ip)
  end subroutine run_sweep

  !> Workspace, one piece a thread.
  subroutine prepare(operation, blocks, threads, space, stat)
    class(line_operation), intent(in) :: operation
    logical, intent(in) :: blocks
    integer, intent(in) :: threads
    type(line_space), allocatable, target, intent(out) :: space(:)
    integer, intent(out) :: stat
    integer :: t

    allocate (space(threads), stat=stat)
    do t = 1, threads
      if (stat == 0) allocate (space(t)%z(operation%n_complex), space(t)%r(operation%n_real), &
                               space(t)%pivot(operation%n_pivot), stat=stat)
      if (stat == 0 .and. blocks) call place_elements(operation, space(t), stat)
    end do
  end subroutine prepare

  !> Elements begin at a multiple of their own length, so that no register is read across two cache lines.
  subroutine place_elements(operation, space, stat)
    class(line_operation), intent(in) :: operation
    type(line_space), target, intent(inout) :: space
    integer, intent(out) :: stat
    integer(c_intptr_t) :: address
    integer :: skip, n

    n = lanes*2*operation%n_element
    allocate (space%room(n + lanes), space%hint(operation%n_hint), stat=stat)
    if (stat /= 0) return
    address = transfer(c_loc(space%room), address)/8
    skip = int(modulo(-address, int(lanes, c_intptr_t)))
    space%x(1:lanes, 1:2, 1:operation%n_element) => space%room(skip + 1:skip + n)
  end subroutine place_elements

  !> The lines from first to last, in blocks.
  subroutine run_blocks(operation, kernels, first, last, space, line_info, rcond)
    class(line_operation), intent(in) :: operation
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, last
    type(line_space), intent(inout) :: space
    integer(ip), intent(inout) :: line_info(:)
    real(dp), intent(inout) :: rcond(:)
    integer :: i, k, n_lines

    space%hint = 0
    do i = first, last, lanes
      n_lines = min(lanes, last - i + 1)
      call operation%line_block(kernels, i, n_lines, space, line_info(i:i + n_lines - 1), rcond(i:i + n_lines - 1))
      do k = i, i + n_lines - 1
        if (line_info(k) /= line_good) call run_line(operation, k, space, line_info(k), rcond(k))
      end do
    end do
  end subroutine run_blocks

  subroutine run_line(operation, i, space, line_info, rcond)
    class(line_operation), intent(in) :: operation
    integer, intent(in) :: i
    type(line_space), intent(inout) :: space
    integer(ip), intent(out) :: line_info
    real(dp), intent(out) :: rcond

    space%used = 0
    call operation%line(i, space, line_info, rcond)
    if (line_info /= line_good) then
      rcond = 0.0_dp
      call store_nan(operation%result(:, :, i))
    end if
  end subroutine run_line

  !> One thread for little work or inside somebody else's parallel region, else what OpenMP would take.
  function threads_for(flops, n_shares, serial) result(threads)
    real(dp), intent(in) :: flops, serial
    integer, intent(in) :: n_shares
    integer :: threads

    threads = 1
    if (flops < serial .or. n_shares < 2) return
    !$ if (.not. omp_in_parallel()) threads = min(omp_get_max_threads(), n_shares)
  end function threads_for
end module jointfrf_sweep
