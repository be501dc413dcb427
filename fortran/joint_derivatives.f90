!> What changes of K* do to the squares of a joint: normal equations of its parameters, summed over the lines.
!>
!> Parameter i adds a function of frequency f_i to an entry of K* and to its mirror image, so that it changes the
!> compliance by -f_i C E C. Products with the information are of entries; of those parameters that share one, they
!> differ by the functions only.
!>
!> Lanes are frequency lines, also with the engine that is LAPACK elsewhere. Sums are those of shares of the lines,
!> which do not depend on the number of threads.
module jointfrf_joint_derivatives
  use, intrinsic :: iso_c_binding, only: c_f_pointer, c_loc
  use jointfrf_blas_threads, only: hold_blas_threads, release_blas_threads
  use jointfrf_engine, only: find_kernels
  use jointfrf_kinds, only: dp, ip, long
  use jointfrf_lanes, only: lane_kernels, lanes, to_register
  use jointfrf_sharing, only: serial_flops_lanes, share, shared_work, threads_for
  use jointfrf_status, only: info_good, info_no_memory
  implicit none
  private
  public :: joint_normal_equations

  !> Elements of a block, and sums, are counted by default integers.
  integer, parameter, public :: most_coupled_dofs = 100, most_coupled_parameters = 30000
  !> Blocks of lines whose sums are found together.
  integer, parameter :: share_blocks = 64

  !> Sums over the lines; an item is a share of them.
  type, extends(shared_work) :: derivative_sums
    type(lane_kernels) :: kernels
    integer :: n = 0, n_entries = 0, n_par = 0, n_freq = 0, n_pairs = 0
    integer, allocatable :: row(:), column(:)                          !< of each pair of DOFs that has parameters
    integer, allocatable :: pair(:)                                    !< of each parameter
    integer, allocatable :: from(:), place(:)                          !< of the numbers of a line, and where they go
    real(dp), pointer, contiguous :: slopes(:, :, :) => null()         !< the caller's lines as pairs of real numbers
    real(dp), pointer, contiguous :: c_joint(:, :, :) => null(), information(:, :, :) => null()
    real(dp), pointer, contiguous :: residual(:, :, :) => null()
    real(dp), allocatable :: room(:), partial_room(:)
    real(dp), pointer, contiguous :: x(:, :, :, :) => null()           !< of the kernel, the last index is the thread
    real(dp), pointer, contiguous :: partial(:, :, :) => null()        !< descent, normal: (lanes, sums, shares)
  contains
    procedure :: do_items => sum_shares
  end type derivative_sums

