!> A sweep: independent frequency lines, shared among threads, each with its own status and condition number.
!>
!> A physics module says what one line is (`line_operation`) and where its result goes; everything that is the same for
!> all of them is here, once: workspace (allocated before the loop, one piece a thread), NaN in bad lines, the count of
!> bad lines. It may also say how a block of lines is done side by side (`line_block`); lines of a block that are in
!> doubt are done again one by one, so that both ways give the same codes.
!>
!> A line declares its workspace by taking it: `line` is called once for no line in a `line_space` that only counts, and
!> the workspace is as large as what was taken.
!>
!> In memory of the caller nothing is allocated and no thread is started: lines are done one by one.
module jointfrf_sweep
  use, intrinsic :: iso_c_binding, only: c_intptr_t, c_loc
  !$ use omp_lib, only: omp_in_parallel
  use jointfrf_blas_threads, only: hold_blas_threads, release_blas_threads
  use jointfrf_caller_memory, only: caller_memory, take_memory
  use jointfrf_engine, only: find_kernels
  use jointfrf_kinds, only: blas_ip, dp, ip, long
  use jointfrf_lanes, only: element_space, in_doubt, lane_kernels, lanes, to_register
  use jointfrf_line_layout, only: store_nan
  use jointfrf_lookahead, only: add_range, lookahead, most_ranges
  use jointfrf_sharing, only: serial_flops, serial_flops_lanes, share, shared_work, threads_for
  use jointfrf_status, only: info_good, info_no_memory, line_good
  implicit none
  private
  public :: line_operation, line_space, run_sweep, worth_a_plan

  !> Most blocks that a thread takes at a time, and work enough to take fewer. Pivot rows are remembered within them
  !> only, so that results do not depend on the number of threads.
  integer, parameter :: most_blocks = 8
  real(dp), parameter :: chunk_flops = 2.0e6_dp
  !> A sweep that reads no more bytes than this stays in the second cache, and looking ahead would only cost time.
  integer(c_intptr_t), parameter :: near_bytes = 2**19
  !> Lines of a block that needs no workspace.
  integer, parameter, public :: long_block = 64*lanes
  !> Fewer lines than these are not worth a block.
  integer, parameter :: fewest_lines = 3

  !> Memory that belongs to a workspace.
  type :: own_memory
    complex(dp), allocatable :: z(:)
    real(dp), allocatable :: r(:), x(:)
    integer(blas_ip), allocatable :: pivot(:)
  end type own_memory

  !> Numbers of a workspace: complex, real, integers.
  type :: extent
    integer(long) :: z = 0, r = 0, pivot = 0
  end type extent

  !> The workspace of one thread, handed out line by line. A new one has no memory: it counts what is taken, so that
  !> `set_up` can provide it.
  type :: line_space
    logical :: only_counts = .true.          !< what is taken is null
    logical :: estimates = .false.           !< condition of what is solved: an estimate will do, as in lanes
    type(extent) :: most                     !< the most that was taken at a time
    integer(long) :: used = 0                !< complex numbers taken
    complex(dp), pointer, contiguous :: z(:) => null()
    real(dp), pointer, contiguous :: r(:) => null()
    integer(blas_ip), pointer, contiguous :: pivot(:) => null()
    real(dp), pointer, contiguous :: x(:, :, :) => null()   !< elements of a block, shape (lanes, 2, n_element)
    integer, allocatable :: hint(:)          !< pivot rows of the block before
    integer, allocatable :: list(:)          !< what a block needs to say where its numbers lie
    type(lookahead) :: ahead                 !< memory of the next block
    type(own_memory) :: own                  !< where the others lie, unless in the caller's memory
  contains
    procedure :: take
    procedure :: take_reals
    procedure :: take_pivots
    procedure :: set_up
  end type line_space

  !> An array of lines in the caller's memory.
  type :: stream
    integer(c_intptr_t) :: address, line_bytes
  end type stream

  !> What is done with one line. An extension holds pointers to the caller's arrays.
  type, abstract :: line_operation
    real(dp) :: flops = 0.0_dp     !< estimated work of one line
    integer :: n_element = 0       !< elements that a block takes, see jointfrf_lanes; 0: no block form
    integer :: n_hint = 0          !< pivot rows that a block remembers
    integer :: n_list = 0          !< places that it lists
    logical :: no_memory = .false. !< whether there was none for the plan of the blocks
    integer :: block_lines = lanes !< lines of a block
    integer :: n_stream = 0        !< the caller's large arrays that a block reads
    type(stream) :: streams(most_ranges - 1)
    !> The caller's array for the results, one matrix a line.
    complex(dp), pointer, contiguous :: result(:, :, :) => null()
  contains
    procedure(line_routine), deferred :: line
    procedure :: line_block => no_block
    procedure :: reads
    procedure :: lies_in
  end type line_operation

  !> The lines of an operation as work to be shared: an item is a share of lines.
  type, extends(shared_work) :: sweep_work
    class(line_operation), pointer :: operation => null()
    type(lane_kernels) :: kernels
    logical :: blocks = .false.              !< whether lines are done side by side
    logical :: far = .false.                 !< whether the sweep is too large for the caches
    integer :: lines = 1                     !< of a share
    type(line_space), pointer, contiguous :: space(:) => null()
    integer(ip), pointer, contiguous :: line_info(:) => null()
    real(dp), pointer, contiguous :: rcond(:) => null()
  contains
    procedure :: do_items => do_shares
  end type sweep_work

  abstract interface
    !> Compute line i. `rcond` is the smallest reciprocal condition number (1-norm) of the matrices inverted.
    !>
    !> First of all the line takes from the space whatever it may need, then it returns if the space only counts: there
    !> is no line i then, and all it has taken is null.
    subroutine line_routine(self, i, space, line_info, rcond)
      import :: line_operation, line_space, dp, ip
      implicit none
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

  !> A block lies in this space.
  !> n_list   places that a block lists while it is computed
  subroutine lies_in(self, room, n_list)
    class(line_operation), intent(inout) :: self
    type(element_space), intent(in) :: room
    integer, intent(in) :: n_list

    self%n_element = room%taken
    self%n_list = n_list
    self%no_memory = room%no_memory
  end subroutine lies_in

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
  subroutine take(self, n, m, matrix)
    class(line_space), target, intent(inout) :: self
    integer, intent(in) :: n, m
    complex(dp), pointer, contiguous, intent(out) :: matrix(:, :)
    integer(long) :: before

    before = self%used
    self%used = before + int(n, long)*m
    self%most%z = max(self%most%z, self%used)
    if (self%only_counts) then
      nullify (matrix)
    else
      matrix(1:n, 1:m) => self%z(before + 1:self%used)
    end if
  end subroutine take

  !> n real numbers of the workspace, always the same.
  subroutine take_reals(self, n, numbers)
    class(line_space), target, intent(inout) :: self
    integer, intent(in) :: n
    real(dp), pointer, contiguous, intent(out) :: numbers(:)

    self%most%r = max(self%most%r, int(n, long))
    if (self%only_counts) then
      nullify (numbers)
    else
      numbers => self%r(:n)
    end if
  end subroutine take_reals

  !> n pivot rows of the workspace, always the same.
  subroutine take_pivots(self, n, pivot)
    class(line_space), target, intent(inout) :: self
    integer, intent(in) :: n
    integer(blas_ip), pointer, contiguous, intent(out) :: pivot(:)

    self%most%pivot = max(self%most%pivot, int(n, long))
    if (self%only_counts) then
      nullify (pivot)
    else
      pivot => self%pivot(:n)
    end if
  end subroutine take_pivots

  !> Memory of its own for the most that was taken.
  subroutine set_up(self, stat)
    class(line_space), target, intent(inout) :: self
    integer, intent(out) :: stat

    allocate (self%own%z(self%most%z), self%own%r(self%most%r), self%own%pivot(self%most%pivot), stat=stat)
    if (stat /= 0) return
    self%z => self%own%z
    self%r => self%own%r
    self%pivot => self%own%pivot
    self%only_counts = .false.
  end subroutine set_up

  !> Whether there are enough lines to plan how they are computed side by side, in memory that is allocated.
  pure function worth_a_plan(n_freq, memory) result(worth)
    integer, intent(in) :: n_freq
    type(caller_memory), intent(in), optional :: memory
    logical :: worth

    worth = n_freq >= fewest_lines .and. .not. present(memory)
  end function worth_a_plan

  !> Run an operation over its lines.
  !> n_freq      number of lines; 0 is a good sweep of nothing
  !> line_info   shape (n_freq), status of each line
  !> rcond       shape (n_freq), reciprocal condition number of each line, 0 in a bad one
  !> info        0 good, also after a query; > 0 number of bad lines; info_no_memory; -i argument i, a length of the
  !>             caller's memory, is too small
  !> memory      of the caller: then the lines are done one by one in it
  subroutine run_sweep(operation, n_freq, line_info, rcond, info, memory)
    class(line_operation), intent(in) :: operation
    integer(ip), intent(in) :: n_freq
    integer(ip), intent(out) :: line_info(n_freq)
    real(dp), intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    type(caller_memory), intent(in), optional :: memory

    if (present(memory)) then
      call run_in_memory(operation, memory, line_info, rcond, info)
    else
      call run_shared(operation, n_freq, line_info, rcond, info)
    end if
  end subroutine run_sweep

  !> What a line of an operation takes, counted by a space without memory.
  subroutine count_workspace(operation, space)
    class(line_operation), intent(in) :: operation
    type(line_space), target, intent(inout) :: space
    integer(ip) :: no_info
    real(dp) :: no_rcond

    call operation%line(0, space, no_info, no_rcond)
  end subroutine count_workspace

  !> Lines one by one in memory of the caller. As LAPACK does, the lengths that were needed are left at the beginning.
  subroutine run_in_memory(operation, memory, line_info, rcond, info)
    class(line_operation), intent(in) :: operation
    type(caller_memory), intent(in) :: memory
    integer(ip), intent(inout) :: line_info(:)
    real(dp), intent(inout) :: rcond(:)
    integer(ip), intent(out) :: info
    type(line_space), target :: space
    type(caller_memory) :: lengths
    logical :: ready
    integer :: i

    call count_workspace(operation, space)
    call take_memory(memory, space%most%z, space%most%r, space%most%pivot, space%z, space%r, space%pivot, ready, info)
    if (.not. ready) return
    space%only_counts = .false.
    if (size(line_info) > 0) space%most = extent()
    call hold_blas_threads()       ! threads of the BLAS allocate, and their rounding differs
    do i = 1, size(line_info)
      call run_line(operation, i, space, line_info(i), rcond(i))
    end do
    call release_blas_threads()
    lengths = memory
    lengths%query = .true.
    call take_memory(lengths, space%most%z, space%most%r, space%most%pivot, space%z, space%r, space%pivot, ready, info)
    info = count(line_info /= line_good, kind=ip)
  end subroutine run_in_memory

  !> Lines in blocks where the engine can, shared among threads.
  subroutine run_shared(operation, n_freq, line_info, rcond, info)
    class(line_operation), target, intent(in) :: operation
    integer(ip), intent(in) :: n_freq
    integer(ip), target, intent(out) :: line_info(n_freq)
    real(dp), target, intent(out) :: rcond(n_freq)
    integer(ip), intent(out) :: info
    type(line_space), allocatable, target :: space(:)
    type(sweep_work) :: work
    integer(long) :: n_shares
    integer :: threads, stat
    logical :: hold, in_lanes

    call find_kernels(work%kernels, in_lanes, info)
    if (info /= info_good) return
    work%operation => operation
    work%blocks = in_lanes .and. operation%n_element > 0 .and. n_freq >= fewest_lines
    if (work%blocks) work%lines = lines_of_share(operation)
    n_shares = (n_freq - 1)/work%lines + 1
    threads = threads_for(operation%flops*n_freq, n_shares, merge(serial_flops_lanes, serial_flops, work%blocks))
    work%far = sum(operation%streams(:operation%n_stream)%line_bytes)*n_freq > near_bytes
    stat = 0
    if (.not. operation%no_memory) call prepare(operation, work%blocks, threads, space, stat)
    if (operation%no_memory .or. stat /= 0) then
      info = info_no_memory
      return
    end if
    space%estimates = in_lanes
    work%space => space
    work%line_info => line_info
    work%rcond => rcond

    ! Threads of the BLAS serve a single line only. Over several they would get in the way, and their rounding differs.
    hold = .false.
    !$ hold = omp_in_parallel()
    !$ if (n_freq > 1) hold = .true.
    if (hold) call hold_blas_threads()
    call share(work, n_shares, threads, even=.true.)
    if (hold) call release_blas_threads()
    info = count(line_info /= line_good, kind=ip)
  end subroutine run_shared

  !> Lines that a thread takes at a time, in blocks.
  pure function lines_of_share(operation) result(lines)
    class(line_operation), intent(in) :: operation
    integer :: lines
    real(dp) :: flops

    flops = max(operation%flops*operation%block_lines, 1.0_dp)
    lines = operation%block_lines*max(1, min(most_blocks*lanes/operation%block_lines, ceiling(chunk_flops/flops)))
  end function lines_of_share

  !> The shares of lines from first to last.
  subroutine do_shares(self, first, last, thread)
    class(sweep_work), intent(in) :: self
    integer(long), intent(in) :: first, last
    integer, intent(in) :: thread
    integer(long) :: s
    integer :: i, first_line, last_line

    do s = first, last
      first_line = int((s - 1)*self%lines) + 1
      last_line = int(min(s*self%lines, size(self%line_info, kind=long)))
      if (self%blocks) then
        call run_blocks(self%operation, self%kernels, first_line, last_line, self%far, self%space(thread), &
                        self%line_info, self%rcond)
      else
        do i = first_line, last_line
          call run_line(self%operation, i, self%space(thread), self%line_info(i), self%rcond(i))
        end do
      end if
    end do
  end subroutine do_shares

  !> Workspace, one piece a thread.
  subroutine prepare(operation, blocks, threads, space, stat)
    class(line_operation), intent(in) :: operation
    logical, intent(in) :: blocks
    integer, intent(in) :: threads
    type(line_space), allocatable, target, intent(out) :: space(:)
    integer, intent(out) :: stat
    integer :: t

    allocate (space(threads), stat=stat)
    if (stat /= 0) return
    call count_workspace(operation, space(1))
    do t = 1, threads
      space(t)%most = space(1)%most
      if (stat == 0) call space(t)%set_up(stat)
      if (stat == 0 .and. blocks) call place_elements(operation, space(t), stat)
    end do
  end subroutine prepare

  !> Elements begin where a register does.
  subroutine place_elements(operation, space, stat)
    class(line_operation), intent(in) :: operation
    type(line_space), target, intent(inout) :: space
    integer, intent(out) :: stat
    integer :: skip, n

    n = lanes*2*operation%n_element
    allocate (space%own%x(n + lanes), space%hint(operation%n_hint), space%list(operation%n_list), stat=stat)
    if (stat /= 0) return
    skip = to_register(c_loc(space%own%x))
    space%x(1:lanes, 1:2, 1:operation%n_element) => space%own%x(skip + 1:skip + n)
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
end module jointfrf_sweep
