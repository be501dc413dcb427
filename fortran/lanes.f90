!> Lanes: several frequency lines worked on at once, one a lane of the processor's vector registers.
!>
!> A workspace x(lanes, 2, *) holds numbers of `lanes` lines side by side, real and imaginary parts apart. One complex
!> number of every lane is an `element`; a matrix is a run of elements, rows one after the other unless a list says
!> where each element lies. What is done with elements is a set of kernels, compiled from one source for several
!> instruction sets (folder `lanes/`); `engine.F90` chooses among them.
!>
!> Kernels return sums in which NaN, Inf and overflow show, and estimates of the condition. A line in doubt is done
!> again by the reference engine, so that both engines give the same codes.
module jointfrf_lanes
  use, intrinsic :: iso_c_binding, only: c_f_pointer, c_intptr_t, c_loc, c_ptr
  use, intrinsic :: iso_fortran_env, only: int64
  use jointfrf_elimination_plan, only: elimination_plan
  use jointfrf_kinds, only: dp, ip
  use jointfrf_lookahead, only: lookahead
  use jointfrf_manifold_plan, only: manifold_plan
  implicit none
  private
  public :: lane_kernels, element_matrix, element_space, sparse_rows, padded, to_register, real_lines, rows_in_memory, &
    find_rows, has_weight, worse_of

  !> Lines side by side. One register of AVX-512, two of AVX2, four of SSE2.
  integer, parameter, public :: lanes = 8

  !> Up to this order there is an inverse of its own for each order; its matrix lies row by row.
  integer, parameter, public :: largest_constant = 7
  !> Above this order LAPACK line by line is as fast in an inverse, and where large matrices give a small result,
  integer, parameter, public :: largest_in_lanes = 128
  !> and above this one in a solution, and where a large result leaves the caches.
  integer, parameter, public :: largest_solved = 64
  !> Above this size of what only enters products, or is solved for, a block leaves the caches.
  integer, parameter, public :: largest_product = 128

  !> What a block says of a line that it leaves to the reference engine; no line keeps it.
  integer(ip), parameter, public :: in_doubt = huge(1_ip)
  !> Below this reciprocal condition number a line of a block is in doubt: LAPACK may find it exactly singular.
  real(dp), parameter, public :: doubtful = 1.0e-14_dp

  !> A real matrix as the entries of its rows that are not zero.
  type :: sparse_rows
    integer :: n = 0                         !< rows
    integer, allocatable :: start(:)         !< where the entries of each row begin, and one more, shape (n + 1)
    integer, allocatable :: from(:)          !< their columns
    real(dp), allocatable :: weight(:)       !< and values
    logical :: unused = .false.              !< whether a column has no entry
    !> Where few entries are zero all of them, eight rows side by side: entry (i, j) is full(i - 8 s, j, s + 1), and
    !> zeros follow the last row.
    real(dp), allocatable :: full(:, :, :)
  end type sparse_rows

  abstract interface
    !> Which lines of a block are in doubt.
    !> total        sums in which NaN, Inf and overflow of the results show
    !> line_info    0, or `in_doubt`
    !> rcond        reciprocal condition numbers, cut off at 1
    subroutine judge_routine(n_lines, total, line_info, rcond)
      import :: dp, ip
      implicit none
      integer, intent(in) :: n_lines
      real(dp), intent(in) :: total(n_lines)
      integer(ip), intent(out) :: line_info(n_lines)
      real(dp), intent(inout) :: rcond(n_lines)
    end subroutine judge_routine

    !> Lines of the caller into lanes.
    !> n        numbers a line
    !> place    the element that each number goes to, shape (n)
    !> first    the first line
    !> n_lines  lines there are, 1..lanes; the last one fills the lanes that are left
    subroutine load_routine(n, place, first, n_lines, lines, x)
      import :: dp, lanes
      implicit none
      integer, intent(in) :: n, place(n), first, n_lines
      real(dp), intent(in) :: lines(2, n, *)
      real(dp), intent(inout) :: x(lanes, 2, *)
    end subroutine load_routine

    !> Some numbers of the caller's lines into lanes.
    !> n      numbers taken of a line
    !> m      numbers a line
    !> from   which numbers, shape (n)
    !> Other arguments as in load.
    subroutine pick_routine(n, m, from, place, first, n_lines, lines, x)
      import :: dp, lanes
      implicit none
      integer, intent(in) :: n, m, from(n), place(n), first, n_lines
      real(dp), intent(in) :: lines(2, m, *)
      real(dp), intent(inout) :: x(lanes, 2, *)
    end subroutine pick_routine

    !> Lanes into the caller's lines. Arguments as in load.
    subroutine store_routine(n, place, first, n_lines, x, lines)
      import :: dp, lanes
      implicit none
      integer, intent(in) :: n, place(n), first, n_lines
      real(dp), intent(in) :: x(lanes, 2, *)
      real(dp), intent(inout) :: lines(2, n, *)
    end subroutine store_routine

    !> Sum of |re| + |im| over elements, shape (lanes): not finite where one of them is not.
    subroutine total_routine(n, from, x, total)
      import :: dp, lanes
      implicit none
      integer, intent(in) :: n, from(n)
      real(dp), intent(in) :: x(lanes, 2, *)
      real(dp), intent(out) :: total(lanes)
    end subroutine total_routine

    !> x(to) = factor x(from), element by element.
    subroutine copy_routine(n, factor, from, to, x)
      import :: dp, lanes
      implicit none
      integer, intent(in) :: n, from(n), to(n)
      real(dp), intent(in) :: factor
      real(dp), intent(inout) :: x(lanes, 2, *)
    end subroutine copy_routine

    !> x(to) = value, the same in all lanes.
    subroutine fill_routine(n, value, to, x)
      import :: dp, lanes
      implicit none
      integer, intent(in) :: n, to(n)
      complex(dp), intent(in) :: value(n)
      real(dp), intent(inout) :: x(lanes, 2, *)
    end subroutine fill_routine

    !> x(to) = fa x(a) + fb x(b), element by element.
    subroutine combine_routine(n, fa, a, fb, b, to, x)
      import :: dp, lanes
      implicit none
      integer, intent(in) :: n, a(n), b(n), to(n)
      real(dp), intent(in) :: fa, fb
      real(dp), intent(inout) :: x(lanes, 2, *)
    end subroutine combine_routine

    !> C = C + factor A B.
    !> m, n, k   A is m by k, B is k by n
    !> a, b, c   the element before the first one of each row, shapes (m), (k), (m)
    subroutine product_routine(m, n, k, factor, a, b, c, x)
      import :: dp, lanes
      implicit none
      integer, intent(in) :: m, n, k, a(m), b(k), c(m)
      real(dp), intent(in) :: factor
      real(dp), intent(inout) :: x(lanes, 2, *)
    end subroutine product_routine

    !> Inverse of a matrix that lies as a system without right-hand sides, see `system_position`. The inverse comes back
    !> at other places.
    !> n       order
    !> before  the element before the system
    !> hint    pivot rows to try first, 0 where none is known, shape (padded(n)); as found on return
    !> place   where the inverse lies, row by row, shape (n*n)
    !> rcond   reciprocal condition number; not finite where something overflowed
    !> ahead   memory to ask for on the way
    subroutine invert_routine(n, before, x, hint, place, rcond, ahead)
      import :: dp, lanes, lookahead
      implicit none
      integer, intent(in) :: n, before
      real(dp), intent(inout) :: x(lanes, 2, *)
      integer, intent(inout) :: hint(*)
      integer, intent(out) :: place(n*n)
      real(dp), intent(out) :: rcond(lanes)
      type(lookahead), intent(inout), optional :: ahead
    end subroutine invert_routine

    !> Solution of A X = B by elimination with threshold pivoting (1/3 of the largest; partial pivoting where the order
    !> is small) and back substitution.
    !> n        order
    !> n_rhs    right-hand sides
    !> n_last   how many of the last unknowns are wanted
    !> before   the element before the system, see `system_position`
    !> hint     pivot rows to try first, 0 where none is known, shape (padded(n)); as found on return
    !> row      the element before the first one of each row of X, shape (n); the last n_last are valid
    !> rcond    estimate of the reciprocal condition number; not finite where something overflowed
    !> ahead    memory to ask for on the way
    subroutine solve_routine(n, n_rhs, n_last, before, x, hint, row, rcond, ahead)
      import :: dp, lanes, lookahead
      implicit none
      integer, intent(in) :: n, n_rhs, n_last, before
      real(dp), intent(inout) :: x(lanes, 2, *)
      integer, intent(inout) :: hint(*)
      integer, intent(out) :: row(n)
      real(dp), intent(out) :: rcond(lanes)
      type(lookahead), intent(inout), optional :: ahead
    end subroutine solve_routine

    !> Elimination of Z = K - w^2 M + i (H + w C) by a plan, with pivots in the plan's order.
    !> omega      angular frequencies, shape (lanes)
    !> x          the square of the plan; holds what is left of Z for the retained unknowns on return
    !> smallest   smallest |pivot|^2, shape (lanes); NaN where a pivot is not finite
    subroutine eliminate_routine(plan, omega, x, smallest)
      import :: dp, elimination_plan, lanes
      implicit none
      type(elimination_plan), intent(in) :: plan
      real(dp), intent(in) :: omega(lanes)
      real(dp), intent(inout) :: x(lanes, 2, *)
      real(dp), intent(out) :: smallest(lanes)
    end subroutine eliminate_routine

    !> Superposition of modes with residues R: sums of R/(lambda - w^2 + i (loss + w c)).
    !> n_modes    number of modes, at least 1
    !> n_four     number of entries over four
    !> stiffness  lambda, shape (n_modes), (rad/s)^2; loss (lambda eta) and damping (c, rad/s) alike
    !> residue    shape (4, n_modes, n_four)
    !> omega      angular frequencies, shape (lanes)
    !> x          first n_modes elements of workspace, then 4 n_four of result
    !> smallest   smallest squared modulus of a denominator, shape (lanes); NaN where one is zero or not finite
    !> largest    largest, shape (lanes)
    subroutine superpose_routine(n_modes, n_four, stiffness, loss, damping, residue, omega, x, smallest, largest)
      import :: dp, lanes
      implicit none
      integer, intent(in) :: n_modes, n_four
      real(dp), intent(in) :: stiffness(n_modes), loss(n_modes), damping(n_modes), residue(4, n_modes, n_four)
      real(dp), intent(in) :: omega(lanes)
      real(dp), intent(inout) :: x(lanes, 2, *)
      real(dp), intent(out) :: smallest(lanes), largest(lanes)
    end subroutine superpose_routine

    !> Two words of random bits for every counter, see `lanes/random_numbers.inc`.
    !> n      counters a lane
    !> key    shape (2)
    !> low    first word of the counters, shape (lanes, n)
    !> high   second word, the same for all n counters of a lane
    subroutine words_routine(n, key, low, high, words)
      import :: int64, lanes
      implicit none
      integer, intent(in) :: n
      integer(int64), intent(in) :: key(2), low(lanes, n), high(lanes)
      integer(int64), intent(out) :: words(lanes, 2, n)
    end subroutine words_routine

    !> Random numbers as real and imaginary parts; `size` is the variance of a part, or half the width. Counters as in
    !> words_routine.
    subroutine draw_routine(n, size, key, low, high, x)
      import :: dp, int64, lanes
      implicit none
      integer, intent(in) :: n
      real(dp), intent(in) :: size
      integer(int64), intent(in) :: key(2), low(lanes, n), high(lanes)
      real(dp), intent(out) :: x(lanes, 2, n)
    end subroutine draw_routine

    !> polluted = h + s e for numbers in a row; number i has its noise e in lane mod(i - 1, lanes) + 1.
    subroutine pollute_flat_routine(n, h, s, e, polluted)
      import :: dp, lanes
      implicit none
      integer, intent(in) :: n
      real(dp), intent(in) :: h(2, n), s(2, n), e(lanes, 2, *)
      real(dp), intent(out) :: polluted(2, n)
    end subroutine pollute_flat_routine

    !> x(place) = h + s e, with other noise in every lane.
    subroutine pollute_lanes_routine(n, h, s, e, place, x)
      import :: dp, lanes
      implicit none
      integer, intent(in) :: n, place(n)
      real(dp), intent(in) :: h(2, n), s(2, n), e(lanes, 2, n)
      real(dp), intent(inout) :: x(lanes, 2, *)
    end subroutine pollute_lanes_routine

    !> The largest modulus among numbers that are finite, 0 where there is none.
    pure function largest_routine(n, h) result(modulus)
      import :: dp
      implicit none
      integer, intent(in) :: n
      real(dp), intent(in) :: h(2, n)
      real(dp) :: modulus
    end function largest_routine

    !> One more value in every lane: means, and sums of squares about them.
    !> n        elements
    !> from     where they lie, shape (n)
    !> taken    1 in lanes whose values count, else 0
    !> number   values counted so far, those of this call included
    !> mean     shape (lanes, 2, n)
    !> square   sums of re*re, im*im and re*im about the mean, shape (lanes, 3, n)
    subroutine moments_routine(n, from, x, taken, number, mean, square)
      import :: dp, lanes
      implicit none
      integer, intent(in) :: n, from(n)
      real(dp), intent(in) :: x(lanes, 2, *), taken(lanes), number(lanes)
      real(dp), intent(inout) :: mean(lanes, 2, n), square(lanes, 3, n)
    end subroutine moments_routine

    !> Inverse of lines of order n, 1 or 2, without workspace.
    !> a, a_inverse   the caller's lines, of which n_lines from `first` on are done; any number of them
    !> rcond          not finite where something overflowed
    subroutine invert_lines_routine(n, first, n_lines, a, a_inverse, rcond)
      import :: dp
      implicit none
      integer, intent(in) :: n, first, n_lines
      real(dp), intent(in) :: a(2, n*n, *)
      real(dp), intent(inout) :: a_inverse(2, n*n, *)
      real(dp), intent(out) :: rcond(n_lines)
    end subroutine invert_lines_routine

    !> Solution of lines of order 1 with one right-hand side, without workspace.
    !> a, b, x   the caller's lines, of which n_lines from `first` on are done; any number of them
    !> rcond     not finite where something overflowed
    subroutine divide_lines_routine(first, n_lines, a, b, x, rcond)
      import :: dp
      implicit none
      integer, intent(in) :: first, n_lines
      real(dp), intent(in) :: a(2, *), b(2, *)
      real(dp), intent(inout) :: x(2, *)
      real(dp), intent(out) :: rcond(n_lines)
    end subroutine divide_lines_routine

    !> ISMM for one joint DOF, without workspace. Arguments as in `ismm`, as pairs of real numbers.
    subroutine identify_lines_routine(transposed, first, n_lines, alpha, gamma, k_initial, k_joint, rcond)
      import :: dp
      implicit none
      logical, intent(in) :: transposed
      integer, intent(in) :: first, n_lines
      real(dp), intent(in) :: alpha(8, *), gamma(8, *), k_initial(2, *)
      real(dp), intent(inout) :: k_joint(2, *)
      real(dp), intent(out) :: rcond(n_lines)
    end subroutine identify_lines_routine

    !> Real transformations of both sides of a line.
    !> slow_first       which side is transformed first: results are the same in either order of storage
    !> m_slow, m_fast   size of a line h as it is stored: columns, and rows, which lie side by side
    !> slow, fast       what entries of the new line are made of, along either
    !> work             workspace, 2 max(m_fast max(1, slow%n), fast%n m_slow) + 2 lanes m_slow numbers
    !> total            shape (n_lines): sums in which NaN, Inf and overflow show
    subroutine transform_lines_routine(slow_first, m_slow, m_fast, slow, fast, first, n_lines, h, work, h_new, total)
      import :: dp, sparse_rows
      implicit none
      logical, intent(in) :: slow_first
      integer, intent(in) :: m_slow, m_fast, first, n_lines
      type(sparse_rows), intent(in) :: slow, fast
      real(dp), intent(in) :: h(2, m_fast, m_slow, *)
      real(dp), intent(inout) :: work(*)
      real(dp), intent(inout) :: h_new(2, fast%n, slow%n, *)
      real(dp), intent(out) :: total(n_lines)
    end subroutine transform_lines_routine

    !> The same by the weights of both sides at once.
    !> m      numbers of a line
    !> rows   what each number of the new line is made of
    subroutine weigh_lines_routine(m, rows, first, n_lines, h, h_new, total)
      import :: dp, sparse_rows
      implicit none
      integer, intent(in) :: m, first, n_lines
      type(sparse_rows), intent(in) :: rows
      real(dp), intent(in) :: h(2, m, *)
      real(dp), intent(inout) :: h_new(2, rows%n, *)
      real(dp), intent(out) :: total(n_lines)
    end subroutine weigh_lines_routine

    !> Rows of n elements weighed by real numbers: y_p = c_p + sum of w x_b, over the rows b that have a weight.
    !> rows       for each y, which x and their weights
    !> constant   c, the same in all lanes, shape (n, rows%n)
    !> from, to   the element before the first x, and before the first y; rows follow each other
    subroutine weigh_rows_routine(n, rows, constant, from, to, x)
      import :: dp, lanes, sparse_rows
      implicit none
      integer, intent(in) :: n, from, to
      type(sparse_rows), intent(in) :: rows
      real(dp), intent(in) :: constant(n, rows%n)
      real(dp), intent(inout) :: x(lanes, 2, *)
    end subroutine weigh_rows_routine

    !> Covariance of C from factors of its change, dC_ab = sum of U_ap V_qb e_pq over m by m entries.
    !> reciprocal   whether e is (e + e^T)/2 of independent entries
    !> u, v         the element before U and before V^T, column by column
    !> spread       before the variances E|e_pq|^2, real parts, column by column; symmetric where reciprocal
    !> work         before (n + 2) m elements of workspace
    !> covariance   before E[dC_ab conj(dC_cd)], n^4 elements; b runs fastest, then d, a and c
    subroutine propagate_routine(n, m, reciprocal, u, v, spread, work, covariance, x)
      import :: dp, lanes
      implicit none
      integer, intent(in) :: n, m, u, v, spread, work, covariance
      logical, intent(in) :: reciprocal
      real(dp), intent(inout) :: x(lanes, 2, *)
    end subroutine propagate_routine

    !> total = total + sum of |re| + |im| over numbers that lie side by side.
    subroutine add_moduli_routine(n, x, total)
      import :: dp
      implicit none
      integer, intent(in) :: n
      real(dp), intent(in) :: x(2*n)
      real(dp), intent(inout) :: total
    end subroutine add_moduli_routine

    !> Short form of ISMM for one joint DOF, without workspace. Arguments as in `inverse_substructuring`, as pairs of
    !> real numbers.
    subroutine invert_joint_lines_routine(transposed, first, n_lines, gamma, k_joint, rcond)
      import :: dp
      implicit none
      logical, intent(in) :: transposed
      integer, intent(in) :: first, n_lines
      real(dp), intent(in) :: gamma(8, *)
      real(dp), intent(inout) :: k_joint(2, *)
      real(dp), intent(out) :: rcond(n_lines)
    end subroutine invert_joint_lines_routine

    !> FRFs nearest to given ones that fit a joint, see jointfrf_manifold_plan.
    !> steps       at most
    !> least_gain  a line has arrived when a step lowers its squares by no more
    !> w           weights of the entries of gamma, shape (lanes, n_entry)
    !> whitening   rows of the triangular factor up to the diagonal, shape (lanes, n_entry*(n_entry + 1)/2)
    !> x           holds C, the target, and the best H and M, also on return
    !> squares     weighted squares of the distance; not finite where the first point was not, and is still there
    subroutine project_routine(plan, steps, least_gain, w, whitening, x, squares)
      import :: dp, lanes, manifold_plan
      implicit none
      type(manifold_plan), intent(in) :: plan
      integer, intent(in) :: steps
      real(dp), intent(in) :: least_gain, w(lanes, *), whitening(lanes, *)
      real(dp), intent(inout) :: x(lanes, 2, *)
      real(dp), intent(out) :: squares(lanes)
    end subroutine project_routine

    !> Expected FRFs that fit a joint, where entries of M are normal about 0 and the error of the FRFs is.
    !> share          error of the FRFs over the noise that w weighs by
    !> w, whitening   as in project_routine
    !> x              holds C, the best H and M, and in `target` the standard deviations of the free entries of M; on
    !>                return the expected H and M
    subroutine expect_routine(plan, share, w, whitening, x)
      import :: dp, lanes, manifold_plan
      implicit none
      type(manifold_plan), intent(in) :: plan
      real(dp), intent(in) :: share, w(lanes, *), whitening(lanes, *)
      real(dp), intent(inout) :: x(lanes, 2, *)
    end subroutine expect_routine

    !> Information on the free entries of C, gradients and squares of the residuals, H and M eliminated.
    !> w, whitening   as in project_routine
    !> x              holds C, H, M and the targets; on return the information in `result`, and gradients in `normal`
    !> squares        shape (lanes, n_target)
    subroutine joint_form_routine(plan, w, whitening, x, squares)
      import :: dp, lanes, manifold_plan
      implicit none
      type(manifold_plan), intent(in) :: plan
      real(dp), intent(in) :: w(lanes, *), whitening(lanes, *)
      real(dp), intent(inout) :: x(lanes, 2, *)
      real(dp), intent(out) :: squares(lanes, plan%n_target)
    end subroutine joint_form_routine

    !> Squares s - 2 Re(d^H p) + d^H W d of a joint without cross terms, d = C - C0, and their derivatives, added up.
    !> by_rate   whether damping is given by its rates, C = a/(1 + i (eta + w tau)), or C = a/(1 + i a (h + w c))
    !> damped    whether derivatives by damping are wanted; else only those by a are added
    !> joint     a, eta or h, tau or c of each DOF, shape (3, n)
    !> squares   s, shape (lanes)
    !> x         elements of C0 (n), of p (n), and of the upper triangle of W, column by column
    !> cost      the squares, shape (lanes)
    !> descent   Re(J^H r), r = p - W d, by a, by eta and by tau of each DOF, shape (lanes, 3, n)
    !> normal    Re(J^H W J) of each entry of that triangle, u the derivative by a and v that by eta: uu, uv, w uv, vu,
    !>           w vu, vv, w vv, w^2 vv, the first for the row; shape (lanes, 8, n (n + 1)/2)
    subroutine diagonal_form_routine(n, by_rate, damped, joint, omega, squares, x, work, cost, descent, normal)
      import :: dp, lanes
      implicit none
      integer, intent(in) :: n
      logical, intent(in) :: by_rate, damped
      real(dp), intent(in) :: joint(3, n), omega(lanes), squares(lanes), x(lanes, 2, *)
      real(dp), intent(inout) :: work(lanes, 2, n, 4)
      real(dp), intent(inout) :: cost(lanes), descent(lanes, 3, n), normal(lanes, 8, (n*(n + 1))/2)
    end subroutine diagonal_form_routine

    !> Normal equations of the parameters of a joint with cross terms, added up: Re(J^H r) and Re(J^H W J), J the
    !> derivatives -f C E C of the upper triangle of C.
    !> m             pairs of DOFs, those of E: shapes of row and column, row <= column
    !> pair          the pair of each parameter, shape (n_par)
    !> x             elements of C (n n), f (n_par) and W (u u, column by column), u = n (n + 1)/2; then 2 u m of
    !>               workspace, r (u), and m (m + 1) of workspace
    !> sums          those of r, then the upper triangle of the others, column by column
    subroutine joint_normal_routine(n, m, row, column, n_par, pair, x, sums)
      import :: dp, lanes
      implicit none
      integer, intent(in) :: n, m, row(m), column(m), n_par, pair(n_par)
      real(dp), intent(inout) :: x(lanes, 2, *), sums(lanes, *)
    end subroutine joint_normal_routine
  end interface

  !> The kernels of one instruction set.
  type :: lane_kernels
    procedure(judge_routine), pointer, nopass :: judge => null()
    procedure(load_routine), pointer, nopass :: load => null()
    procedure(pick_routine), pointer, nopass :: pick => null()
    procedure(store_routine), pointer, nopass :: store => null()
    procedure(total_routine), pointer, nopass :: total => null()
    procedure(copy_routine), pointer, nopass :: copy => null()
    procedure(fill_routine), pointer, nopass :: fill => null()
    procedure(combine_routine), pointer, nopass :: combine => null()
    procedure(product_routine), pointer, nopass :: product => null()
    procedure(invert_routine), pointer, nopass :: invert => null()
    procedure(solve_routine), pointer, nopass :: solve => null()
    procedure(invert_lines_routine), pointer, nopass :: invert_lines => null()
    procedure(divide_lines_routine), pointer, nopass :: divide_lines => null()
    procedure(identify_lines_routine), pointer, nopass :: identify_lines => null()
    procedure(invert_joint_lines_routine), pointer, nopass :: invert_joint_lines => null()
    procedure(eliminate_routine), pointer, nopass :: eliminate => null()
    procedure(superpose_routine), pointer, nopass :: superpose => null()
    procedure(transform_lines_routine), pointer, nopass :: transform_lines => null()
    procedure(weigh_lines_routine), pointer, nopass :: weigh_lines => null()
    procedure(weigh_rows_routine), pointer, nopass :: weigh_rows => null()
    procedure(propagate_routine), pointer, nopass :: propagate => null()
    procedure(add_moduli_routine), pointer, nopass :: add_moduli => null()
    procedure(words_routine), pointer, nopass :: random_words => null()
    procedure(draw_routine), pointer, nopass :: normals => null()
    procedure(draw_routine), pointer, nopass :: uniforms => null()
    procedure(pollute_flat_routine), pointer, nopass :: pollute_flat => null()
    procedure(pollute_lanes_routine), pointer, nopass :: pollute_lanes => null()
    procedure(largest_routine), pointer, nopass :: largest => null()
    procedure(moments_routine), pointer, nopass :: moments => null()
    procedure(project_routine), pointer, nopass :: project => null()
    procedure(expect_routine), pointer, nopass :: expect => null()
    procedure(joint_form_routine), pointer, nopass :: joint_form => null()
    procedure(diagonal_form_routine), pointer, nopass :: diagonal_form => null()
    procedure(joint_normal_routine), pointer, nopass :: joint_normal => null()
  end type lane_kernels

  !> Where a matrix lies: entry (i, j) is element before + (i - 1)*width + j, unless the parts below say otherwise.
  type :: element_matrix
    integer :: n_rows = 0, n_columns = 0
    integer :: before = 0, width = 0
    integer :: panel = 0, panel_before = 0   !< so many first columns lie apart, row by row behind that element
    integer :: turn = 0                      !< of a square matrix: the column that is counted as the last one
    logical :: transposed = .false.          !< whether rows and columns are exchanged
  contains
    procedure :: at
    procedure :: block => block_of
    procedure :: transpose => transpose_of
  end type element_matrix

  !> The elements of a block, given out one after the other, and the lists that say where numbers lie in it. What was
  !> taken in the end is what the block needs. Where there is no memory for a list, it and those that follow are not
  !> allocated, and `no_memory` says so in the end.
  type :: element_space
    integer :: taken = 0
    logical :: no_memory = .false.
  contains
    procedure :: run
    procedure :: matrix
    procedure :: system
    procedure :: new_list
    procedure :: new_values
    procedure :: add
    procedure :: pick
    procedure :: row_starts
    procedure :: matrix_in_memory
    procedure :: blocks_in_memory
    generic :: in_memory => matrix_in_memory, blocks_in_memory
  end type element_space

