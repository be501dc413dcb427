!> What the test programs share: checks that count, seeded random matrices, and references in quadruple precision.
!>
!> A reference never uses the kernel, but for the kind of its integers: inverses are Gauss-Jordan in real(16),
!> assemblies are built from dynamic stiffnesses spring by spring. Arrays of lines have the shape (out, in, n_freq).
module testing
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan, ieee_positive_inf, ieee_quiet_nan, ieee_value
  use, intrinsic :: iso_c_binding, only: dp => c_double
  use, intrinsic :: iso_fortran_env, only: error_unit, int64, output_unit, qp => real128
  use jointfrf_kinds, only: ip
  !$ use omp_lib, only: omp_set_num_threads
  implicit none
  private
  public :: dp, ip, qp
  public :: check, check_close, check_same, check_bad_line, check_untouched, finish
  public :: not_a_number, infinity, untouched, set_threads
  public :: seed, uniform, normal, random_real, random_lines, random_regular
  public :: inverse, quad_inverse, norm_1, transposed, assembled, add_spring, thesis_chain

  !> What outputs hold before a call that must not touch them.
  real(dp), parameter :: untouched = 4711.0_dp
  real(dp), parameter, public :: two_pi = 2.0_dp*acos(-1.0_dp)

  integer :: checks = 0
  integer :: failures = 0
  integer(int64) :: state = 1

  !> Whether two numbers agree, each line against its own largest entry.
  interface check_close
    module procedure close_lines
    module procedure close_real
    module procedure close_complex
  end interface check_close

  !> Whether two results agree in every bit.
  interface check_same
    module procedure same_lines
    module procedure same_real
  end interface check_same

  !> Whether an output still holds what it held before the call.
  interface check_untouched
    module procedure untouched_lines
    module procedure untouched_real
  end interface check_untouched

  interface transposed
    module procedure transposed_lines, transposed_matrix
  end interface transposed

