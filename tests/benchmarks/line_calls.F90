!> Nanoseconds of one line where a program calls line by line, and where it hands over all lines at once.
!>
!> line_calls N   for joints with N DOFs; prints names and numbers: three ways of jointfrf, and zgesv in a bare loop
program line_calls
  use, intrinsic :: iso_c_binding, only: c_int
  use, intrinsic :: iso_fortran_env, only: dp => real64, int64
  use jointfrf, only: jf_couple, jf_couple_work, jf_joint_compliance, jf_joint_compliance_work, jf_solve, jf_solve_work
  implicit none

  interface
    subroutine zgesv(n, n_rhs, a, lda, pivot, b, ldb, info) bind(C, name=JF_BLAS_PREFIX//"zgesv_")
      import :: c_int, dp
      implicit none
      integer(c_int), intent(in) :: n, n_rhs, lda, ldb
      complex(dp), intent(inout) :: a(lda, *), b(ldb, *)
      integer(c_int), intent(out) :: pivot(*), info
    end subroutine zgesv
  end interface

  integer, parameter :: lines = 1000, repeats = 15
  complex(dp), allocatable :: h_a(:, :, :), h_b(:, :, :), k(:, :, :), h_c(:, :, :), gamma(:, :, :), c(:, :, :)
  complex(dp), allocatable :: work(:), a(:, :), x(:, :)
  integer(c_int), allocatable :: dofs(:), iwork(:), codes(:)
  integer(c_int) :: n, m, info
  real(dp), allocatable :: rcond(:)
  real(dp) :: seconds(10)
  character(len=12) :: word
  integer :: r, i

  call get_command_argument(1, word)
  read (word, *) n
  m = 2*n
  allocate (h_a(m, m, lines), h_b(m, m, lines), h_c(2*m, 2*m, lines), k(n, n, lines), gamma(m, m, lines), &
            c(n, n, lines), a(m, m), x(m, m), dofs(n), codes(lines), rcond(lines))
  dofs = [(i, i=1, n)]
  call fill(h_a)
  call fill(h_b)
  call fill(k)
  call fill(gamma)
  call make_room()
  seconds = huge(seconds)
  do r = 1, repeats
    call time_couple()
    call time_compliance()
    call time_solve()
  end do
  print '(*(a, 1x, f0.1, 1x))', 'order', real(n, dp), &
    'couple_work', seconds(1), 'couple_line', seconds(2), 'couple_sweep', seconds(3), &
    'compliance_work', seconds(4), 'compliance_line', seconds(5), 'compliance_sweep', seconds(6), &
    'solve_work', seconds(7), 'solve_line', seconds(8), 'solve_sweep', seconds(9), 'solve_zgesv', seconds(10)

contains

  !> Numbers with a strong diagonal.
  subroutine fill(h)
    complex(dp), intent(out) :: h(:, :, :)
    real(dp) :: parts(2, size(h, 1), size(h, 2), size(h, 3))
    integer :: j

    call random_number(parts)
    h = cmplx(parts(1, :, :, :), parts(2, :, :, :), dp)
    do j = 1, size(h, 1)
      h(j, j, :) = h(j, j, :) + size(h, 1)
    end do
  end subroutine fill

  !> Workspace for the largest of the three.
  subroutine make_room()
    complex(dp) :: length(3, 1)
    integer(c_int) :: i_length(3, 1)

    call jf_couple_work('N', m, m, n, 1, h_a, h_b, k, dofs, dofs, h_c, codes, rcond, length(1, :), -1, i_length(1, &
      :), -1, &
                        info)
    call jf_joint_compliance_work('N', n, 1, gamma, c, codes, rcond, length(2, :), -1, i_length(2, :), -1, info)
    call jf_solve_work('N', m, m, 1, h_a, h_b, gamma, codes, rcond, length(3, :), -1, i_length(3, :), -1, info)
    allocate (work(nint(maxval(real(length)))), iwork(maxval(i_length)))
  end subroutine make_room

  subroutine time_couple()
    integer(int64) :: start

    call system_clock(start)
    do i = 1, lines
      call jf_couple_work('N', m, m, n, 1, h_a(:, :, i), h_b(:, :, i), k(:, :, i), dofs, dofs, h_c(:, :, i), codes(i), &
                          rcond(i), work, size(work, kind=c_int), iwork, size(iwork, kind=c_int), info)
    end do
    call take(start, seconds(1))
    do i = 1, lines
      call jf_couple('N', m, m, n, 1, h_a(:, :, i), h_b(:, :, i), k(:, :, i), dofs, dofs, h_c(:, :, i), codes(i), &
                     rcond(i), info)
    end do
    call take(start, seconds(2))
    call jf_couple('N', m, m, n, lines, h_a, h_b, k, dofs, dofs, h_c, codes, rcond, info)
    call take(start, seconds(3))
  end subroutine time_couple

  subroutine time_compliance()
    integer(int64) :: start

    call system_clock(start)
    do i = 1, lines
      call jf_joint_compliance_work('N', n, 1, gamma(:, :, i), c(:, :, i), codes(i), rcond(i), work, &
                                    size(work, kind=c_int), iwork, size(iwork, kind=c_int), info)
    end do
    call take(start, seconds(4))
    do i = 1, lines
      call jf_joint_compliance('N', n, 1, gamma(:, :, i), c(:, :, i), codes(i), rcond(i), info)
    end do
    call take(start, seconds(5))
    call jf_joint_compliance('N', n, lines, gamma, c, codes, rcond, info)
    call take(start, seconds(6))
  end subroutine time_compliance

  !> A X = B with as many columns as rows.
  subroutine time_solve()
    integer(int64) :: start

    call system_clock(start)
    do i = 1, lines
      call jf_solve_work('N', m, m, 1, h_a(:, :, i), h_b(:, :, i), gamma(:, :, i), codes(i), rcond(i), work, &
                         size(work, kind=c_int), iwork, size(iwork, kind=c_int), info)
    end do
    call take(start, seconds(7))
    do i = 1, lines
      call jf_solve('N', m, m, 1, h_a(:, :, i), h_b(:, :, i), gamma(:, :, i), codes(i), rcond(i), info)
    end do
    call take(start, seconds(8))
    call jf_solve('N', m, m, lines, h_a, h_b, gamma, codes, rcond, info)
    call take(start, seconds(9))
    do i = 1, lines
      a = h_a(:, :, i)
      x = h_b(:, :, i)
      call zgesv(m, m, a, m, iwork, x, m, info)
      gamma(:, :, i) = x
    end do
    call take(start, seconds(10))
  end subroutine time_solve

  !> The time since `start` per line, where it is the least so far; `start` is now.
  subroutine take(start, least)
    integer(int64), intent(inout) :: start
    real(dp), intent(inout) :: least
    integer(int64) :: now, rate

    call system_clock(now, rate)
    if (info /= 0) error stop 'a line is bad'
    least = min(least, 1.0e9_dp*real(now - start, dp)/real(rate, dp)/lines)
    call system_clock(start)
  end subroutine take
end program line_calls
