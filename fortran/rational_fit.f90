!> Rational functions with common poles through several FRFs: one weighted least-squares fit, and better poles.
!>
!> c_0 + sum c_k/(s - p_k) with complex residues. Only poles of positive frequencies are meant; their mirror images, far
!> from the lines, are left to poles of their own, so structural damping, which has none, is met exactly, too.
!> All is done in functions psi that are orthonormal under the mean weight of the entries: [1, 1/(s - p_k)] = psi R.
!> What costs time is the sums over the lines of w conj(psi_i) psi_j, for all entries and pairs at once: one product of
!> real matrices, in pieces that stay in the cache.
module jointfrf_rational_fit
  use, intrinsic :: iso_c_binding, only: c_size_t
  use jointfrf_blas_threads, only: hold_blas_threads, release_blas_threads
  use jointfrf_kinds, only: blas_ip, dp, ip, long
  use jointfrf_lapack, only: dgemm, zgeev, zgemm, zgemv, zgesv
  use jointfrf_line_layout, only: all_finite
  use jointfrf_sharing, only: share, shared_work, threads_for
  use jointfrf_status, only: info_good, info_no_memory
  use jointfrf_traps, only: hold_all_traps, host_state, release_all_traps
  implicit none
  private
  public :: rational_fit, relocate_poles
  public :: fit_entries, least_damping, leave_lines_out, load_entries, prepare_space, relocate

  !> Their pairs are counted by default integers, with room to spare.
  integer, parameter, public :: most_poles = 10000
  !> Lines, and pairs of functions, of one piece of the sums.
  integer, parameter :: piece_lines = 256, piece_pairs = 16
  !> Below this many floating-point operations, a millisecond or two of matrix products, one thread does the work.
  real(dp), parameter :: serial_flops_products = 2.0e7_dp
  !> Added to the diagonal of normal equations, relative to it.
  real(dp), parameter :: rounding = 1.0e-15_dp
  !> Poles nearer to the frequency axis than this part of the distance of lines are moved away from it.
  real(dp), parameter :: nearest = 1.0e-3_dp

  !> Sums over the lines of weights times products of functions; an item is a piece of the pairs of functions.
  type, extends(shared_work) :: pair_sums
    integer :: n, n_pairs, n_sums
    integer, allocatable :: first(:), second(:)                !< functions of a pair, first <= second
    real(dp), allocatable :: weights(:, :)                     !< (n_freq, most sums)
    real(dp), allocatable :: re(:, :), im(:, :)                !< psi, (n_freq, n)
    real(dp), pointer, contiguous :: products(:, :, :) => null()   !< (piece_lines, 2 piece_pairs, threads)
    real(dp), pointer, contiguous :: sums(:, :, :) => null()   !< (most sums, 2, n_pairs): of Re, of Im
    real(dp), allocatable :: own_products(:, :, :), own_sums(:, :, :)   !< where they lie
  contains
    procedure :: do_items => sum_pairs
  end type pair_sums

  !> What the numerator of each entry takes off the quadratic form of sigma; an item is an entry.
  type, extends(shared_work) :: elimination
    integer :: n, n_entries, threads
    type(pair_sums), pointer :: gram => null()
    complex(dp), pointer, contiguous :: forms(:, :, :) => null()   !< (n, n, n_entries)
    complex(dp), pointer, contiguous :: work(:, :, :, :) => null() !< (n, n, 3, threads)
    integer(blas_ip), pointer, contiguous :: pivot(:, :) => null() !< (n, threads)
    integer, pointer, contiguous :: failed(:) => null()        !< (n_entries), 0 good
  contains
    procedure :: do_items => eliminate_numerators
  end type elimination

  !> psi and R, what finding them takes, and the root of the mean weight.
  type :: orthonormal_basis
    complex(dp), allocatable :: psi(:, :), numbers(:)
    complex(dp), pointer, contiguous :: triangle(:, :) => null(), back(:, :) => null()     !< R and its inverse
    real(dp), allocatable :: mean_weight(:), per_weight(:)                                 !< and its reciprocal
  end type orthonormal_basis

  !> Entries with their weights, and the memory in which they are fitted with any number of poles up to one that is
  !> chosen when it is prepared. Whoever has one gives it TARGET.
  type, public :: rational_space
    private
    type(pair_sums) :: gram
    type(elimination) :: entries
    type(orthonormal_basis) :: basis
    !> Quadratic form of sigma, its coefficients, the matrix whose eigenvalues are its zeros.
    complex(dp), pointer, contiguous :: form(:, :) => null(), sigma(:, :) => null(), found(:, :) => null()
    complex(dp), pointer, contiguous :: matrix(:, :) => null()
    complex(dp), pointer, contiguous :: coefficients(:, :) => null(), pull(:, :) => null()   !< of the entries, (n, m)
    complex(dp), allocatable :: moved(:), pulled(:, :), work(:), memory(:)
    real(dp), allocatable :: real_work(:)
    integer(blas_ip), allocatable :: pivot(:, :)
    integer, allocatable :: failed(:)
    logical, allocatable :: good(:)
    !> Whether basis and sums are those of the poles of the last relocation.
    logical :: is_current = .false.
  end type rational_space

