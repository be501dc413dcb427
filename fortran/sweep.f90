!> A sweep: independent frequency lines, shared among threads, each with its own status and condition number.
!>
!> A physics module says what one line is (`line_operation`) and where its result goes; everything that is the same for
!> all of them is here, once: workspace (allocated before the loop, one piece a thread), threads, NaN in bad lines, the
!> count of bad lines. It may also say how a block of lines is done side by side (`line_block`); lines of a block that
!> are in doubt are done again one by one, so that both ways give the same codes.
module jointfrf_sweep
  use, intrinsic :: iso_c_binding, only: c_intptr_t, c_loc
  !$ use omp_lib, only: omp_get_max_threads, omp_get_thread_num, omp_in_parallel
  use jointfrf_blas_threads, only: hold_blas_threads, release_blas_threads
  use jointfrf_engine, only: find_kernels
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lanes, only: in_doubt, lane_kernels, lanes
  use jointfrf_line_layout, only: store_nan
  use jointfrf_lookahead, only: add_range, lookahead, most_ranges
  use jointfrf_status, only: info_good, info_no_memory, line_good
  implicit none
  private
  public :: line_operation, line_space, run_sweep, threads_for

  !> Below this many floating-point operations a sweep costs less than waking the threads (about 100 microseconds).
  real(dp), parameter :: serial_flops = 2.0e5_dp
  !> Lanes do about ten times as many in that time.
  real(dp), parameter, public :: serial_flops_lanes = 2.0e6_dp
  !> Most blocks that a thread takes at a time, and work enough to take fewer. Pivot rows are remembered within them only,
  !> so that results do not depend on the number of threads.
  integer, parameter :: most_blocks = 8
  real(dp), parameter :: chunk_flops = 2.0e6_dp
  !> A sweep that reads no more bytes than this stays in the caches, and looking ahead would only cost time.
  integer(c_intptr_t), parameter :: near_bytes = 2**23
  !> Lines of a block that needs no workspace.
  integer, parameter, public :: long_block = 64*lanes
  !> Fewer lines than these are not worth a block.
  integer, parameter :: fewest_lines = 3

  !> The workspace of one thread, handed out line by line.
  type :: line_space
    complex(dp), allocatable :: z(:)
    real(dp), allocatable :: r(:)
    integer(ip), allocatable :: pivot(:)
    integer :: used = 0
    real(dp), pointer, contiguous :: x(:, :, :) => null()   !< elements of a block, shape (lanes, 2, n_element)
    real(dp), allocatable :: room(:)         !< where x lies
    integer, allocatable :: hint(:)          !< pivot rows of the block before
    type(lookahead) :: ahead                 !< memory of the next block
  contains
    procedure :: matrix
  end type line_space

  !> An array of lines in the caller's memory.
  type :: stream
    integer(c_intptr_t) :: address, line_bytes
  end type stream

  !> What is done with one line. An extension holds pointers to the caller's arrays.
  type, abstract :: line_operation
    integer :: n_complex = 0       !< complex workspace of one line
    integer :: n_real = 0          !< real workspace of one line
    integer :: n_pivot = 0         !< integer workspace of one line
    real(dp) :: flops = 0.0_dp     !< estimated work of one line
    integer :: n_element = 0       !< elements that a block takes, see jointfrf_lanes; 0: no block form
    integer :: n_hint = 0          !< pivot rows that a block remembers
    integer :: block_lines = lanes !< lines of a block
    integer :: n_stream = 0        !< the caller's large arrays that a block reads
    type(stream) :: streams(most_ranges - 1)
    !> The caller's array for the results, one matrix a line.
    complex(dp), pointer, contiguous :: result(:, :, :) => null()
  contains
    procedure(line_routine), deferred :: line
    procedure :: line_block => no_block
    procedure :: reads
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

  !> A block reads these lines, given as pairs of real numbers.
  subroutine reads(self, lines)
    class(line_operation), intent(inout) :: self
    real(dp), contiguous, target, intent(in) :: lines(:, :, :)

    if (self%n_stream == size(self%streams) .or. size(lines) == 0) return
    self%n_stream = self%n_stream + 1
    self%streams(self%n_stream)%address = transfer(c_loc(lines), 0_c_intptr_t)
    self%streams(self%n_stream)%line_bytes = 16_c_intptr_t*size(lines, 2)
  end subroutine reads

  !> What to bring near while the block of lines from first to last is computed: what the next block reads, and where
  !> this one writes.
  subroutine look_ahead(operation, first, last, final, ahead)
    class(line_operation), intent(in) :: operation
    integer, intent(in) :: first, last, final
    type(lookahead), intent(out) :: ahead
    integer(c_intptr_t) :: address, bytes
    integer :: i, next

    next = min(last + operation%block_lines, final)
    do i = 1, operation%n_stream
      associate (s => operation%streams(i))
        call add_range(ahead, s%address + s%line_bytes*last, s%address + s%line_bytes*next, .false.)
      end associate
    end do
    bytes = 16_c_intptr_t*size(operation%result, 1)*size(operation%result, 2)
    address = transfer(c_loc(operation%result), address)
    call add_range(ahead, address + bytes*(first - 1), address + bytes*last, .true.)
  end subroutine look_ahead

  !> What an operation without block form has.
  !> kernels     what lanes can do
  !> first       the first line of the block
  !> n_lines     its number of lines, 1..block_lines
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
    integer :: t, threads, share, n_chunks, c, stat
    logical :: hold, blocks, far

    call find_kernels(kernels, blocks, info)
    if (info /= info_good) return
    blocks = blocks .and. operation%n_element > 0 .and. n_freq >= fewest_lines
    share = operation%block_lines*max(1, min(most_blocks*lanes/operation%block_lines, &
                                             ceiling(chunk_flops/max(operation%flops*operation%block_lines, 1.0_dp))))
    n_chunks = (n_freq - 1)/share + 1
    threads = threads_for(operation%flops*n_freq, merge(n_chunks, int(n_freq), blocks), &
                          merge(serial_flops_lanes, serial_flops, blocks))
    far = sum(operation%streams(:operation%n_stream)%line_bytes)*n_freq > near_bytes
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
      !$omp shared(operation, kernels, n_freq, n_chunks, share, far, space, line_info, rcond) firstprivate(t)
      do c = 1, n_chunks
        !$ t = omp_get_thread_num() + 1
        call run_blocks(operation, kernels, (c - 1)*share + 1, min(c*share, int(n_freq)), far, space(t), line_info, &
                        rcond)
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
  !> far   whether the sweep is too large for the caches
  subroutine run_blocks(operation, kernels, first, last, far, space, line_info, rcond)
    class(line_operation), intent(in) :: operation
    type(lane_kernels), intent(in) :: kernels
    integer, intent(in) :: first, last
    logical, intent(in) :: far
    type(line_space), intent(inout) :: space
    integer(ip), intent(inout) :: line_info(:)
    real(dp), intent(inout) :: rcond(:)
    integer :: i, k, n_lines

    space%hint = 0
    do i = first, last, operation%block_lines
      n_lines = min(operation%block_lines, last - i + 1)
      if (far) call look_ahead(operation, i, i + n_lines - 1, last, space%ahead)
      call operation%line_block(kernels, i, n_lines, space, line_info(i:i + n_lines - 1), rcond(i:i + n_lines - 1))
      if (count(line_info(i:i + n_lines - 1) /= line_good) == 0) cycle
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