contains

  ! Checks

  subroutine check(condition, what)
    logical, intent(in) :: condition
    character(len=*), intent(in) :: what

    checks = checks + 1
    if (condition) return
    failures = failures + 1
    write (error_unit, '(2a)') 'FAILED: ', what
  end subroutine check

  !> Ends the program, with an error where a check failed.
  subroutine finish(name)
    character(len=*), intent(in) :: name

    write (output_unit, '(2a,i0,a,i0,a)') name, ': ', checks, ' checks, ', failures, ' failed'
    if (failures > 0 .or. checks == 0) error stop 1
  end subroutine finish

  subroutine close_lines(actual, expected, tolerance, what)
    complex(dp), intent(in) :: actual(:, :, :), expected(:, :, :)
    real(dp), intent(in) :: tolerance
    character(len=*), intent(in) :: what
    real(dp) :: error, worst
    integer :: i

    if (any(shape(actual) /= shape(expected))) then
      call check(.false., what//': shapes differ')
      return
    end if
    worst = 0.0_dp
    do i = 1, size(actual, 3)
      if (size(actual(:, :, i)) == 0) cycle
      error = maxval(abs(actual(:, :, i) - expected(:, :, i)))/maxval(abs(expected(:, :, i)))
      if (any(ieee_is_nan(abs(actual(:, :, i))))) error = huge(error)
      if (.not. error <= worst) worst = error
    end do
    call report_error(worst, tolerance, what)
  end subroutine close_lines

  subroutine close_real(actual, expected, tolerance, what)
    real(dp), intent(in) :: actual, expected, tolerance
    character(len=*), intent(in) :: what

    call report_error(abs(actual - expected)/abs(expected), tolerance, what)
  end subroutine close_real

  subroutine close_complex(actual, expected, tolerance, what)
    complex(dp), intent(in) :: actual, expected
    real(dp), intent(in) :: tolerance
    character(len=*), intent(in) :: what

    call report_error(abs(actual - expected)/abs(expected), tolerance, what)
  end subroutine close_complex

  subroutine report_error(error, tolerance, what)
    real(dp), intent(in) :: error, tolerance
    character(len=*), intent(in) :: what
    character(len=40) :: text

    write (text, '(a,es9.2,a,es9.2)') ': error ', error, ' > ', tolerance
    call check(error <= tolerance, what//trim(text))
  end subroutine report_error

  subroutine same_lines(a, b, what)
    complex(dp), intent(in) :: a(:, :, :), b(:, :, :)
    character(len=*), intent(in) :: what

    call check(all(shape(a) == shape(b)) .and. all(transfer(a, [0_int64]) == transfer(b, [0_int64])), what)
  end subroutine same_lines

  subroutine same_real(a, b, what)
    real(dp), intent(in) :: a(:), b(:)
    character(len=*), intent(in) :: what

    call check(size(a) == size(b) .and. all(transfer(a, [0_int64]) == transfer(b, [0_int64])), what)
  end subroutine same_real

  subroutine untouched_lines(a, what)
    complex(dp), intent(in) :: a(:, :, :)
    character(len=*), intent(in) :: what
    complex(dp) :: before(size(a, 1), size(a, 2), size(a, 3))

    before = untouched
    call same_lines(a, before, what//': lines touched')
  end subroutine untouched_lines

  subroutine untouched_real(a, what)
    real(dp), intent(in) :: a(:)
    character(len=*), intent(in) :: what
    real(dp) :: before(size(a))

    before = untouched
    call same_real(a, before, what//': reals touched')
  end subroutine untouched_real

  !> One line is bad with the given code, filled with NaN, and the other lines are as without it, bit for bit.
  subroutine check_bad_line(actual, good, line, code, line_info, rcond, info, what)
    complex(dp), intent(in) :: actual(:, :, :), good(:, :, :)
    integer, intent(in) :: line
    integer(ip), intent(in) :: code, line_info(:), info
    real(dp), intent(in) :: rcond(:)
    character(len=*), intent(in) :: what
    logical :: others(size(line_info))
    character(len=12) :: text

    others = .true.
    others(line) = .false.
    write (text, '(i0)') line_info(line)
    call check(info == 1, what//': one bad line')
    call check(line_info(line) == code, what//': code of the line is '//trim(text))
    call check(all(pack(line_info, others) == 0), what//': codes of the other lines')
    call check(.not. abs(rcond(line)) > 0.0_dp, what//': rcond of the line is 0')
    call check(all(pack(rcond, others) > 0.0_dp), what//': rcond of the other lines')
    call check(all(ieee_is_nan(real(actual(:, :, line), dp)) .and. ieee_is_nan(aimag(actual(:, :, line)))), &
               what//': the line is NaN')
    call same_lines(actual(:, :, :line - 1), good(:, :, :line - 1), what//': lines before it')
    call same_lines(actual(:, :, line + 1:), good(:, :, line + 1:), what//': lines after it')
  end subroutine check_bad_line

  ! Numbers

  pure function not_a_number() result(x)
    real(dp) :: x

    x = ieee_value(x, ieee_quiet_nan)
  end function not_a_number

  pure function infinity() result(x)
    real(dp) :: x

    x = ieee_value(x, ieee_positive_inf)
  end function infinity

  subroutine set_threads(n)
    integer, intent(in) :: n

    !$ call omp_set_num_threads(n)
    if (n < 1) error stop 'set_threads: at least one thread'
  end subroutine set_threads

  !> The generator of Park and Miller, so that the numbers are the same with every compiler.
  subroutine seed(n)
    integer, intent(in) :: n
    integer :: i
    real(dp) :: discarded

    state = 1 + n
    do i = 1, 10
      discarded = uniform()
    end do
    if (discarded < 0.0_dp) error stop 'seed: the generator is broken'
  end subroutine seed

  !> Uniform in (0, 1).
  function uniform() result(x)
    real(dp) :: x

    state = mod(48271_int64*state, 2147483647_int64)
    x = real(state, dp)/2147483647.0_dp
  end function uniform

  !> Complex circular noise with E|e|^2 = 1.
  function normal() result(e)
    complex(dp) :: e
    real(dp) :: radius, angle

    radius = sqrt(-log(uniform()))
    angle = two_pi*uniform()
    e = cmplx(radius*cos(angle), radius*sin(angle), dp)
  end function normal

  !> Uniform in (-1, 1).
  function random_real(n, m) result(a)
    integer, intent(in) :: n, m
    real(dp) :: a(n, m)
    integer :: i, j

    do j = 1, m
      do i = 1, n
        a(i, j) = 2.0_dp*uniform() - 1.0_dp
      end do
    end do
  end function random_real

  !> Real and imaginary parts uniform in (-1, 1), without symmetry.
  function random_lines(n, m, n_freq) result(a)
    integer, intent(in) :: n, m, n_freq
    complex(dp) :: a(n, m, n_freq)
    integer :: i

    do i = 1, n_freq
      a(:, :, i) = cmplx(random_real(n, m), random_real(n, m), dp)
    end do
  end function random_lines

  !> The same with a diagonal that keeps the condition number small.
  function random_regular(n, n_freq) result(a)
    integer, intent(in) :: n, n_freq
    complex(dp) :: a(n, n, n_freq)
    integer :: m

    a = random_lines(n, n, n_freq)
    do m = 1, n
      a(m, m, :) = a(m, m, :) + cmplx(1.5_dp, -1.0_dp, dp)*sqrt(real(n, dp))
    end do
  end function random_regular

  !> Each line transposed.
  function transposed_lines(a) result(t)
    complex(dp), intent(in) :: a(:, :, :)
    complex(dp) :: t(size(a, 2), size(a, 1), size(a, 3))
    integer :: i

    do i = 1, size(a, 3)
      t(:, :, i) = transpose(a(:, :, i))
    end do
  end function transposed_lines

  !> gfortran 13 and 14 hand over `transpose(a)` wrongly where an argument is contiguous and a target.
  function transposed_matrix(a) result(t)
    real(dp), intent(in) :: a(:, :)
    real(dp) :: t(size(a, 2), size(a, 1))

    t = transpose(a)
  end function transposed_matrix

  ! References

  !> Inverse of every line in quadruple precision.
  function inverse(a) result(a_inverse)
    complex(dp), intent(in) :: a(:, :, :)
    complex(dp) :: a_inverse(size(a, 1), size(a, 1), size(a, 3))
    integer :: i

    do i = 1, size(a, 3)
      a_inverse(:, :, i) = cmplx(quad_inverse(cmplx(a(:, :, i), kind=qp)), kind=dp)
    end do
  end function inverse

  !> Gauss-Jordan with partial pivoting.
  function quad_inverse(a) result(x)
    complex(qp), intent(in) :: a(:, :)
    complex(qp) :: x(size(a, 1), size(a, 1)), work(size(a, 1), 2*size(a, 1)), row(2*size(a, 1))
    integer :: n, i, j, p

    n = size(a, 1)
    work = 0
    work(:, :n) = a
    do i = 1, n
      work(i, n + i) = 1
    end do
    do j = 1, n
      p = j - 1 + maxloc(abs(work(j:, j)), 1)
      row = work(p, :)
      work(p, :) = work(j, :)
      work(j, :) = row/row(j)
      do i = 1, n
        if (i /= j) work(i, :) = work(i, :) - work(i, j)*work(j, :)
      end do
    end do
    x = work(:, n + 1:)
  end function quad_inverse

  !> Largest column sum of |re| + |im|, which the kernel takes for the 1-norm.
  pure function norm_1(a) result(norm)
    complex(dp), intent(in) :: a(:, :)
    real(dp) :: norm

    norm = maxval(sum(abs(real(a)) + abs(aimag(a)), dim=1))
  end function norm_1

  !> Receptance of A and B joined by K*, DOFs of A, then of B: the assembled dynamic stiffness, inverted.
  function assembled(h_a, h_b, k_joint, dofs_j, dofs_k) result(h_c)
    complex(dp), intent(in) :: h_a(:, :, :), h_b(:, :, :), k_joint(:, :, :)
    integer(ip), intent(in) :: dofs_j(:), dofs_k(:)
    complex(dp) :: h_c(size(h_a, 1) + size(h_b, 1), size(h_a, 1) + size(h_b, 1), size(h_a, 3))
    complex(qp) :: z(size(h_c, 1), size(h_c, 1)), k(size(dofs_j), size(dofs_j))
    integer(ip) :: on_b(size(dofs_k))
    integer :: n_a, i

    n_a = size(h_a, 1)
    on_b = n_a + dofs_k
    do i = 1, size(h_a, 3)
      k = k_joint(:, :, i)
      z = 0
      z(:n_a, :n_a) = quad_inverse(cmplx(h_a(:, :, i), kind=qp))
      z(n_a + 1:, n_a + 1:) = quad_inverse(cmplx(h_b(:, :, i), kind=qp))
      z(dofs_j, dofs_j) = z(dofs_j, dofs_j) + k
      z(dofs_j, on_b) = z(dofs_j, on_b) - k
      z(on_b, dofs_j) = z(on_b, dofs_j) - k
      z(on_b, on_b) = z(on_b, on_b) + k
      h_c(:, :, i) = cmplx(quad_inverse(z), kind=dp)
    end do
  end function assembled

  !> A spring of complex stiffness k between two DOFs; j = 0 is the ground.
  subroutine add_spring(z, i, j, k)
    complex(qp), intent(inout) :: z(:, :)
    integer, intent(in) :: i, j
    complex(qp), intent(in) :: k

    z(i, i) = z(i, i) + k
    if (j == 0) return
    z(j, j) = z(j, j) + k
    z(i, j) = z(i, j) - k
    z(j, i) = z(j, i) - k
  end subroutine add_spring

  !> The chain of Table 3-1, ground-k1-m1-k2-m2 =joint= m3-k3-m4-k4-ground: A, B, and the assembly through `joint`.
  subroutine thesis_chain(freq_hz, joint, h_a, h_b, h_c)
    real(dp), intent(in) :: freq_hz(:)
    complex(dp), intent(in) :: joint(:)
    complex(dp), intent(out) :: h_a(2, 2, size(freq_hz)), h_b(2, 2, size(freq_hz)), h_c(4, 4, size(freq_hz))
    real(qp), parameter :: mass(4) = [5, 3, 4, 2], stiffness(4) = [2500, 3500, 2000, 2500], damping(4) = [3, 4, 2, 1]
    complex(qp) :: z(4, 4), k(4)
    real(qp) :: omega
    integer :: i, m

    do i = 1, size(freq_hz)
      omega = two_pi*freq_hz(i)
      k = cmplx(stiffness, omega*damping, qp)
      z = 0
      do m = 1, 4
        z(m, m) = -omega**2*mass(m)
      end do
      call add_spring(z, 1, 0, k(1))
      call add_spring(z, 1, 2, k(2))
      call add_spring(z, 3, 4, k(3))
      call add_spring(z, 4, 0, k(4))
      h_a(:, :, i) = cmplx(quad_inverse(z(:2, :2)), kind=dp)
      h_b(:, :, i) = cmplx(quad_inverse(z(3:, 3:)), kind=dp)
      call add_spring(z, 2, 3, cmplx(joint(i), kind=qp))
      h_c(:, :, i) = cmplx(quad_inverse(z), kind=dp)
    end do
  end subroutine thesis_chain
end module testing
