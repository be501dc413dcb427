!> FRFs that fit a joint: the manifold on which a fit of measured FRFs is linearised.
!>
!> Whatever the substructures are, the receptances at the two sides of a joint K* can be written with two free matrices
!> H and Q, symmetric if the structure is reciprocal, and with the compliance R = (K* + Z)^-1 of the joint in parallel
!> with reference springs Z >= 0, a diagonal matrix:
!>   gamma_jj = H, gamma_jk = H F, gamma_kj = F' H, gamma_kk = F' H F + R A,
!>   F = T A, F' = A' T', A = 1 - Q R, A' = 1 - R Q, T = 1 - Z R, T' = 1 - R Z.
!> Nothing is inverted. With Z > 0 the form is regular for rigid DOFs (R = 0, T = 1) and free DOFs (R = 1/Z, T = 0).
!> With Z = 0, R is the compliance of the joint and Q = (Y_B + R)^-1 with the receptance Y_B of side k alone.
!>
!> Lanes are frequency lines, also with the engine that is LAPACK elsewhere, and for a single line; blocks of lines are
!> shared among threads.
module jointfrf_manifold
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use, intrinsic :: iso_c_binding, only: c_f_pointer, c_loc
  use jointfrf_engine, only: find_kernels
  use jointfrf_kinds, only: dp, ip, long
  use jointfrf_lanes, only: lane_kernels, lanes, real_lines, to_register
  use jointfrf_line_layout, only: store_nan
  use jointfrf_manifold_plan, only: by_all, by_diagonal, by_none, make_manifold_plan, manifold_plan
  use jointfrf_sharing, only: serial_flops_lanes, share, shared_work, threads_for
  use jointfrf_status, only: info_good, info_no_memory, line_good, line_not_finite, line_overflow
  implicit none
  private
  public :: expect_on_joint, joint_forms, project_on_joint

  !> The workspace of one thread.
  type :: block_space
    real(dp), allocatable :: room(:)                       !< where the others lie
    real(dp), pointer, contiguous :: x(:, :, :) => null()
    real(dp), pointer, contiguous :: w(:, :) => null()
    real(dp), pointer, contiguous :: whitening(:, :) => null()
    real(dp), allocatable :: squares(:, :)
  end type block_space

  !> Square matrices of a line, in the order of their lists.
  integer, parameter :: at_r = 1, at_h = 2, at_q = 3, at_best_h = 4, at_best_q = 5

  !> Lines as work to be shared: an item is a block of them.
  type, abstract, extends(shared_work) :: manifold_work
    type(manifold_plan) :: plan
    type(lane_kernels) :: kernels
    logical :: transposed = .false.
    integer :: n_target = 0                                !< FRFs of the caller
    integer, allocatable :: target(:, :), square(:, :)     !< where gamma and square matrices go, in the caller's order
    integer, allocatable :: of_targets(:)                  !< all entries of gamma
    integer, allocatable :: weight(:)                      !< where the caller has the weight of each entry
    real(dp), pointer, contiguous :: gamma(:, :, :, :) => null()         !< pairs, numbers, lines, targets
    real(dp), pointer, contiguous :: r(:, :, :) => null(), h(:, :, :) => null(), q(:, :, :) => null()
    real(dp), pointer, contiguous :: inverse_std(:, :) => null(), whitening(:, :, :) => null()
    integer(ip), pointer, contiguous :: line_info(:) => null()
    type(block_space), pointer, contiguous :: space(:) => null()
  contains
    procedure :: do_items => do_blocks
    procedure(block_routine), deferred :: do_block
  end type manifold_work

  type, extends(manifold_work) :: projection
    integer :: steps = 0
    real(dp) :: least_gain = 0.0_dp
    complex(dp), pointer, contiguous :: free_h(:, :, :) => null(), free_q(:, :, :) => null()
    real(dp), pointer, contiguous :: squares(:) => null()
  contains
    procedure :: do_block => project_block
  end type projection

  type, extends(manifold_work) :: form_finding
    integer, allocatable :: result(:), gradient_place(:, :)
    complex(dp), pointer, contiguous :: information(:, :, :) => null(), gradient(:, :, :) => null()
    real(dp), pointer, contiguous :: information_pairs(:, :, :) => null(), gradient_pairs(:, :, :, :) => null()
    real(dp), pointer, contiguous :: squares(:, :) => null()
  contains
    procedure :: do_block => find_block
  end type form_finding

  type, extends(manifold_work) :: expectation
    real(dp) :: share = 0.0_dp
    integer, allocatable :: free(:)                        !< where the caller has each free entry of Q
    complex(dp), pointer, contiguous :: free_h(:, :, :) => null(), free_q(:, :, :) => null()
    real(dp), pointer, contiguous :: spread_m(:, :) => null()
  contains
    procedure :: do_block => expect_block
  end type expectation

  abstract interface
    !> Lines first .. first + n_lines - 1, at most `lanes` of them; their data are in the workspace.
    subroutine block_routine(self, first, n_lines, space)
      import :: block_space, manifold_work
      implicit none
      class(manifold_work), intent(in) :: self
      integer, intent(in) :: first, n_lines
      type(block_space), intent(inout) :: space
    end subroutine block_routine
  end interface