contains

  !> Better poles: relaxed vector fitting, until the sum of squares of the fit stays.
  !>
  !> sigma and numerators q_e of the form c_0 + sum c_k/(s - p_k) minimise sum_e |w_e (q_e - sigma h_e)|^2 with the mean
  !> of sigma held; the zeros of sigma are the new poles. Noise adds its own Gram matrix to this form, so holding the
  !> mean leaves the poles where they are once they are right. B. Gustavsen, IEEE Trans. Power Del. 14, 21.
  !> iterations  most relocations
  !> still       relative change of the sum of squares at which they end
  !> s           i times the frequency of each line, in any unit, shape (n_freq)
  !> h           FRFs, shape (n_freq, n_entries)
  !> weight      1/sqrt(E|e|^2) up to one factor, shape (n_freq, n_entries)
  !> poles       in: first poles; out: those of the least sum of squares, stable, shape (n_poles)
  !> squares     that sum
  !> info        > 0 so many entries have singular equations; poles are then the last that had not
  subroutine relocate_poles(iterations, still, s, h, weight, poles, squares, info)
    integer, intent(in) :: iterations
    real(dp), intent(in) :: still
    complex(dp), contiguous, intent(in) :: s(:), h(:, :)
    real(dp), contiguous, intent(in) :: weight(:, :)
    complex(dp), contiguous, intent(inout) :: poles(:)
    real(dp), intent(out) :: squares
    integer(ip), intent(out) :: info
    type(rational_space), target :: space
    integer :: stat

    info = info_good
    if (size(h) == 0) then
      squares = 0.0_dp
      return
    end if
    call prepare_space(size(poles), size(h, 2), size(s), space, stat)
    if (stat /= 0) then
      info = info_no_memory
      return
    end if
    call load_entries(h, weight, space)
    call relocate(iterations, still, s, space, poles, squares, info)
  end subroutine relocate_poles

  !> Least-squares fit with given poles: normal equations in psi, corrected once by their residual.
  !> s, h, weight, poles   as in relocate_poles
  !> smooth      the fit, shape (n_freq, n_entries)
  !> squares     weighted sum of squares of h - smooth
  !> loss        by how much it would grow without a pole, the others staying where they are, shape (n_poles)
  !> info        > 0 so many entries have singular equations, and smooth is 0 there
  subroutine rational_fit(s, h, weight, poles, smooth, squares, loss, info)
    complex(dp), contiguous, intent(in) :: s(:), h(:, :), poles(:)
    real(dp), contiguous, intent(in) :: weight(:, :)
    complex(dp), contiguous, intent(out) :: smooth(:, :)
    real(dp), intent(out) :: squares, loss(:)
    integer(ip), intent(out) :: info
    type(rational_space), target :: space
    integer :: stat

    info = info_good
    stat = 0
    if (size(h) > 0) call prepare_space(size(poles), size(h, 2), size(s), space, stat)
    if (stat /= 0) then
      info = info_no_memory
      return
    end if
    smooth = 0.0_dp
    squares = 0.0_dp
    loss = 0.0_dp
    if (size(h) == 0) return
    call load_entries(h, weight, space)
    call fit_entries(s, h, poles, space, smooth, squares, loss, info)
  end subroutine rational_fit

  !> `relocate_poles` of the entries in a space; a fit with the poles found may follow at half the work.
  subroutine relocate(iterations, still, s, space, poles, squares, info)
    integer, intent(in) :: iterations
    real(dp), intent(in) :: still
    complex(dp), contiguous, intent(in) :: s(:)
    type(rational_space), target, intent(inout) :: space
    complex(dp), contiguous, intent(inout) :: poles(:)
    real(dp), intent(out) :: squares
    integer(ip), intent(out) :: info
    real(dp) :: before, now
    integer :: n, k

    n = size(poles)
    call set_order(n + 1, space)
    squares = huge(squares)
    before = huge(before)
    space%moved(:n) = poles
    call hold_blas_threads()
    do k = 0, iterations
      space%is_current = .false.
      call make_basis(s, space%moved(:n), space%basis)
      call form_of_sigma(space%basis, space%gram, space%entries, space%form, info)
      if (info /= info_good) exit
      call multiply('N', space%form, space%basis%triangle(:, 1:1), space%found)
      now = max(real(dot_product(space%basis%triangle(:, 1), space%found(:, 1)), dp), 0.0_dp)
      if (now < squares) then
        squares = now
        poles = space%moved(:n)
        space%is_current = .true.
      end if
      if (abs(before - now) <= still*now .or. k == iterations) exit
      before = now
      call zeros_of_sigma(s, space, space%moved(:n), info)
      if (info /= info_good) exit
    end do
    call release_blas_threads()
  end subroutine relocate

  !> `rational_fit` of the entries in a space.
  subroutine fit_entries(s, h, poles, space, smooth, squares, loss, info)
    complex(dp), contiguous, intent(in) :: s(:), h(:, :), poles(:)
    type(rational_space), target, intent(inout) :: space
    complex(dp), contiguous, intent(out) :: smooth(:, :)
    real(dp), intent(out) :: squares, loss(:)
    integer(ip), intent(out) :: info
    integer :: e, turn, m

    m = size(h, 2)
    smooth = 0.0_dp
    squares = 0.0_dp
    loss = 0.0_dp
    call hold_blas_threads()
    if (.not. space%is_current) then
      call set_order(size(poles) + 1, space)
      call make_basis(s, poles, space%basis)
      call sum_all(space%basis, m, space%gram)
    end if
    space%is_current = .false.
    call invert_triangle(space%basis%triangle, space%basis%back)
    associate (inverse => space%entries%forms, work => space%entries%work(:, :, 1, 1), good => space%good, &
               coefficients => space%coefficients, weights => space%gram%weights)
      do e = 1, m
        call invert_gram(space%gram, e, work, space%pivot(:, 1), inverse(:, :, e), good(e))
      end do
      coefficients = 0.0_dp
      do turn = 1, 2
        space%pulled(:, :) = weights(:, :m)*(h - smooth)
        call multiply('C', space%basis%psi(:, :space%gram%n), space%pulled, space%pull)
        do e = 1, m
          if (.not. good(e)) cycle
          call multiply('N', inverse(:, :, e), space%pull(:, e:e), space%found)
          coefficients(:, e) = coefficients(:, e) + space%found(:, 1)
        end do
        call multiply('N', space%basis%psi(:, :space%gram%n), coefficients, smooth)
      end do
      do e = 1, m
        if (good(e)) call add_loss(space%basis%back, inverse(:, :, e), coefficients(:, e), work, loss)
        squares = squares + sum(weights(:, e)*(real(h(:, e) - smooth(:, e))**2 + aimag(h(:, e) - smooth(:, e))**2))
      end do
      info = count(.not. good, kind=ip)
    end associate
    call release_blas_threads()
  end subroutine fit_entries

  !> Inverse of the Gram matrix of an entry.
  !> normal, pivot   workspace
  subroutine invert_gram(gram, entry, normal, pivot, inverse, good)
    type(pair_sums), intent(in) :: gram
    integer, intent(in) :: entry
    complex(dp), contiguous, intent(out) :: normal(:, :), inverse(:, :)
    integer(blas_ip), contiguous, intent(out) :: pivot(:)
    logical, intent(out) :: good
    integer(blas_ip) :: n, stat
    integer :: j

    call own_gram(gram, entry, normal)
    inverse = 0.0_dp
    do j = 1, gram%n
      inverse(j, j) = 1.0_dp
    end do
    n = int(gram%n, blas_ip)
    call zgesv(n, n, normal, n, pivot, inverse, n, stat)
    good = stat == 0
  end subroutine invert_gram

  !> What each pole takes off the sum of squares of an entry: |residue|^2 over its variance.
  !> right   workspace: the inverse times B^H
  subroutine add_loss(back, inverse, coefficients, right, loss)
    complex(dp), contiguous, intent(in) :: back(:, :), inverse(:, :), coefficients(:)
    complex(dp), contiguous, intent(out) :: right(:, :)
    real(dp), intent(inout) :: loss(:)
    complex(dp) :: residue
    integer(blas_ip) :: n
    integer :: j

    n = size(back, 1, kind=blas_ip)
    call zgemm('N', 'C', n, n, n, (1.0_dp, 0.0_dp), inverse, n, back, n, (0.0_dp, 0.0_dp), right, n, 1_c_size_t, &
               1_c_size_t)
    do j = 2, size(back, 1)
      residue = sum(back(j, :)*coefficients)
      loss(j - 1) = loss(j - 1) + abs(residue)**2/real(sum(back(j, :)*right(:, j)), dp)
    end do
  end subroutine add_loss

  !> Y = A X or A^H X.
  subroutine multiply(operation, a, x, y)
    character, intent(in) :: operation
    complex(dp), contiguous, intent(in) :: a(:, :), x(:, :)
    complex(dp), contiguous, intent(out) :: y(:, :)
    integer(blas_ip) :: rows

    rows = size(a, 1, kind=blas_ip)
    call zgemm(operation, 'N', size(y, 1, kind=blas_ip), size(y, 2, kind=blas_ip), size(x, 1, kind=blas_ip), &
               (1.0_dp, 0.0_dp), a, rows, x, size(x, 1, kind=blas_ip), (0.0_dp, 0.0_dp), y, &
               size(y, 1, kind=blas_ip), 1_c_size_t, 1_c_size_t)
  end subroutine multiply

  !> Take memory for fits of so many entries on so many lines with `most` poles or fewer.
  subroutine prepare_space(most, n_entries, n_freq, space, stat)
    integer, intent(in) :: most, n_entries, n_freq
    type(rational_space), target, intent(inout) :: space
    integer, intent(out) :: stat
    integer :: n, n_sums, n_pairs, i, j, pair
    integer(long) :: length

    n = most + 1
    n_sums = 3*n_entries + 1
    n_pairs = n*(n + 1)/2
    length = int(n, long)*n*(n_entries + 5_long + 3*elimination_threads(n, n_entries)) + 2_long*n*(n_entries + 1)
    associate (gram => space%gram)
      allocate (gram%first(n_pairs), gram%second(n_pairs), gram%weights(n_freq, n_sums), gram%re(n_freq, n), &
                gram%im(n_freq, n), gram%own_sums(n_sums, 2, n_pairs), &
                gram%own_products(piece_lines, 2*piece_pairs, sum_threads(n_sums, n_pairs, n_freq)), &
                space%basis%psi(n_freq, n), space%basis%numbers(n), space%basis%mean_weight(n_freq), &
                space%basis%per_weight(n_freq), space%memory(length), space%moved(most), &
                space%pulled(n_freq, n_entries), space%work(4*n), space%real_work(2*n), &
                space%pivot(n, elimination_threads(n, n_entries)), space%failed(n_entries), space%good(n_entries), &
                stat=stat)
      if (stat /= 0) return
      gram%sums => gram%own_sums
      gram%products => gram%own_products
      pair = 0
      do j = 1, n
        do i = 1, j
          pair = pair + 1
          gram%first(pair) = i
          gram%second(pair) = j
        end do
      end do
    end associate
    space%entries%gram => space%gram
    space%entries%n_entries = n_entries
    space%entries%failed => space%failed
  end subroutine prepare_space

  !> Weights of entries for the fits that follow.
  !> h, weight   as in relocate_poles
  subroutine load_entries(h, weight, space)
    complex(dp), contiguous, intent(in) :: h(:, :)
    real(dp), contiguous, intent(in) :: weight(:, :)
    type(rational_space), intent(inout) :: space
    integer :: e

    call set_weights(h, weight, space%gram%weights)
    space%basis%mean_weight(:) = 0.0_dp
    do e = 1, size(h, 2)
      space%basis%mean_weight(:) = space%basis%mean_weight + space%gram%weights(:, e)
    end do
    space%basis%mean_weight(:) = sqrt(space%basis%mean_weight/size(h, 2))
    space%basis%per_weight(:) = 1/space%basis%mean_weight
    space%is_current = .false.
  end subroutine load_entries

  !> Multiply the weight of chosen lines, of entries that were loaded, by a factor.
  subroutine leave_lines_out(chosen, factor, space)
    logical, intent(in) :: chosen(:)
    real(dp), intent(in) :: factor
    type(rational_space), intent(inout) :: space
    integer :: line

    do line = 1, size(chosen)
      if (.not. chosen(line)) cycle
      space%gram%weights(line, :) = space%gram%weights(line, :)*factor**2
      space%basis%mean_weight(line) = space%basis%mean_weight(line)*factor
      space%basis%per_weight(line) = 1/space%basis%mean_weight(line)
    end do
    space%is_current = .false.
  end subroutine leave_lines_out

  !> Place the matrices of a fit with n functions in the memory.
  subroutine set_order(n, space)
    integer, intent(in) :: n
    type(rational_space), target, intent(inout) :: space
    integer(long) :: used, square
    integer :: m, threads

    m = space%entries%n_entries
    threads = elimination_threads(n, m)
    square = int(n, long)*n
    space%gram%n = n
    space%gram%n_pairs = n*(n + 1)/2
    space%entries%n = n
    space%entries%threads = threads
    used = 0
    space%entries%forms(1:n, 1:n, 1:m) => space%memory(used + 1:used + square*m)
    used = used + square*m
    space%entries%work(1:n, 1:n, 1:3, 1:threads) => space%memory(used + 1:used + 3*square*threads)
    used = used + 3*square*threads
    space%entries%pivot => space%pivot
    call view(space%memory, n, n, used, space%basis%triangle)
    call view(space%memory, n, n, used, space%basis%back)
    call view(space%memory, n, n, used, space%form)
    call view(space%memory, n - 1, n - 1, used, space%matrix)
    call view(space%memory, n, m, used, space%coefficients)
    call view(space%memory, n, m, used, space%pull)
    call view(space%memory, n, 1, used, space%sigma)
    call view(space%memory, n, 1, used, space%found)
  end subroutine set_order

  !> The next matrix in a memory.
  subroutine view(memory, rows, columns, used, matrix)
    complex(dp), contiguous, target, intent(in) :: memory(:)
    integer, intent(in) :: rows, columns
    integer(long), intent(inout) :: used
    complex(dp), pointer, contiguous, intent(out) :: matrix(:, :)
    integer(long) :: length

    length = int(rows, long)*columns
    matrix(1:rows, 1:columns) => memory(used + 1:used + length)
    used = used + length
  end subroutine view

  function elimination_threads(n, n_entries) result(threads)
    integer, intent(in) :: n, n_entries
    integer :: threads

    threads = threads_for(24.0_dp*n_entries*real(n, dp)**3, int(n_entries, long), serial_flops_products)
  end function elimination_threads

  function sum_threads(n_sums, n_pairs, n_freq) result(threads)
    integer, intent(in) :: n_sums, n_pairs, n_freq
    integer :: threads

    threads = threads_for(4.0_dp*n_sums*n_pairs*n_freq, int((n_pairs - 1)/piece_pairs + 1, long), serial_flops_products)
  end function sum_threads

  !> w^2 of each entry, the sum of w^2 |h|^2 of all, w^2 Re h and w^2 Im h of each.
  pure subroutine set_weights(h, weight, weights)
    complex(dp), intent(in) :: h(:, :)
    real(dp), intent(in) :: weight(:, :)
    real(dp), intent(out) :: weights(:, :)
    integer :: m, e

    m = size(h, 2)
    weights(:, :m) = weight**2
    weights(:, m + 1) = 0.0_dp
    do e = 1, m
      weights(:, m + 1) = weights(:, m + 1) + weights(:, e)*(real(h(:, e))**2 + aimag(h(:, e))**2)
    end do
    weights(:, m + 2:2*m + 1) = weights(:, :m)*real(h)
    weights(:, 2*m + 2:) = weights(:, :m)*aimag(h)
  end subroutine set_weights

  !> [1, 1/(s - p)] made orthonormal under the mean weight, by Gram and Schmidt, twice.
  subroutine make_basis(s, poles, basis)
    complex(dp), contiguous, intent(in) :: s(:), poles(:)
    type(orthonormal_basis), intent(inout) :: basis
    complex(dp) :: distance
    real(dp) :: length
    integer :: j, line, n, turn

    n = size(poles) + 1
    associate (psi => basis%psi, triangle => basis%triangle, numbers => basis%numbers, mean_weight => basis%mean_weight)
      triangle = 0.0_dp
      psi(:, 1) = mean_weight
      do j = 1, size(poles)
        do line = 1, size(s)
          distance = s(line) - poles(j)
          psi(line, j + 1) = conjg(distance)*(mean_weight(line)/(real(distance)**2 + aimag(distance)**2))
        end do
      end do
      do j = 1, n
        do turn = 1, merge(0, 2, j == 1)
          call project(psi(:, :j - 1), psi(:, j), numbers(:j - 1))
          call take_off(psi(:, :j - 1), numbers(:j - 1), psi(:, j))
          triangle(:j - 1, j) = triangle(:j - 1, j) + numbers(:j - 1)
        end do
        length = sqrt(sum(real(psi(:, j))**2 + aimag(psi(:, j))**2))
        triangle(j, j) = length
        if (length > 0.0_dp) psi(:, j) = psi(:, j)/length
      end do
      do j = 1, n
        psi(:, j) = psi(:, j)*basis%per_weight
      end do
    end associate
  end subroutine make_basis

  !> x = A^H y.
  subroutine project(a, y, x)
    complex(dp), contiguous, intent(in) :: a(:, :), y(:)
    complex(dp), contiguous, intent(out) :: x(:)
    integer(blas_ip) :: rows

    rows = size(y, kind=blas_ip)
    call zgemv('C', rows, size(x, kind=blas_ip), (1.0_dp, 0.0_dp), a, rows, y, 1_blas_ip, (0.0_dp, 0.0_dp), x, &
               1_blas_ip, 1_c_size_t)
  end subroutine project

  !> y = y - A x.
  subroutine take_off(a, x, y)
    complex(dp), contiguous, intent(in) :: a(:, :), x(:)
    complex(dp), contiguous, intent(inout) :: y(:)
    integer(blas_ip) :: rows

    rows = size(y, kind=blas_ip)
    call zgemv('N', rows, size(x, kind=blas_ip), (-1.0_dp, 0.0_dp), a, rows, x, 1_blas_ip, (1.0_dp, 0.0_dp), y, &
               1_blas_ip, 1_c_size_t)
  end subroutine take_off

  !> Inverse of an upper triangle; a zero on the diagonal gives a row of zeros.
  pure subroutine invert_triangle(triangle, inverse)
    complex(dp), intent(in) :: triangle(:, :)
    complex(dp), intent(out) :: inverse(:, :)
    integer :: i, j

    inverse = 0.0_dp
    do j = 1, size(triangle, 1)
      if (abs(triangle(j, j)) > 0.0_dp) inverse(j, j) = 1.0_dp/triangle(j, j)
      do i = j - 1, 1, -1
        if (abs(triangle(i, i)) > 0.0_dp) &
          inverse(i, j) = -sum(triangle(i, i + 1:j)*inverse(i + 1:j, j))/triangle(i, i)
      end do
    end do
  end subroutine invert_triangle

  !> Sums with the first n_sums weights.
  subroutine sum_all(basis, n_sums, gram)
    type(orthonormal_basis), intent(in) :: basis
    integer, intent(in) :: n_sums
    type(pair_sums), intent(inout) :: gram
    integer :: threads

    gram%n_sums = n_sums
    gram%re(:, :gram%n) = real(basis%psi(:, :gram%n))
    gram%im(:, :gram%n) = aimag(basis%psi(:, :gram%n))
    threads = min(sum_threads(n_sums, gram%n_pairs, size(gram%re, 1)), size(gram%products, 3))
    call share(gram, int((gram%n_pairs - 1)/piece_pairs + 1, long), threads, even=.true.)
  end subroutine sum_all

  subroutine sum_pairs(self, first, last, thread)
    class(pair_sums), intent(in) :: self
    integer(long), intent(in) :: first, last
    integer, intent(in) :: thread
    integer(long) :: item
    integer :: line, lines, pair, pairs, k, i, j
    real(dp) :: beta

    do item = first, last
      pair = int(item - 1)*piece_pairs
      pairs = min(piece_pairs, self%n_pairs - pair)
      do line = 1, size(self%re, 1), piece_lines
        lines = min(piece_lines, size(self%re, 1) - line + 1)
        do k = 1, pairs
          i = self%first(pair + k)
          j = self%second(pair + k)
          associate (ar => self%re(line:line + lines - 1, i), ai => self%im(line:line + lines - 1, i), &
                     br => self%re(line:line + lines - 1, j), bi => self%im(line:line + lines - 1, j))
            self%products(:lines, 2*k - 1, thread) = ar*br + ai*bi
            self%products(:lines, 2*k, thread) = ar*bi - ai*br
          end associate
        end do
        beta = merge(0.0_dp, 1.0_dp, line == 1)
        call dgemm('T', 'N', int(self%n_sums, blas_ip), int(2*pairs, blas_ip), int(lines, blas_ip), 1.0_dp, &
                   self%weights(line, 1), size(self%weights, 1, kind=blas_ip), self%products(:, :, thread), &
                   int(piece_lines, blas_ip), beta, self%sums(:, :, pair + 1:), size(self%sums, 1, kind=blas_ip), &
                   1_c_size_t, 1_c_size_t)
      end do
    end do
  end subroutine sum_pairs

  !> Sum over the lines of w^2 conj(psi_i) psi_j of an entry.
  pure subroutine own_gram(gram, entry, matrix)
    type(pair_sums), intent(in) :: gram
    integer, intent(in) :: entry
    complex(dp), intent(out) :: matrix(:, :)
    integer :: k

    do k = 1, gram%n_pairs
      associate (i => gram%first(k), j => gram%second(k))
        matrix(i, j) = cmplx(gram%sums(entry, 1, k), gram%sums(entry, 2, k), dp)
        matrix(j, i) = conjg(matrix(i, j))
        if (i == j) matrix(i, i) = real(matrix(i, i), dp)*(1.0_dp + rounding)
      end associate
    end do
  end subroutine own_gram

  !> Sum of squares as a quadratic form of the coefficients of sigma, the numerators eliminated.
  subroutine form_of_sigma(basis, gram, entries, form, info)
    type(orthonormal_basis), intent(in) :: basis
    type(pair_sums), intent(inout) :: gram
    type(elimination), intent(in) :: entries
    complex(dp), contiguous, intent(out) :: form(:, :)
    integer(ip), intent(out) :: info
    integer :: e, i, j, k

    call sum_all(basis, size(gram%weights, 2), gram)
    call share(entries, int(entries%n_entries, long), entries%threads, even=.true.)
    info = count(entries%failed /= 0, kind=ip)
    form = 0.0_dp
    do e = 1, entries%n_entries
      form = form + entries%forms(:, :, e)
    end do
    do k = 1, gram%n_pairs                                    ! and w^2 |h|^2 of all entries
      associate (right => gram%sums(entries%n_entries + 1, :, k))
        form(gram%first(k), gram%second(k)) = form(gram%first(k), gram%second(k)) + cmplx(right(1), right(2), dp)
        if (gram%first(k) /= gram%second(k)) &
          form(gram%second(k), gram%first(k)) = form(gram%second(k), gram%first(k)) + cmplx(right(1), -right(2), dp)
      end associate
    end do
    do j = 1, size(form, 2)                                   ! Hermitian but for rounding
      do i = 1, j
        form(i, j) = (form(i, j) + conjg(form(j, i)))/2
        form(j, i) = conjg(form(i, j))
      end do
    end do
    if (.not. all_finite(form)) info = max(info, 1_ip)
  end subroutine form_of_sigma

  subroutine eliminate_numerators(self, first, last, thread)
    class(elimination), intent(in) :: self
    integer(long), intent(in) :: first, last
    integer, intent(in) :: thread
    integer(blas_ip) :: n, stat
    integer :: e, k, m

    n = int(self%n, blas_ip)
    m = self%n_entries
    do e = int(first), int(last)
      associate (form => self%forms(:, :, e), sums => self%gram%sums, pivot => self%pivot(:, thread), &
                 own => self%work(:, :, 1, thread), mixed => self%work(:, :, 2, thread), &
                 solved => self%work(:, :, 3, thread))
        call own_gram(self%gram, e, own)
        do k = 1, self%gram%n_pairs
          associate (i => self%gram%first(k), j => self%gram%second(k), &
                     re => sums(m + 1 + e, :, k), im => sums(2*m + 1 + e, :, k))    ! w^2 Re h, w^2 Im h
            mixed(i, j) = cmplx(re(1) - im(2), re(2) + im(1), dp)
            mixed(j, i) = cmplx(re(1) + im(2), im(1) - re(2), dp)
          end associate
        end do
        solved = mixed
        call zgesv(n, n, own, n, pivot, solved, n, stat)
        self%failed(e) = int(stat)
        if (stat /= 0) then
          form = 0.0_dp
          cycle
        end if
        call zgemm('C', 'N', n, n, n, (-1.0_dp, 0.0_dp), mixed, n, solved, n, (0.0_dp, 0.0_dp), form, n, 1_c_size_t, &
                   1_c_size_t)
      end associate
    end do
  end subroutine eliminate_numerators

  !> Zeros of the sigma that minimises its form, its mean held.
  subroutine zeros_of_sigma(s, space, poles, info)
    complex(dp), contiguous, intent(in) :: s(:)
    type(rational_space), intent(inout) :: space
    complex(dp), contiguous, intent(inout) :: poles(:)
    integer(ip), intent(out) :: info
    type(host_state) :: host
    complex(dp) :: no_left(1), no_right(1)
    real(dp) :: trace
    integer(blas_ip) :: n, m, stat
    integer :: k

    info = info_good
    n = size(space%form, 1, kind=blas_ip)
    m = n - 1_blas_ip
    trace = 0.0_dp
    do k = 1, size(space%form, 1)
      trace = trace + real(space%form(k, k), dp)
    end do
    associate (form => space%form, sigma => space%found, matrix => space%matrix)
      do k = 1, size(form, 1)
        form(k, k) = form(k, k) + rounding*trace/size(form, 1)
        space%sigma(k, 1) = sum(conjg(space%basis%psi(:, k)))
      end do
      call zgesv(n, 1_blas_ip, form, n, space%pivot(:, 1), space%sigma, n, stat)
      call invert_triangle(space%basis%triangle, space%basis%back)
      call multiply('N', space%basis%back, space%sigma, sigma)
      if (stat /= 0 .or. .not. abs(sigma(1, 1)) > 0.0_dp) info = 1
      if (info /= info_good .or. m == 0) return
      do k = 1, size(poles)
        matrix(:, k) = -sigma(k + 1, 1)/sigma(1, 1)
        matrix(k, k) = matrix(k, k) + poles(k)
      end do
      if (.not. all_finite(matrix)) then
        info = 1
        return
      end if
      call hold_all_traps(host)
      call zgeev('N', 'N', m, matrix, m, poles, no_left, 1_blas_ip, no_right, 1_blas_ip, space%work, &
                 size(space%work, kind=blas_ip), space%real_work, stat, 1_c_size_t, 1_c_size_t)
      call release_all_traps(host)
      if (stat /= 0) then
        info = 1
        return
      end if
      poles = cmplx(-max(abs(real(poles)), least_damping(s)), aimag(poles), dp)
    end associate
  end subroutine zeros_of_sigma

  !> Least distance of poles from the frequency axis.
  pure function least_damping(s) result(least)
    complex(dp), intent(in) :: s(:)
    real(dp) :: least

    least = nearest*(maxval(aimag(s)) - minval(aimag(s)))/size(s)
  end function least_damping
end module jointfrf_rational_fit