contains

  !> Elimination takes two columns at a time: order of a matrix made even by one more number on the diagonal.
  pure function padded(n) result(even)
    integer, intent(in) :: n
    integer :: even

    even = n + mod(n, 2)
  end function padded

  !> Elements that a system of order n with right-hand sides takes: one more right-hand side estimates the condition,
  !> and two rows more are room for the pivot rows of a panel.
  pure function system_size(n, n_rhs) result(elements)
    integer, intent(in) :: n, n_rhs
    integer :: elements

    elements = (padded(n) + 2)*(padded(n) + merge(n_rhs + 1, 0, n_rhs > 0))
    if (n <= largest_constant .and. n_rhs == 0) elements = n**2
  end function system_size

  !> n elements in a row: the element before them.
  function run(self, n) result(before)
    class(element_space), intent(inout) :: self
    integer, intent(in) :: n
    integer :: before

    before = self%taken
    self%taken = self%taken + n
  end function run

  !> The elements of a matrix that lies row by row.
  function matrix(self, n_rows, n_columns) result(elements)
    class(element_space), intent(inout) :: self
    integer, intent(in) :: n_rows, n_columns
    type(element_matrix) :: elements

    elements%n_rows = n_rows
    elements%n_columns = n_columns
    elements%width = n_columns
    elements%before = self%run(n_rows*n_columns)
  end function matrix

  !> The elements of a system [A, B], n_rhs = 0 for a matrix that is to be inverted.
  !>
  !> The first two columns, which are eliminated next, lie apart from the others: both parts have rows of a fixed length
  !> then, which is what lets the compiler run all lanes at once. A matrix that is to be inverted lies row by row
  !> up to order `largest_constant`.
  !> before   the element before the system
  subroutine system(self, n, n_rhs, before, a, b)
    class(element_space), intent(inout) :: self
    integer, intent(in) :: n, n_rhs
    integer, intent(out) :: before
    type(element_matrix), intent(out) :: a
    type(element_matrix), intent(out), optional :: b
    integer :: even

    before = self%run(system_size(n, n_rhs))
    even = padded(n)
    a%n_rows = n
    a%n_columns = n
    if (n <= largest_constant .and. n_rhs == 0) then
      a%before = before
      a%width = n
    else
      a%panel = 2
      a%panel_before = before
      a%before = before + 2*even - 2
      a%width = even - 2 + merge(n_rhs + 1, 0, n_rhs > 0)
    end if
    if (.not. present(b)) return
    b%n_rows = n
    b%n_columns = n_rhs
    b%before = a%before + even
    b%width = a%width
  end subroutine system

  !> The element that is entry (i, j).
  pure function at(self, i, j) result(element)
    class(element_matrix), intent(in) :: self
    integer, intent(in) :: i, j
    integer :: element, row, column

    row = merge(j, i, self%transposed)
    column = merge(i, j, self%transposed)
    if (self%turn > 0) column = 1 + mod(column - 1 + self%turn, self%n_columns)
    if (column <= self%panel) then
      element = self%panel_before + (row - 1)*self%panel + column
    else
      element = self%before + (row - 1)*self%width + column
    end if
  end function at

  !> n_rows by n_columns entries that follow row i and column j of a matrix without panel.
  pure function block_of(self, i, n_rows, j, n_columns) result(part)
    class(element_matrix), intent(in) :: self
    integer, intent(in) :: i, n_rows, j, n_columns
    type(element_matrix) :: part

    part%n_rows = n_rows
    part%n_columns = n_columns
    part%width = self%width
    part%before = self%before + i*self%width + j
  end function block_of

  pure function transpose_of(self) result(other)
    class(element_matrix), intent(in) :: self
    type(element_matrix) :: other

    other%n_rows = self%n_columns
    other%n_columns = self%n_rows
    other%before = self%before
    other%width = self%width
    other%panel = self%panel
    other%panel_before = self%panel_before
    other%turn = self%turn
    other%transposed = .not. self%transposed
  end function transpose_of

  !> Memory for a list of n elements.
  subroutine new_list(self, n, list)
    class(element_space), intent(inout) :: self
    integer, intent(in) :: n
    integer, allocatable, intent(out) :: list(:)
    integer :: stat

    stat = 0
    if (.not. self%no_memory) allocate (list(n), stat=stat)
    if (stat /= 0) self%no_memory = .true.
  end subroutine new_list

  !> n zeros.
  subroutine new_values(self, n, values)
    class(element_space), intent(inout) :: self
    integer, intent(in) :: n
    complex(dp), allocatable, intent(out) :: values(:)
    integer :: stat

    stat = 0
    if (.not. self%no_memory) allocate (values(n), stat=stat)
    if (stat /= 0) self%no_memory = .true.
    if (.not. self%no_memory) values = 0
  end subroutine new_values

  !> Add the elements of a matrix column by column to a list of which `used` items are used.
  !> rows, columns   which, all where they are not given
  subroutine add(self, matrix, list, used, rows, columns)
    class(element_space), intent(in) :: self
    type(element_matrix), intent(in) :: matrix
    integer, allocatable, intent(inout) :: list(:)
    integer, intent(inout) :: used
    integer(ip), intent(in), optional :: rows(:), columns(:)
    integer :: i, j, column, first, step, n_rows, n_columns

    if (self%no_memory) return
    n_rows = matrix%n_rows
    n_columns = matrix%n_columns
    if (present(rows)) n_rows = size(rows)
    if (present(columns)) n_columns = size(columns)
    do j = 1, n_columns
      column = j
      if (present(columns)) column = int(columns(j))
      if (present(rows)) then
        do i = 1, n_rows
          list(used + i) = matrix%at(int(rows(i)), column)
        end do
      else if (matrix%turn > 0) then
        do i = 1, n_rows
          list(used + i) = matrix%at(i, column)
        end do
      else if (matrix%transposed) then
        do i = 1, n_rows
          list(used + i) = matrix%before + (column - 1)*matrix%width + i
        end do
        do i = 1, min(matrix%panel, n_rows)
          list(used + i) = matrix%at(i, column)
        end do
      else
        first = matrix%at(1, column)
        step = merge(matrix%panel, matrix%width, column <= matrix%panel)
        do i = 1, n_rows
          list(used + i) = first + (i - 1)*step
        end do
      end if
      used = used + n_rows
    end do
  end subroutine add

  !> The elements of a matrix column by column.
  subroutine pick(self, matrix, list, rows, columns)
    class(element_space), intent(inout) :: self
    type(element_matrix), intent(in) :: matrix
    integer, allocatable, intent(out) :: list(:)
    integer(ip), intent(in), optional :: rows(:), columns(:)
    integer :: n_rows, n_columns, used

    n_rows = matrix%n_rows
    n_columns = matrix%n_columns
    if (present(rows)) n_rows = size(rows)
    if (present(columns)) n_columns = size(columns)
    call self%new_list(n_rows*n_columns, list)
    used = 0
    call self%add(matrix, list, used, rows, columns)
  end subroutine pick

  !> The elements of a matrix in the order in which the caller stores it.
  subroutine matrix_in_memory(self, transposed, matrix, list)
    class(element_space), intent(inout) :: self
    logical, intent(in) :: transposed
    type(element_matrix), intent(in) :: matrix
    integer, allocatable, intent(out) :: list(:)

    if (transposed) then
      call self%pick(matrix%transpose(), list)
    else
      call self%pick(matrix, list)
    end if
  end subroutine matrix_in_memory

  !> The same of a matrix that consists of four square blocks of one size.
  subroutine blocks_in_memory(self, transposed, a11, a12, a21, a22, list)
    class(element_space), intent(inout) :: self
    logical, intent(in) :: transposed
    type(element_matrix), intent(in) :: a11, a12, a21, a22
    integer, allocatable, intent(out) :: list(:)
    integer :: n

    n = a11%n_rows
    call self%new_list(4*n*n, list)
    if (self%no_memory) return
    call put(a11, 0, 0)
    call put(a21, n, 0)
    call put(a12, 0, n)
    call put(a22, n, n)

  contains

    !> A block that follows so many rows and columns.
    subroutine put(a, row, column)
      type(element_matrix), intent(in) :: a
      integer, intent(in) :: row, column
      integer :: i, j

      do j = 1, n
        do i = 1, n
          if (transposed) then
            list((row + i - 1)*2*n + column + j) = a%at(i, j)
          else
            list((column + j - 1)*2*n + row + i) = a%at(i, j)
          end if
        end do
      end do
    end subroutine put
  end subroutine blocks_in_memory

  !> The element before each row of a matrix whose rows lie in one piece.
  subroutine row_starts(self, matrix, list)
    class(element_space), intent(inout) :: self
    type(element_matrix), intent(in) :: matrix
    integer, allocatable, intent(out) :: list(:)
    integer :: i

    call self%new_list(matrix%n_rows, list)
    if (self%no_memory) return
    do i = 1, matrix%n_rows
      list(i) = matrix%at(i, 1) - 1
    end do
  end subroutine row_starts

  !> The elements of a matrix with n_columns columns in the caller's order, from the element before each of its rows.
  pure subroutine rows_in_memory(transposed, before, n_columns, list)
    logical, intent(in) :: transposed
    integer, intent(in) :: before(:), n_columns
    integer, intent(out) :: list(:)
    integer :: i, j

    do i = 1, size(before)
      do j = 1, n_columns
        if (transposed) then
          list((i - 1)*n_columns + j) = before(i) + j
        else
          list((j - 1)*size(before) + i) = before(i) + j
        end if
      end do
    end do
  end subroutine rows_in_memory

  !> The entries of each row of a matrix that are not zero, times a factor.
  !> by_columns   of each column instead, as rows of the transpose
  subroutine find_rows(factor, t, by_columns, rows, stat)
    real(dp), intent(in) :: factor, t(:, :)
    logical, intent(in) :: by_columns
    type(sparse_rows), intent(out) :: rows
    integer, intent(out) :: stat
    integer :: i, j, k, n_columns
    real(dp) :: weight

    rows%n = size(t, merge(2, 1, by_columns))
    n_columns = size(t, merge(1, 2, by_columns))
    k = count(has_weight(t))
    allocate (rows%start(rows%n + 1), rows%from(k), rows%weight(k), stat=stat)
    if (stat /= 0) return
    k = 1
    do j = 1, rows%n
      rows%start(j) = k
      do i = 1, n_columns
        if (by_columns) then
          weight = t(i, j)
        else
          weight = t(j, i)
        end if
        if (.not. has_weight(weight)) cycle
        rows%from(k) = i
        rows%weight(k) = factor*weight
        k = k + 1
      end do
    end do
    rows%start(rows%n + 1) = k
    do i = 1, n_columns
      if (by_columns) then
        rows%unused = rows%unused .or. .not. any(has_weight(t(i, :)))
      else
        rows%unused = rows%unused .or. .not. any(has_weight(t(:, i)))
      end if
    end do
  end subroutine find_rows

  !> Whether a weight is not zero; NaN is not.
  elemental function has_weight(weight) result(yes)
    real(dp), intent(in) :: weight
    logical :: yes

    yes = .not. abs(weight) <= 0.0_dp
  end function has_weight

  !> The smaller of two reciprocal condition numbers; not finite where one of them is not, which MIN may forget.
  elemental function worse_of(a, b) result(rcond)
    real(dp), intent(in) :: a, b
    real(dp) :: rcond

    rcond = min(a, b) + 0*(a + b)
  end function worse_of

  !> Numbers from an address to where a register begins, so that none is read across two cache lines.
  function to_register(address) result(skip)
    type(c_ptr), intent(in) :: address
    integer :: skip

    skip = int(modulo(-transfer(address, 1_c_intptr_t)/8, int(lanes, c_intptr_t)))
  end function to_register

  !> The caller's lines as pairs of real numbers.
  function real_lines(lines) result(pairs)
    complex(dp), contiguous, target, intent(in) :: lines(:, :, :)
    real(dp), pointer, contiguous :: pairs(:, :, :)

    call c_f_pointer(c_loc(lines), pairs, [2, size(lines, 1)*size(lines, 2), size(lines, 3)])
  end function real_lines
end module jointfrf_lanes
