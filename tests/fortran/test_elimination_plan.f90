!> A plan carried out with real numbers, against the inverse of the whole matrix.
program test_elimination_plan
  use testing, only: check, check_close, dp, finish, qp, quad_inverse, random_real, seed
  use jointfrf_elimination_plan, only: elimination_plan, make_plan
  implicit none

  call seed(9)
  call chain(.true.)
  call chain(.false.)
  call both_ends(.true.)
  call both_ends(.false.)
  call everything_retained()
  call finish('elimination_plan')

contains

  !> Nodes of two DOFs; one DOF of two nodes is wanted: its node cuts the chain, so the other DOF is retained as well.
  subroutine chain(symmetric)
    logical, intent(in) :: symmetric
    integer, parameter :: n = 40, reach = 3, wanted(2) = [31, 11]
    real(dp) :: a(n, n)
    logical :: coupled(reach, n), retained(n)
    type(elimination_plan) :: plan
    integer :: i, j, stat

    a = random_real(n, n)
    if (symmetric) a = a + transpose(a)
    coupled = .false.
    do j = 1, n
      do i = 1, n
        if (abs((i - 1)/2 - (j - 1)/2) > 1) a(i, j) = 0
        if (i > j .and. i <= j + reach) coupled(i - j, j) = abs((i - 1)/2 - (j - 1)/2) <= 1
      end do
      a(j, j) = a(j, j) + 8
    end do
    retained = .false.
    retained(wanted) = .true.
    call make_plan(n, coupled, retained, wanted, symmetric, plan, stat)
    call check(stat == 0, 'memory for the plan')
    call check(count(retained) == 4 .and. all(retained([11, 12, 31, 32])), 'chain: separators')
    call check(plan%n_retained == 4 .and. plan%n_steps == n - 4, 'chain: all others are eliminated')
    call check(all(plan%unknown(3:4) == wanted), 'chain: wanted unknowns last')
    call check(plan%n_slots <= 8, 'chain: slots are used again')
    call check(plan%products < merge(16, 30, symmetric)*n, 'chain: few products')
    call check_inverse(plan, a, 'chain')
  end subroutine chain

  !> Nodes of one DOF, of which both ends are wanted: every pivot is coupled with the next one and with the first, twice
  !> as many unknowns as the matrix has entries below its diagonal, so that lists of that length have to grow.
  subroutine both_ends(symmetric)
    logical, intent(in) :: symmetric
    integer, parameter :: n = 60, wanted(2) = [1, n]
    real(dp) :: a(n, n)
    logical :: coupled(1, n), retained(n)
    type(elimination_plan) :: plan
    integer :: i, j, stat

    a = random_real(n, n)
    if (symmetric) a = a + transpose(a)
    do j = 1, n
      do i = 1, n
        if (abs(i - j) > 1) a(i, j) = 0
      end do
      a(j, j) = a(j, j) + 8
    end do
    coupled = .true.
    retained = .false.
    retained(wanted) = .true.
    call make_plan(n, coupled, retained, wanted, symmetric, plan, stat)
    call check(stat == 0, 'memory for the plan')
    call check(plan%n_retained == 2 .and. plan%n_steps == n - 2, 'both ends: all others are eliminated')
    call check(plan%last_near(plan%n_steps + 1) > n, 'both ends: more neighbours than couplings')
    call check_inverse(plan, a, 'both ends')
  end subroutine both_ends

  subroutine everything_retained()
    integer, parameter :: n = 3
    real(dp) :: a(n, n)
    logical :: coupled(2, n), retained(n)
    type(elimination_plan) :: plan
    integer :: stat

    a = random_real(n, n)
    coupled = .true.
    retained = .true.
    call make_plan(n, coupled, retained, [2], .false., plan, stat)
    call check(plan%n_steps == 0 .and. plan%products == 0 .and. plan%unknown(n) == 2, 'nothing is eliminated')
    call check_inverse(plan, a, 'nothing is eliminated')
  end subroutine everything_retained

  !> The inverse of what is left is a part of the inverse of the whole.
  subroutine check_inverse(plan, a, what)
    type(elimination_plan), intent(in) :: plan
    real(dp), intent(in) :: a(:, :)
    character(len=*), intent(in) :: what
    real(dp) :: x(plan%n_slots**2)
    real(dp) :: left(plan%n_retained, plan%n_retained)
    complex(dp) :: whole(size(a, 1), size(a, 1)), found(plan%n_retained, plan%n_retained, 1)
    complex(dp) :: expected(plan%n_retained, plan%n_retained, 1)
    integer :: i, j

    call carry_out(plan, a, x)
    do j = 1, plan%n_retained
      do i = 1, plan%n_retained
        left(i, j) = x(position(plan, i, j))
      end do
    end do
    whole = cmplx(quad_inverse(cmplx(a, kind=qp)), kind=dp)
    found(:, :, 1) = cmplx(quad_inverse(cmplx(left, kind=qp)), kind=dp)
    expected(:, :, 1) = whole(plan%unknown, plan%unknown)
    call check_close(found, expected, 1.0e-12_dp, what//': inverse')
  end subroutine check_inverse

  subroutine carry_out(plan, a, x)
    type(elimination_plan), intent(in) :: plan
    real(dp), intent(in) :: a(:, :)
    real(dp), intent(out) :: x(:)
    integer :: s, e, p, i, j

    x = huge(1.0_dp)                        ! nothing that was not begun may be used
    do s = 1, plan%n_steps + 1
      do e = plan%last_zero(s) + 1, plan%last_zero(s + 1)
        x(plan%zero(e)) = 0
      end do
      do e = plan%last_entry(s) + 1, plan%last_entry(s + 1)
        x(plan%entry(e)) = a(plan%row(e), plan%column(e))
      end do
      if (s > plan%n_steps) exit
      p = plan%pivot(s)
      associate (near => plan%near(plan%last_near(s) + 1:plan%last_near(s + 1)))
        do i = 1, size(near)
          do j = merge(i, 1, plan%symmetric), size(near)
            e = position(plan, near(i), near(j))
            x(e) = x(e) - x(position(plan, near(i), p))*x(position(plan, p, near(j)))/x(position(plan, p, p))
          end do
        end do
      end associate
    end do
  end subroutine carry_out

  pure function position(plan, i, j) result(at)
    type(elimination_plan), intent(in) :: plan
    integer, intent(in) :: i, j
    integer :: at

    at = (i - 1)*plan%n_slots + j
    if (plan%symmetric) at = (min(i, j) - 1)*plan%n_slots + max(i, j)
  end function position
end program test_elimination_plan
