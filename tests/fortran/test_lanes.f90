!> Every engine against LAPACK and quadruple precision, by the flat API: all operations in both storage orders, any
!> number of lines, memory beside the results, bad lines, threads, both residuals of inverse and solution.
module lane_calls
  use testing, only: dp, infinity, ip, not_a_number, random_lines, random_real, random_regular, transposed, uniform, &
    untouched
  use jointfrf, only: jf_central_difference, jf_compliance_covariance, jf_compliance_factors, jf_couple, jf_decouple, &
    jf_find_modification, jf_inverse_substructuring, jf_invert, jf_ismm, jf_joint_compliance, jf_modify, &
      jf_receptance, &
    jf_receptance_banded, jf_receptance_modal, jf_solve, jf_transform
  implicit none
  private
  public :: outcome, run

  !> What one call gives: lines one after the other, and more room than the call may use.
  type :: outcome
    complex(dp), allocatable :: values(:, :)
    real(dp), allocatable :: rcond(:)
    integer(ip), allocatable :: line_info(:)
    integer(ip) :: info
  end type outcome

contains

  !> Call an operation with random numbers. Matrices of a line are regular, whichever way they are stored.
  subroutine run(operation, order, n, lines, bad, kind, result)
    character(len=*), intent(in) :: operation
    character, intent(in) :: order, kind
    integer, intent(in) :: n, lines, bad
    type(outcome), intent(out) :: result
    complex(dp), allocatable :: a(:, :, :), b(:, :, :), c(:, :, :), x(:, :)
    real(dp), allocatable :: k(:, :), m(:, :), d(:, :), s(:, :), omega(:), offset(:)
    integer(ip) :: all_dofs(2*n), n_i, lines_i, kl
    real(dp) :: rcond(lines + 1)
    integer(ip) :: line_info(lines + 1), info
    integer :: i

    n_i = int(n, ip)
    lines_i = int(lines, ip)
    all_dofs = [(int(i, ip), i=1, 2*n)]
    rcond = untouched
    line_info = 0
    select case (operation)
    case ('invert', 'solve', 'solve_one', 'modify', 'find_modification')
      a = random_regular(n, lines)
      b = random_regular(n, lines)
    case ('receptance', 'banded', 'modal')
      omega = [(0.3_dp + uniform(), i=1, lines)]
      if (bad > 0) then
        if (kind == 'n') omega(bad) = not_a_number()
        if (kind == 'i') omega(bad) = infinity()
        if (kind == '0') omega(bad) = 0
        if (kind == 'h') omega(bad) = 1.0e200_dp
      end if
    case ('central_difference', 'transform')
      a = random_lines(n + 1, n + 1, lines)
    case default
      a = random_regular(2*n, lines)
      b = random_regular(2*n, lines)
    end select
    if (allocated(a) .and. bad > 0) then
      if (kind == 'n') a(n, 1, bad) = not_a_number()
      if (kind == 'i') a(1, n, bad) = cmplx(0.0_dp, infinity(), dp)
      if (kind == '0') a(:, :, bad) = 0
      if (kind == 'h') a(:, :, bad) = a(:, :, bad)*1.0e300_dp
    end if
    select case (operation)
    case ('invert')
      call room(n*n)
      call jf_invert(n_i, lines_i, a, x, line_info, rcond, info)
    case ('solve')
      call room(3*n)
      c = random_lines(n, 3, lines)
      if (order == 'T') c = transposed(c)
      call jf_solve(order, n_i, 3_ip, lines_i, a, c, x, line_info, rcond, info)
    case ('solve_one')
      call room(n)
      c = random_lines(n, 1, lines)
      if (order == 'T') c = transposed(c)
      call jf_solve(order, n_i, 1_ip, lines_i, a, c, x, line_info, rcond, info)
    case ('receptance', 'banded')
      kl = min(1_ip, n_i - 1)
      if (operation == 'banded') then
        call model(int(2*kl + 1))
      else
        call model(n)
      end if
      call room(n)
      if (operation == 'banded') then
        call jf_receptance_banded(order, n_i, kl, kl, lines_i, n_i, 1_ip, omega, k, m, n_i, d, n_i, s, 0.1_dp, &
                                  all_dofs(n:1:-1), all_dofs, x, line_info, rcond, info)
      else
        call jf_receptance(order, n_i, lines_i, n_i, 1_ip, omega, k, m, n_i, d, n_i, s, 0.1_dp, all_dofs(n:1:-1), &
                           all_dofs, x, line_info, rcond, info)
      end if
    case ('modal')
      call room(6)
      call model(n)
      call jf_receptance_modal(order, n_i, lines_i, 2_ip, 3_ip, omega, abs(k(:, 1)), abs(d(:, 1)), abs(s(:, 1)), &
                               random_real(2, n), random_real(3, n), x, line_info, rcond, info)
    case ('couple')
      call room((4*n)**2)
      c = random_regular(n, lines)
      call jf_couple(order, 2*n_i, 2*n_i, n_i, lines_i, a, b, c, all_dofs(n + 1:), all_dofs(n:1:-1), x, line_info, &
                     rcond, info)
    case ('modify')
      call room(n*n)
      c = random_regular((n + 1)/2, lines)
      call jf_modify(order, n_i, (n_i + 1_ip)/2_ip, lines_i, a, c, all_dofs(n/2 + 1:n), x, line_info, rcond, info)
    case ('find_modification')
      call room(n*n)
      call jf_find_modification(order, n_i, lines_i, a, b, x, line_info, rcond, info)
    case ('ismm')
      call room(n*n)
      c = random_lines(n, n, lines)
      call jf_ismm(order, n_i, lines_i, a, b, c, x, line_info, rcond, info)
    case ('inverse_substructuring')
      call room(n*n)
      call jf_inverse_substructuring(order, n_i, lines_i, a, x, line_info, rcond, info)
    case ('decouple')
      call room(n*n)
      c = random_regular(n, lines)
      call jf_decouple('sr', order, 2*n_i, 2*n_i, n_i, lines_i, a, b, c, all_dofs(:n), all_dofs(:n), all_dofs(n + 1:), &
                       all_dofs(n + 1:), x, line_info, rcond, info)
    case ('joint_compliance')
      call room(n*n)
      call swap_halves
      call jf_joint_compliance(order, n_i, lines_i, a, x, line_info, rcond, info)
    case ('compliance_factors')
      call room(2*n*(n + 1))
      call swap_halves
      call jf_compliance_factors(order, n_i, n_i + 1_ip, lines_i, a, random_real(2*n, n + 1), x, line_info, rcond, info)
    case ('compliance_covariance')
      call room(n**4)
      call swap_halves
      call jf_compliance_covariance(order, 1_ip, n_i, n_i + 1_ip, lines_i, a, random_real(2*n, n + 1), &
                                    abs(random_lines(n + 1, n + 1, lines)), x, line_info, rcond, info)
    case ('central_difference')
      call room(4)
      offset = [(real(i, dp), i=0, n)]
      call jf_central_difference(order, n_i + 1_ip, lines_i, offset, a, x, line_info, rcond, info)
    case ('transform')
      call room(3*n)
      call jf_transform(order, 3_ip, n_i, n_i + 1_ip, n_i + 1_ip, lines_i, a, random_real(3, n + 1), &
                        random_real(n, n + 1), x, line_info, rcond, info)
    end select
    result%values = x
    result%rcond = rcond
    result%line_info = line_info(:lines)
    result%info = info

  contains

    subroutine room(numbers)
      integer, intent(in) :: numbers

      allocate (x(numbers, lines + 1))
      x = untouched
    end subroutine room

    !> K, M, C and H that make regular matrices; `rows` of band storage, or square.
    subroutine model(rows)
      integer, intent(in) :: rows
      integer :: i

      k = random_real(rows, n)
      m = 0.1_dp*random_real(rows, n)
      d = 0.1_dp*random_real(rows, n)
      s = 0.1_dp*random_real(rows, n)
      do i = 1, n
        k(merge((rows + 1)/2, i, rows /= n .or. operation == 'banded'), i) = 3.0_dp*n
      end do
    end subroutine model

    !> The blocks jk and kj are those that are inverted.
    subroutine swap_halves()
      a = cshift(a, n, 2)
    end subroutine swap_halves
  end subroutine run