contains

  !> The FRFs nearest to given ones that fit a joint, by Levenberg-Marquardt steps for H and Q on every line.
  !> gamma        FRFs at DOFs j, then k, shape (2 n, 2 n, n_freq), m/N; or packed, the entries that are read row by
  !>              row, shape (q, 1, n_freq)
  !> inverse_std  weights of their entries, same shape, N/m; 0 where an entry is not used
  !> whitening    lower triangular factor that is applied to the weighted entries, shape (q, q, n_freq); of size 0 where
  !>              there is none. Entries are counted row by row, of a reciprocal structure from the diagonal on.
  !> r            R, shape (n, n, n_freq), m/N
  !> h, q         H, m/N, and Q, N/m, shape (n, n, n_freq): where to begin, and the result
  !> squares      weighted squares of the distance, shape (n_freq)
  !> steps        at most
  !> least_gain   a line has arrived when a step lowers its squares by no more
  !> spring       Z, shape (n), N/m; of size 0 where there are none
  subroutine project_on_joint(transposed, reciprocal, steps, least_gain, gamma, inverse_std, whitening, r, h, q, &
                              squares, line_info, info, spring)
    logical, intent(in) :: transposed, reciprocal
    integer(ip), intent(in) :: steps
    real(dp), intent(in) :: least_gain
    complex(dp), contiguous, target, intent(in) :: gamma(:, :, :), r(:, :, :)
    real(dp), contiguous, target, intent(in) :: inverse_std(:, :, :), whitening(:, :, :)
    complex(dp), contiguous, target, intent(inout) :: h(:, :, :), q(:, :, :)
    real(dp), contiguous, target, intent(out) :: squares(:)
    integer(ip), contiguous, target, intent(out) :: line_info(:)
    integer(ip), intent(out) :: info
    real(dp), intent(in) :: spring(:)
    type(projection) :: work
    complex(dp), pointer, contiguous :: one_target(:, :, :, :)
    integer :: stat

    work%steps = int(steps)
    work%least_gain = least_gain
    work%free_h => h
    work%free_q => q
    work%squares => squares
    one_target(1:size(gamma, 1), 1:size(gamma, 2), 1:size(gamma, 3), 1:1) => gamma
    call make_manifold_plan(reciprocal, size(r, 1), by_none, 1, size(whitening) > 0, work%plan, stat, spring)
    if (stat == 0) call set_data(work, transposed, one_target, inverse_std, whitening, r, h, q, line_info, stat)
    call run(work, 30.0_dp*steps, stat, info)
  end subroutine project_on_joint

  !> The expected FRFs near ones that fit a joint, if entries of M = (Y_B + K*^-1)^-1 = Z T' + T Q T' are normal about
  !> 0 with given deviations, and the error of the FRFs is `share_of_noise` times their noise: least squares of both by
  !> one Gauss-Newton step. Off-diagonal entries of T are not in the prior.
  !> spread_m     standard deviations of the entries of M, shape (n, n, n_freq), > 0, N/m
  !> inverse_std, whitening, r, h, q, spring    as in `project_on_joint`
  subroutine expect_on_joint(transposed, reciprocal, share_of_noise, spread_m, inverse_std, whitening, r, h, q, &
                             line_info, info, spring)
    logical, intent(in) :: transposed, reciprocal
    real(dp), intent(in) :: share_of_noise
    real(dp), contiguous, target, intent(in) :: spread_m(:, :, :), inverse_std(:, :, :), whitening(:, :, :)
    complex(dp), contiguous, target, intent(in) :: r(:, :, :)
    complex(dp), contiguous, target, intent(inout) :: h(:, :, :), q(:, :, :)
    integer(ip), contiguous, target, intent(out) :: line_info(:)
    integer(ip), intent(out) :: info
    real(dp), intent(in) :: spring(:)
    type(expectation) :: work
    complex(dp), target :: no_target(size(inverse_std, 1), size(inverse_std, 2), size(line_info), 0)
    integer :: stat, k

    work%share = share_of_noise
    work%free_h => h
    work%free_q => q
    work%spread_m(1:size(r, 1)**2, 1:size(line_info)) => spread_m
    call make_manifold_plan(reciprocal, size(r, 1), by_none, 1, size(whitening) > 0, work%plan, stat, spring)
    if (stat == 0) call set_data(work, transposed, no_target, inverse_std, whitening, r, h, q, line_info, stat)
    if (stat == 0) allocate (work%free(work%plan%n_free), stat=stat)
    if (stat == 0) then
      do k = 1, work%plan%n_free
        associate (n => work%plan%n, row => work%plan%row(k), column => work%plan%column(k))
          work%free(k) = merge(column + (row - 1)*n, row + (column - 1)*n, transposed)
        end associate
      end do
    end if
    call run(work, 30.0_dp, stat, info)
  end subroutine expect_on_joint

  !> Information that FRFs give on a joint about a point of the manifold, H and Q eliminated: with d the change of the
  !> free entries of R, the least squares over H and Q are, to second order, s - 2 Re(d^H p) + d^H W d.
  !> gamma        FRFs at DOFs j, then k, shape (2 n, 2 n, n_freq, n_target), m/N
  !> inverse_std, whitening, r, spring    as in `project_on_joint`, the same for all targets
  !> h, q         the point, shape (n, n, n_freq)
  !> information  W, shape (u, u, n_freq); free entries of R are the upper triangle row by row, or all. With `diagonal`
  !>              u is n, and d the change of the diagonal of R alone.
  !> gradient     p, shape (u, n_freq, n_target)
  !> squares      s, shape (n_freq, n_target)
  subroutine joint_forms(transposed, reciprocal, diagonal, gamma, inverse_std, whitening, r, h, q, information, &
                         gradient, squares, line_info, info, spring)
    logical, intent(in) :: transposed, reciprocal, diagonal
    complex(dp), contiguous, target, intent(in) :: gamma(:, :, :, :), r(:, :, :), h(:, :, :), q(:, :, :)
    real(dp), contiguous, target, intent(in) :: inverse_std(:, :, :), whitening(:, :, :)
    complex(dp), contiguous, target, intent(out) :: information(:, :, :), gradient(:, :, :)
    real(dp), contiguous, target, intent(out) :: squares(:, :)
    integer(ip), contiguous, target, intent(out) :: line_info(:)
    integer(ip), intent(out) :: info
    real(dp), intent(in) :: spring(:)
    type(form_finding) :: work
    integer :: stat, i, t

    call make_manifold_plan(reciprocal, size(r, 1), merge(by_diagonal, by_all, diagonal), size(gamma, 4), &
                            size(whitening) > 0, work%plan, stat, spring)
    if (stat == 0) call set_data(work, transposed, gamma, inverse_std, whitening, r, h, q, line_info, stat)
    associate (plan => work%plan)
      if (stat == 0) allocate (work%result(plan%n_joint**2), work%gradient_place(plan%n_joint, plan%n_target), &
                               stat=stat)
      if (stat == 0) then
        call list_square(transposed, plan%n_joint, plan%result, work%result)
        do t = 1, plan%n_target
          do i = 1, plan%n_joint
            work%gradient_place(i, t) = plan%normal + (plan%n_joint + t - 1)*(plan%n_column - 2*plan%n_free) + i
          end do
        end do
      end if
    end associate
    work%information => information
    work%information_pairs => real_lines(information)
    work%gradient => gradient
    call c_f_pointer(c_loc(gradient), work%gradient_pairs, [2, size(gradient, 1), size(gradient, 2), size(gradient, 3)])
    work%squares => squares
    call run(work, 60.0_dp, stat, info)
  end subroutine joint_forms

  !> The elements of a square matrix of order n that lies row by row behind `before`, in the caller's order.
  pure subroutine list_square(transposed, n, before, list)
    logical, intent(in) :: transposed
    integer, intent(in) :: n, before
    integer, intent(out) :: list(:)
    integer :: i, j

    do j = 1, n
      do i = 1, n
        list((j - 1)*n + i) = before + merge((j - 1)*n + i, (i - 1)*n + j, transposed)
      end do
    end do
  end subroutine list_square

  subroutine set_data(work, transposed, gamma, inverse_std, whitening, r, h, q, line_info, stat)
    class(manifold_work), intent(inout) :: work
    logical, intent(in) :: transposed
    complex(dp), contiguous, target, intent(in) :: gamma(:, :, :, :), r(:, :, :), h(:, :, :), q(:, :, :)
    real(dp), contiguous, target, intent(in) :: inverse_std(:, :, :), whitening(:, :, :)
    integer(ip), contiguous, target, intent(inout) :: line_info(:)
    integer, intent(out) :: stat
    integer :: n, n_given, e, t

    n = work%plan%n
    n_given = size(inverse_std, 1)*size(inverse_std, 2)
    work%transposed = transposed
    allocate (work%weight(work%plan%n_entry), work%target(n_given, work%plan%n_target), work%square(n*n, 5), &
              work%of_targets(work%plan%n_entry*size(gamma, 4)), stat=stat)
    if (stat /= 0) return
    work%target = work%plan%unused + 4
    do e = 1, work%plan%n_entry
      associate (row => work%plan%gamma_row(e), column => work%plan%gamma_column(e))
        work%weight(e) = merge(column + (row - 1)*2*n, row + (column - 1)*2*n, transposed)
      end associate
    end do
    if (size(inverse_std, 2) == 1) then                    ! packed: entry in_rows(i) is number i
      do e = 1, work%plan%n_entry
        work%weight(work%plan%in_rows(e)) = e
      end do
    end if
    do e = 1, work%plan%n_entry
      do t = 1, work%plan%n_target
        work%target(work%weight(e), t) = work%plan%target + (t - 1)*work%plan%n_entry + e
      end do
    end do
    do e = 1, size(work%of_targets)
      work%of_targets(e) = work%plan%target + e
    end do
    call list_square(transposed, n, work%plan%r, work%square(:, at_r))
    call list_square(transposed, n, work%plan%h, work%square(:, at_h))
    call list_square(transposed, n, work%plan%q, work%square(:, at_q))
    call list_square(transposed, n, work%plan%best_h, work%square(:, at_best_h))
    call list_square(transposed, n, work%plan%best_q, work%square(:, at_best_q))
    work%n_target = size(gamma, 4)
    if (work%n_target > 0) call c_f_pointer(c_loc(gamma), work%gamma, [2, n_given, size(gamma, 3), size(gamma, 4)])
    work%r => real_lines(r)
    work%h => real_lines(h)
    work%q => real_lines(q)
    work%inverse_std(1:n_given, 1:size(inverse_std, 3)) => inverse_std
    work%whitening => whitening
    work%line_info => line_info
  end subroutine set_data

  !> Share the blocks of lines.
  !> stat       not 0 where there was no memory for the plan
  !> products   of two numbers of all columns, in squares of their number
  subroutine run(work, products, stat, info)
    class(manifold_work), intent(inout) :: work
    real(dp), intent(in) :: products
    integer, intent(inout) :: stat
    integer(ip), intent(out) :: info
    integer(long) :: n_blocks
    integer :: threads, t
    logical :: found
    real(dp) :: flops

    call find_kernels(work%kernels, found, info)
    if (info == info_good .and. stat /= 0) info = info_no_memory
    if (info /= info_good) return
    if (size(work%line_info) == 0) return
    flops = products*real(work%plan%n_entry, dp)*real(work%plan%n_free, dp)**2*size(work%line_info)
    n_blocks = (size(work%line_info, kind=long) - 1)/lanes + 1
    threads = threads_for(flops, n_blocks, serial_flops_lanes)
    allocate (work%space(threads), stat=stat)
    if (stat /= 0) then
      info = info_no_memory
      return
    end if
    do t = 1, threads
      if (stat == 0) call prepare(work%plan, work%space(t), stat)
    end do
    if (stat == 0) then
      call share(work, n_blocks, threads, even=.false.)
      info = count(work%line_info /= line_good, kind=ip)
    else
      info = info_no_memory
    end if
    do t = 1, threads
      if (allocated(work%space(t)%room)) deallocate (work%space(t)%room)
      if (allocated(work%space(t)%squares)) deallocate (work%space(t)%squares)
    end do
    deallocate (work%space)
  end subroutine run

  !> Workspace of one thread. Elements begin where a register does.
  subroutine prepare(plan, space, stat)
    type(manifold_plan), intent(in) :: plan
    type(block_space), target, intent(inout) :: space
    integer, intent(out) :: stat
    integer(long) :: n_x, n_w, n_whitening, at

    n_x = int(lanes, long)*2*plan%n_element
    n_w = int(lanes, long)*plan%n_entry
    n_whitening = 0
    if (plan%correlated) n_whitening = n_w*(plan%n_entry + 1)/2
    allocate (space%room(n_x + n_w + n_whitening + lanes), space%squares(lanes, plan%n_target), stat=stat)
    if (stat /= 0) return
    at = to_register(c_loc(space%room))
    space%x(1:lanes, 1:2, 1:plan%n_element) => space%room(at + 1:at + n_x)
    at = at + n_x
    space%w(1:lanes, 1:plan%n_entry) => space%room(at + 1:at + n_w)
    at = at + n_w
    space%whitening(1:lanes, 1:n_whitening/lanes) => space%room(at + 1:at + n_whitening)
  end subroutine prepare

  !> The blocks from first to last.
  subroutine do_blocks(self, first, last, thread)
    class(manifold_work), intent(in) :: self
    integer(long), intent(in) :: first, last
    integer, intent(in) :: thread
    integer(long) :: i
    integer :: line, n_lines

    do i = first, last
      line = int((i - 1)*lanes) + 1
      n_lines = min(lanes, size(self%line_info) - line + 1)
      call load_block(self, line, n_lines, self%space(thread), self%line_info(line:line + n_lines - 1))
      call self%do_block(line, n_lines, self%space(thread))
    end do
  end subroutine do_blocks

  !> The caller's lines into lanes, and which of them hold NaN or Inf, or a weight that is negative.
  subroutine load_block(self, first, n_lines, space, line_info)
    class(manifold_work), intent(in) :: self
    integer, intent(in) :: first, n_lines
    type(block_space), intent(inout) :: space
    integer(ip), intent(out) :: line_info(n_lines)
    real(dp) :: total(lanes), of_targets(lanes), least(lanes)
    integer :: n2, q, e, t, l, line, i, j

    q = self%plan%n_entry
    n2 = self%plan%n**2
    least = 0.0_dp
    do e = 1, q
      do l = 1, lanes
        space%w(l, e) = self%inverse_std(self%weight(e), first + min(l, n_lines) - 1)
      end do
      least = min(least, space%w(:, e))
    end do
    total = sum(abs(space%w), dim=2)
    if (self%plan%correlated) then
      do l = 1, lanes
        line = first + min(l, n_lines) - 1
        do i = 1, q
          do j = 1, i
            space%whitening(l, (i*(i - 1))/2 + j) = self%whitening(merge(j, i, self%transposed), &
                                                                   merge(i, j, self%transposed), line)
          end do
        end do
      end do
      total = total + sum(abs(space%whitening), dim=2)
    end if
    call load_square(self%r, self%square(:, at_r))
    call load_square(self%h, self%square(:, at_h))
    call load_square(self%q, self%square(:, at_q))
    do t = 1, self%n_target
      call self%kernels%load(size(self%target, 1), self%target(:, t), first, n_lines, self%gamma(:, :, :, t), space%x)
      associate (data => space%x(:, :, self%plan%target + (t - 1)*q + 1:self%plan%target + t*q))
        do e = 1, q
          do l = 1, lanes
            if (abs(space%w(l, e)) > 0.0_dp) cycle
            data(l, :, e) = 0.0_dp                         ! not used
          end do
        end do
      end associate
    end do
    call self%kernels%total(q*self%n_target, self%of_targets, space%x, of_targets)
    total = total + of_targets
    line_info = merge(line_good, line_not_finite, total(:n_lines) <= huge(1.0_dp) .and. .not. least(:n_lines) < 0.0_dp)

  contains

    subroutine load_square(lines, place)
      real(dp), contiguous, intent(in) :: lines(:, :, :)
      integer, contiguous, intent(in) :: place(:)
      real(dp) :: here(lanes)

      call self%kernels%load(n2, place, first, n_lines, lines, space%x)
      call self%kernels%total(n2, place, space%x, here)
      total = total + here
    end subroutine load_square
  end subroutine load_block

  subroutine project_block(self, first, n_lines, space)
    class(projection), intent(in) :: self
    integer, intent(in) :: first, n_lines
    type(block_space), intent(inout) :: space
    integer :: n2, l, line

    n2 = self%plan%n**2
    associate (plan => self%plan, x => space%x)
      x(:, :, plan%best_h + 1:plan%best_h + n2) = x(:, :, plan%h + 1:plan%h + n2)
      x(:, :, plan%best_q + 1:plan%best_q + n2) = x(:, :, plan%q + 1:plan%q + n2)
      call self%kernels%project(plan, self%steps, self%least_gain, space%w, space%whitening, x, space%squares(:, 1))
      call self%kernels%store(n2, self%square(:, at_best_h), first, n_lines, x, self%h)
      call self%kernels%store(n2, self%square(:, at_best_q), first, n_lines, x, self%q)
    end associate
    do l = 1, n_lines
      line = first + l - 1
      self%squares(line) = space%squares(l, 1)
      if (.not. space%squares(l, 1) <= huge(1.0_dp)) call overflow(self%line_info(line))
      if (self%line_info(line) == line_good) cycle
      call store_nan(self%free_h(:, :, line))
      call store_nan(self%free_q(:, :, line))
      self%squares(line) = ieee_value(1.0_dp, ieee_quiet_nan)
    end do
  end subroutine project_block

  subroutine expect_block(self, first, n_lines, space)
    class(expectation), intent(in) :: self
    integer, intent(in) :: first, n_lines
    type(block_space), intent(inout) :: space
    real(dp) :: of_h(lanes), of_q(lanes)
    integer :: n2, k, l, line

    n2 = self%plan%n**2
    associate (plan => self%plan, x => space%x)
      x(:, :, plan%best_h + 1:plan%best_h + n2) = x(:, :, plan%h + 1:plan%h + n2)
      x(:, :, plan%best_q + 1:plan%best_q + n2) = x(:, :, plan%q + 1:plan%q + n2)
      do k = 1, plan%n_free
        do l = 1, lanes
          x(l, 1, plan%target + k) = self%spread_m(self%free(k), first + min(l, n_lines) - 1)
        end do
      end do
      call self%kernels%expect(plan, self%share, space%w, space%whitening, x)
      call self%kernels%total(n2, self%square(:, at_h), x, of_h)
      call self%kernels%total(n2, self%square(:, at_q), x, of_q)
      call self%kernels%store(n2, self%square(:, at_h), first, n_lines, x, self%h)
      call self%kernels%store(n2, self%square(:, at_q), first, n_lines, x, self%q)
    end associate
    do l = 1, n_lines
      line = first + l - 1
      if (.not. of_h(l) + of_q(l) <= huge(1.0_dp)) call overflow(self%line_info(line))
      if (self%line_info(line) == line_good) cycle
      call store_nan(self%free_h(:, :, line))
      call store_nan(self%free_q(:, :, line))
    end do
  end subroutine expect_block

  subroutine find_block(self, first, n_lines, space)
    class(form_finding), intent(in) :: self
    integer, intent(in) :: first, n_lines
    type(block_space), intent(inout) :: space
    real(dp) :: total(lanes), of_gradient(lanes)
    integer :: u, t, l, line

    u = self%plan%n_joint
    call self%kernels%joint_form(self%plan, space%w, space%whitening, space%x, space%squares)
    call self%kernels%store(u*u, self%result, first, n_lines, space%x, self%information_pairs)
    call self%kernels%total(u*u, self%result, space%x, total)
    do t = 1, self%plan%n_target
      call self%kernels%store(u, self%gradient_place(:, t), first, n_lines, space%x, self%gradient_pairs(:, :, :, t))
      call self%kernels%total(u, self%gradient_place(:, t), space%x, of_gradient)
      total = total + of_gradient + space%squares(:, t)
    end do
    do l = 1, n_lines
      line = first + l - 1
      self%squares(line, :) = space%squares(l, :)
      if (.not. total(l) <= huge(1.0_dp)) call overflow(self%line_info(line))
      if (self%line_info(line) == line_good) cycle
      call store_nan(self%information(:, :, line))
      do t = 1, self%plan%n_target
        call store_nan(self%gradient(:, line:line, t))
      end do
      self%squares(line, :) = ieee_value(1.0_dp, ieee_quiet_nan)
    end do
  end subroutine find_block

  !> A good line becomes one whose result is not finite.
  subroutine overflow(line_info)
    integer(ip), intent(inout) :: line_info

    if (line_info == line_good) line_info = line_overflow
  end subroutine overflow
end module jointfrf_manifold