contains

  !> Re(J^H W J) and Re(J^H r) of all lines, J the derivative of the upper triangle of C by the parameters.
  !> rows, columns   entry of K* that each parameter changes
  !> slopes          f, shape (n_par, n_freq)
  !> c_joint         C, upper triangle row by row, shape (n (n + 1)/2, n_freq)
  !> information     W, Hermitian
  !> residual        r
  subroutine joint_normal_equations(transposed, n, rows, columns, slopes, c_joint, information, residual, normal, &
                                    descent, info)
    logical, intent(in) :: transposed
    integer, intent(in) :: n
    integer(ip), intent(in) :: rows(:), columns(:)
    complex(dp), contiguous, target, intent(in) :: slopes(:, :), c_joint(:, :), information(:, :, :), residual(:, :)
    real(dp), intent(out) :: normal(:, :), descent(:)
    integer(ip), intent(out) :: info
    type(derivative_sums), target :: sums
    integer :: threads, k, i, j
    real(dp) :: total
    logical :: found

    sums%n = n
    sums%n_entries = size(c_joint, 1)
    sums%n_par = size(rows)
    sums%n_freq = size(c_joint, 2)
    call find_kernels(sums%kernels, found, info)
    if (info /= info_good) return
    call prepare(transposed, rows, columns, sums, threads, info)
    if (info /= info_good) return
    normal = 0.0_dp
    descent = 0.0_dp
    if (sums%n_freq == 0) return
    call c_f_pointer(c_loc(slopes), sums%slopes, [2, sums%n_par, sums%n_freq])
    call c_f_pointer(c_loc(c_joint), sums%c_joint, [2, sums%n_entries, sums%n_freq])
    call c_f_pointer(c_loc(information), sums%information, [2, sums%n_entries**2, sums%n_freq])
    call c_f_pointer(c_loc(residual), sums%residual, [2, sums%n_entries, sums%n_freq])
    call hold_blas_threads()
    call share(sums, size(sums%partial, 3, kind=long), threads, even=.true.)
    call release_blas_threads()
    k = 0
    do i = 1, sums%n_par
      call sum_up(descent(i))
    end do
    do i = 1, sums%n_par
      do j = 1, i
        call sum_up(total)
        normal(j, i) = total
        normal(i, j) = total
      end do
    end do

  contains

    !> The next sum, over lanes and shares.
    subroutine sum_up(all_lines)
      real(dp), intent(out) :: all_lines
      integer :: s

      k = k + 1
      all_lines = 0.0_dp
      do s = 1, size(sums%partial, 3)
        all_lines = all_lines + sum(sums%partial(:, k, s))
      end do
    end subroutine sum_up
  end subroutine joint_normal_equations

  !> Pairs of DOFs, where numbers go, and memory.
  subroutine prepare(transposed, rows, columns, sums, threads, info)
    logical, intent(in) :: transposed
    integer(ip), intent(in) :: rows(:), columns(:)
    type(derivative_sums), target, intent(inout) :: sums
    integer, intent(out) :: threads
    integer(ip), intent(out) :: info
    integer(long) :: n_element, n_shares, length, at
    integer :: n_sum, stat

    info = info_no_memory
    associate (n => sums%n, u => sums%n_entries, p => sums%n_par)
      allocate (sums%row(p), sums%column(p), sums%pair(p), sums%from(n*n), sums%place(n*n + p + u*u + u), stat=stat)
      if (stat /= 0) return
      call find_pairs(rows, columns, sums)
      call list_places(transposed, sums)
      n_element = n*n + p + int(u, long)*u + u*(2_long*sums%n_pairs + 1) + sums%n_pairs*(sums%n_pairs + 1_long)
      n_sum = p + (p*(p + 1))/2
      n_shares = (sums%n_freq - 1)/(lanes*share_blocks) + 1
      threads = threads_for(8.0_dp*sums%n_pairs*u*(u + sums%n_pairs)*sums%n_freq, n_shares, serial_flops_lanes)
      length = 2*lanes*n_element
      allocate (sums%room(length*threads + lanes), sums%partial_room(lanes*n_sum*n_shares), stat=stat)
      if (stat /= 0) return
      at = to_register(c_loc(sums%room))
      sums%x(1:lanes, 1:2, 1:n_element, 1:threads) => sums%room(at + 1:at + length*threads)
      sums%partial(1:lanes, 1:n_sum, 1:n_shares) => sums%partial_room
    end associate
    info = info_good
  end subroutine prepare

  !> The pairs of DOFs that parameters belong to.
  pure subroutine find_pairs(rows, columns, sums)
    integer(ip), intent(in) :: rows(:), columns(:)
    type(derivative_sums), intent(inout) :: sums
    integer :: i, k, a, b

    sums%n_pairs = 0
    do i = 1, size(rows)
      a = int(min(rows(i), columns(i)))
      b = int(max(rows(i), columns(i)))
      do k = 1, sums%n_pairs
        if (sums%row(k) == a .and. sums%column(k) == b) exit
      end do
      sums%pair(i) = k
      if (k <= sums%n_pairs) cycle
      sums%n_pairs = k
      sums%row(k) = a
      sums%column(k) = b
    end do
  end subroutine find_pairs

  !> C becomes a square, W lies column by column, r follows the weighed columns.
  pure subroutine list_places(transposed, sums)
    logical, intent(in) :: transposed
    type(derivative_sums), intent(inout) :: sums
    integer :: i, j, before

    associate (n => sums%n, u => sums%n_entries, p => sums%n_par, m => sums%n_pairs)
      do i = 1, n
        do j = 1, n
          sums%from((i - 1)*n + j) = entry(min(i, j), max(i, j))
        end do
      end do
      do i = 1, n*n + p
        sums%place(i) = i
      end do
      before = n*n + p
      do j = 1, u
        do i = 1, u
          sums%place(before + (j - 1)*u + i) = before + merge((i - 1)*u + j, (j - 1)*u + i, transposed)
        end do
      end do
      do i = 1, u
        sums%place(before + u*u + i) = before + u*u + 2*u*m + i
      end do
    end associate

  contains

    !> The number of an entry of the upper triangle.
    pure integer function entry(row, column)
      integer, intent(in) :: row, column

      entry = ((row - 1)*(2*sums%n - row))/2 + column
    end function entry
  end subroutine list_places

  !> The shares from first to last.
  subroutine sum_shares(self, first, last, thread)
    class(derivative_sums), intent(in) :: self
    integer(long), intent(in) :: first, last
    integer, intent(in) :: thread
    integer(long) :: item
    integer :: b, line, n_lines, n2, before

    n2 = self%n**2
    before = n2 + self%n_par
    associate (u => self%n_entries, x => self%x(:, :, :, thread))
      do item = first, last
        self%partial(:, :, item) = 0.0_dp
        do b = int(item - 1)*share_blocks + 1, min(int(item)*share_blocks, (self%n_freq - 1)/lanes + 1)
          line = (b - 1)*lanes + 1
          n_lines = min(lanes, self%n_freq - line + 1)
          call self%kernels%pick(n2, u, self%from, self%place(:n2), line, n_lines, self%c_joint, x)
          call self%kernels%load(self%n_par, self%place(n2 + 1:before), line, n_lines, self%slopes, x)
          call self%kernels%load(u*u, self%place(before + 1:before + u*u), line, n_lines, self%information, x)
          call self%kernels%load(u, self%place(before + u*u + 1:), line, n_lines, self%residual, x)
          x(n_lines + 1:, :, n2 + 1:before) = 0.0_dp
          call self%kernels%joint_normal(self%n, self%n_pairs, self%row, self%column, self%n_par, self%pair, x, &
                                         self%partial(:, :, item))
        end do
      end do
    end associate
  end subroutine sum_shares
end module jointfrf_joint_derivatives