end module lane_calls

program test_lanes
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite, ieee_is_nan
  use testing, only: check, check_same, dp, finish, infinity, ip, qp, random_lines, random_real, seed, &
    set_threads, uniform, untouched
  use jointfrf, only: jf_engine_automatic, jf_engine_lapack, jf_engine_plain, jf_engine_x86_64_v4, jf_invert, &
    jf_set_engine, jf_solve
  use lane_calls, only: outcome, run
  implicit none
  character(len=*), parameter :: operations(17) = [character(len=22) :: 'invert', 'solve', 'solve_one', 'receptance', &
    'banded', 'modal', 'couple', 'modify', 'find_modification', 'ismm', 'inverse_substructuring', 'decouple', &
    'joint_compliance', 'compliance_factors', 'compliance_covariance', 'central_difference', 'transform']
  character(len=*), parameter :: orders(2) = ['N', 'T']
  real(dp), parameter :: eps = epsilon(1.0_dp)

  integer(ip) :: engine, info
  integer :: k

  call seed(31)
  do engine = jf_engine_plain, jf_engine_x86_64_v4
    call jf_set_engine(engine, info)
    if (info /= 0) cycle
    do k = 1, size(operations)
      call as_the_reference(trim(operations(k)))
      call bad_lines(trim(operations(k)))
    end do
    call extreme_divisions()
    call threads()
    call residuals()
  end do
  call jf_set_engine(jf_engine_automatic, info)
  call finish('lanes')

contains

  !> Orders of the matrices and numbers of lines with every tail of a block.
  subroutine as_the_reference(operation)
    character(len=*), intent(in) :: operation
    integer, parameter :: sizes(9) = [1, 2, 3, 4, 5, 6, 7, 8, 9], counts(6) = [1, 2, 3, 8, 9, 67]
    integer :: i, j, t

    do i = 1, size(sizes)
      if (operation == 'compliance_covariance' .and. sizes(i) > 3) cycle
      do j = 1, size(counts)
        do t = merge(1, 1 + mod(i + j, 2), counts(j) == 9), merge(2, 1 + mod(i + j, 2), counts(j) == 9)
          call compare(operation, orders(t), sizes(i), counts(j), 0, ' ')
        end do
      end do
    end do
    if (operation == 'invert' .or. operation == 'solve') then
      call compare(operation, 'N', 33, 11, 0, ' ')
      call compare(operation, 'T', 64, 9, 0, ' ')
      call compare(operation, 'N', 65, 3, 0, ' ')
    end if
  end subroutine as_the_reference

  !> One bad line, in every place of a block.
  subroutine bad_lines(operation)
    character(len=*), intent(in) :: operation
    character(len=*), parameter :: kinds = 'ni0h'
    integer :: place, kind_of, n

    do n = 1, 5
      if (operation == 'compliance_covariance' .and. n > 2) cycle
      do place = n, 11, merge(1, 5, n == 2)
        do kind_of = 1, len(kinds)
          call compare(operation, orders(1 + mod(place, 2)), n, 11, place, kinds(kind_of:kind_of))
        end do
      end do
    end do
  end subroutine bad_lines

  !> An engine and the reference on the same numbers.
  !> bad    the line that is bad, 0 for none
  !> kind   n NaN, i Inf, 0 zero, h huge
  subroutine compare(operation, order, n, lines, bad, kind)
    character(len=*), intent(in) :: operation
    character, intent(in) :: order, kind
    integer, intent(in) :: n, lines, bad
    type(outcome) :: fast, expected
    real(dp) :: apart, largest
    character(len=80) :: what
    integer :: i

    write (what, '(3a,3(i0,a),2a)') operation, ' ', order//' n=', n, ' lines=', lines, ' bad=', bad, ' ', kind, ':'
    call jf_set_engine(engine, info)
    call seed(1000*n + lines)
    call run(operation, order, n, lines, bad, kind, fast)
    call jf_set_engine(jf_engine_lapack, info)
    call seed(1000*n + lines)
    call run(operation, order, n, lines, bad, kind, expected)
    call check(fast%info == expected%info .and. all(fast%line_info == expected%line_info), trim(what)//' codes')
    call check(all(abs(fast%values(:, lines + 1) - untouched) <= 0.0_dp), trim(what)//' memory after the results')
    call check(abs(fast%rcond(lines + 1) - untouched) <= 0.0_dp, trim(what)//' memory after rcond')
    do i = 1, lines
      if (fast%line_info(i) /= 0) then
        call check(all(ieee_is_nan(real(fast%values(:, i))) .and. ieee_is_nan(aimag(fast%values(:, i)))) &
                   .and. .not. abs(fast%rcond(i)) > 0.0_dp, trim(what)//' a bad line is NaN')
        cycle
      end if
      call check(all(ieee_is_finite(abs(fast%values(:, i)))), trim(what)//' a good line is finite')
      apart = maxval(abs(fast%values(:, i) - expected%values(:, i)))
      largest = maxval(abs(expected%values(:, i)))
      if (i == bad) cycle                   ! good, but of any condition
      call check(apart <= 1.0e-10_dp*largest, trim(what)//' result')
      call check(fast%rcond(i) <= 30*expected%rcond(i) .and. expected%rcond(i) <= 30*fast%rcond(i) &
                 .and. fast%rcond(i) <= 1.0_dp, trim(what)//' rcond')
      if (operation == 'invert') call check(abs(fast%rcond(i)/expected%rcond(i) - 1) <= 1.0e-10_dp, &
                                            trim(what)//' rcond of an inverse is exact')
    end do
  end subroutine compare

  !> One thread and two give the same bits.
  subroutine threads()
    integer, parameter :: sizes(4) = [2, 4, 5, 9], counts(4) = [4100, 2101, 901, 300]
    type(outcome) :: one, two
    integer :: i, k

    call jf_set_engine(engine, info)
    do i = 1, size(sizes)
      do k = 1, 2
        call set_threads(1)
        call seed(i)
        call run(operations(k), 'N', sizes(i), counts(i), counts(i)/2, 'n', one)
        call set_threads(2)
        call seed(i)
        call run(operations(k), 'N', sizes(i), counts(i), counts(i)/2, 'n', two)
        call check_same(reshape(one%values, [size(one%values), 1, 1]), reshape(two%values, [size(two%values), 1, 1]), &
                        'one thread and two')
        call check_same(one%rcond, two%rcond, 'rcond, one thread and two')
      end do
    end do
  end subroutine threads

  !> Systems of order 1 whose numbers, squares or quotients leave the range: codes and values as LAPACK has them.
  subroutine extreme_divisions()
    real(dp), parameter :: sizes(7) = [0.0_dp, 1.0e-320_dp, 1.0e-200_dp, 1.0_dp, 1.0e200_dp, 1.0e308_dp, 2.0_dp]
    complex(dp) :: a(1, 1, 49), b(1, 1, 49), x(1, 1, 49), expected(1, 1, 49)
    real(dp) :: rcond(49), numbers(7)
    integer(ip) :: line_info(49), expected_info(49), info
    integer :: i, j

    numbers = sizes
    numbers(7) = infinity()
    do j = 1, 7
      do i = 1, 7
        a(1, 1, 7*(j - 1) + i) = cmplx(numbers(i), -0.5_dp*numbers(i), dp)
        b(1, 1, 7*(j - 1) + i) = cmplx(0.25_dp*numbers(j), numbers(j), dp)
      end do
    end do
    call jf_solve('N', 1_ip, 1_ip, 49_ip, a, b, x, line_info, rcond, info)
    call jf_set_engine(jf_engine_lapack, info)
    call jf_solve('N', 1_ip, 1_ip, 49_ip, a, b, expected, expected_info, rcond, info)
    call jf_set_engine(engine, info)
    call check(all(line_info == expected_info), 'divisions out of range: codes')
    call check(count(line_info /= 0) > 20 .and. count(line_info == 0) > 10, 'divisions out of range: some of each')
    call check(all(ieee_is_nan(real(x(1, 1, :))) .eqv. line_info /= 0), 'divisions out of range: NaN in bad lines')
    call check(all(line_info /= 0 .or. abs(x(1, 1, :) - expected(1, 1, :)) <= 8*eps*abs(expected(1, 1, :)) &
                   + 1.0e-322_dp), 'divisions out of range: values')
  end subroutine extreme_divisions

  !> |A X - I| and |X A - I| over eps |A| |X|, and |A X - B| over eps (|A| |X|), in quadruple precision: no more than a
  !> few times those of LAPACK. An inverse may be that of the transpose, transposed, whose rows are scaled as the
  !> columns were: it is held to the worse of both.
  subroutine residuals()
    integer, parameter :: sizes(10) = [1, 2, 3, 4, 5, 6, 7, 8, 13, 24]
    character(len=*), parameter :: families(5) = [character(len=8) :: 'random', 'rows', 'columns', 'rank', 'growth']
    real(dp) :: fast(3), reference(3), across
    integer :: i, f
    character(len=40) :: what

    do i = 1, size(sizes)
      do f = 1, size(families)
        fast = worst(engine, families(f), sizes(i), .false.)
        reference = worst(jf_engine_lapack, families(f), sizes(i), .true.)
        across = maxval(reference(:2))
        reference = worst(jf_engine_lapack, families(f), sizes(i), .false.)
        reference(:2) = max(reference(:2), across)
        write (what, '(2a,i0,2es9.1)') trim(families(f)), ' n=', sizes(i), maxval(fast(:2)), maxval(reference(:2))
        call check(maxval(fast(:2)) <= 6*maxval(reference(:2)), 'inverse: residual, '//trim(what))
        call check(fast(3) <= 6*reference(3) + 1, 'solution: residual, '//trim(families(f)))
      end do
    end do
  end subroutine residuals

  !> The largest residuals over some lines: A X - I, X A - I, A x - b.
  function worst(engine, family, n, transposed) result(residual)
    integer(ip), intent(in) :: engine
    character(len=*), intent(in) :: family
    integer, intent(in) :: n
    logical, intent(in) :: transposed
    integer, parameter :: lines = 20
    real(dp) :: residual(3)
    complex(dp) :: a(n, n, lines), x(n, n, lines), b(n, 1, lines), y(n, 1, lines)
    complex(qp) :: a_q(n, n), x_q(n, n), unit(n, n)
    real(dp) :: rcond(lines), scale
    integer(ip) :: line_info(lines), info
    integer :: i, j

    call seed(n)
    a = random_lines(n, n, lines)
    select case (family)
    case ('rows', 'columns')
      do i = 1, lines
        do j = 1, n
          scale = 10.0_dp**(16*uniform() - 8)
          if (family == 'rows') a(j, :, i) = scale*a(j, :, i)
          if (family == 'columns') a(:, j, i) = scale*a(:, j, i)
        end do
      end do
    case ('rank')
      do i = 1, lines
        a(:, :, i) = 1.0e-5_dp*a(:, :, i) + matmul(random_real(n, 3), random_real(3, n))
      end do
    case ('growth')
      do i = 1, n
        a(i, :i - 1, :) = -1
        a(i, i + 1:, :) = 0
        a(i, i, :) = 1
        a(i, n, :) = 1
      end do
      a = a*exp(cmplx(0.0_dp, 0.7_dp, dp))
    end select
    if (transposed) then
      do i = 1, lines
        a(:, :, i) = transpose(a(:, :, i))
      end do
    end if
    b = random_lines(n, 1, lines)
    call jf_set_engine(engine, info)
    call jf_invert(int(n, ip), int(lines, ip), a, x, line_info, rcond, info)
    call check(info == 0, 'inverse: good, '//family)
    call jf_solve('N', int(n, ip), 1_ip, int(lines, ip), a, b, y, line_info, rcond, info)
    call check(info == 0, 'solution: good, '//family)
    unit = 0
    do i = 1, n
      unit(i, i) = 1
    end do
    residual = 0
    do i = 1, lines
      a_q = a(:, :, i)
      x_q = x(:, :, i)
      scale = eps*norm(a(:, :, i))*norm(x(:, :, i))
      residual(1) = max(residual(1), norm(cmplx(matmul(a_q, x_q) - unit, kind=dp))/scale)
      residual(2) = max(residual(2), norm(cmplx(matmul(x_q, a_q) - unit, kind=dp))/scale)
      scale = eps*norm(a(:, :, i))*norm(y(:, :, i))
      x_q(:, :1) = y(:, :, i)
      residual(3) = max(residual(3), norm(cmplx(matmul(a_q, x_q(:, :1)) - b(:, :, i), kind=dp))/scale)
    end do
  end function worst

  pure function norm(a)
    complex(dp), intent(in) :: a(:, :)
    real(dp) :: norm

    norm = maxval(sum(abs(a), 1))
  end function norm
end program test_lanes
