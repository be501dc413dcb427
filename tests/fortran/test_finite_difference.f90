!> Displacement and slope from points along a line: exact for polynomials that the points determine.
program test_finite_difference
  use testing, only: check, check_bad_line, check_close, check_same, dp, finish, infinity, ip, not_a_number, &
    random_lines, random_real, seed, set_threads, transposed
  use jointfrf_finite_difference, only: difference_weights, transform_receptance
  implicit none
  real(dp), parameter :: tolerance = 1.0e-11_dp

  call seed(11)
  call thesis_weights()
  call polynomial([-0.01_dp, 0.0_dp, 0.01_dp])
  call polynomial([-0.02_dp, 0.03_dp])
  call polynomial([0.03_dp, -0.01_dp, 0.005_dp])
  call polynomial([0.1_dp, 0.2_dp, 0.4_dp, 0.7_dp])
  call polynomial([-0.05_dp, -0.03_dp, 0.0_dp, 0.01_dp, 0.04_dp])
  call any_transformation(2, 4, 3, 5, 1)
  call any_transformation(6, 9, 6, 12, 1)
  call any_transformation(9, 17, 13, 11, 1)
  call any_transformation(16, 24, 1, 40, 1)
  call any_transformation(12, 25, 8, 7, 2)
  call any_transformation(12, 25, 8, 7, 5)
  call nothing()
  call bad_lines()
  call scales()
  call threads()
  call finish('finite_difference')

contains

  !> T_2c of (2.59).
  subroutine thesis_weights()
    real(dp), parameter :: dx = 0.005_dp
    real(dp) :: weights(2, 3), expected(2, 3)

    call difference_weights([-dx, 0.0_dp, dx], weights)
    expected(1, :) = [0.0_dp, 1.0_dp, 0.0_dp]
    expected(2, :) = [-1.0_dp, 0.0_dp, 1.0_dp]/(2*dx)
    call check(maxval(abs(weights(1, :) - expected(1, :))) < 1.0e-15_dp, 'T_2c: displacement')
    call check(maxval(abs(weights(2, :) - expected(2, :))) < 1.0e-15_dp/dx, 'T_2c: slope')
  end subroutine thesis_weights

  !> h(x, y) a polynomial of full degree in x and y without symmetry: H_new = [[h, dh/dy], [dh/dx, d2h/dxdy]] at (0, 0).
  subroutine polynomial(offset)
    real(dp), intent(in) :: offset(:)
    complex(dp) :: a(0:size(offset) - 1, 0:size(offset) - 1, 1), h(size(offset), size(offset), 1), h_new(2, 2, 1)
    complex(dp) :: expected(2, 2, 1), h_new_t(2, 2, 1)
    real(dp) :: weights(2, size(offset)), rcond(1), length
    integer(ip) :: line_info(1), info
    integer :: m, p, q, i, j

    m = size(offset)
    length = maxval(abs(offset))
    a = random_lines(m, m, 1)
    h = 0
    do q = 1, m
      do p = 1, m
        do j = 0, m - 1
          do i = 0, m - 1
            h(p, q, 1) = h(p, q, 1) + a(i, j, 1)*(offset(p)/length)**i*(offset(q)/length)**j
          end do
        end do
      end do
    end do
    call difference_weights(offset, weights)
    weights(2, :) = weights(2, :)*length
    expected(:, :, 1) = a(0:1, 0:1, 1)
    call transform_receptance(.false., h, weights, weights, h_new, line_info, rcond, info)
    call check(info == 0 .and. line_info(1) == 0 .and. rcond(1) >= 1.0_dp, 'polynomial: good')
    call check_close(h_new, expected, tolerance, 'polynomial')
    call transform_receptance(.true., transposed(h), transposed(weights), transposed(weights), h_new_t, line_info, &
                              rcond, info)
    call check_same(transposed(h_new_t), h_new, 'polynomial, transposed')
  end subroutine polynomial

  !> H_new = T_out H T_in^T. Weights of which few are zero, and of which most are, go ways of their own, and so do sums
  !> of four rows, of eight entries, and what is left of them.
  !> empty   every how many weights of T_out one is not zero
  subroutine any_transformation(n_out, m_out, n_in, m_in, empty)
    integer, intent(in) :: n_out, m_out, n_in, m_in, empty
    integer, parameter :: lines = 3
    complex(dp) :: h(m_out, m_in, lines), h_new(n_out, n_in, lines), h_new_t(n_in, n_out, lines)
    complex(dp) :: expected(n_out, n_in, lines)
    real(dp) :: t_out(n_out, m_out), t_in(n_in, m_in), rcond(lines)
    integer(ip) :: line_info(lines), info
    integer :: i, j

    h = random_lines(m_out, m_in, lines)
    t_out = random_real(n_out, m_out)
    t_in = random_real(n_in, m_in)
    do j = 1, m_out
      do i = 1, n_out
        if (mod(i + j, empty) /= 0) t_out(i, j) = 0
      end do
    end do
    do i = 1, lines
      expected(:, :, i) = matmul(t_out, matmul(h(:, :, i), transposed(t_in)))
    end do
    call transform_receptance(.false., h, t_out, t_in, h_new, line_info, rcond, info)
    call check(info == 0 .and. all(line_info == 0), 'any sizes: good')
    call check_close(h_new, expected, tolerance, 'any sizes')
    call transform_receptance(.true., transposed(h), transposed(t_out), transposed(t_in), h_new_t, line_info, &
                              rcond, info)
    call check_same(transposed(h_new_t), h_new, 'any sizes, transposed')
    h(m_out, m_in, 2) = cmplx(0.0_dp, not_a_number(), dp)
    call transform_receptance(.true., transposed(h), transposed(t_out), transposed(t_in), h_new_t, line_info, &
                              rcond, info)
    call check(info == 1 .and. line_info(2) == -1, 'any sizes: NaN')
  end subroutine any_transformation

  subroutine nothing()
    complex(dp) :: h(2, 2, 1), no_line(2, 2, 0), no_new(2, 2, 0), empty(0, 2, 1), no_points(0, 0, 1), h_new(2, 2, 1)
    real(dp) :: t(2, 2), no_rows(0, 2), no_columns(2, 0), rcond(1)
    integer(ip) :: line_info(1), info

    h = random_lines(2, 2, 1)
    t = random_real(2, 2)
    call transform_receptance(.false., no_line, t, t, no_new, line_info(:0), rcond(:0), info)
    call check(info == 0, 'no lines')
    call transform_receptance(.false., h, no_rows, t, empty, line_info, rcond, info)
    call check(info == 0 .and. line_info(1) == 0, 'no results')
    call transform_receptance(.false., no_points, no_columns, no_columns, h_new, line_info, rcond, info)
    call check(info == 0 .and. .not. maxval(abs(h_new)) > 0.0_dp, 'nothing measured gives 0')
  end subroutine nothing

  subroutine bad_lines()
    complex(dp) :: h(3, 3, 4), bad(3, 3, 4), good(2, 2, 4), h_new(2, 2, 4)
    real(dp) :: weights(2, 3), rcond(4)
    integer(ip) :: line_info(4), info

    h = random_lines(3, 3, 4)
    call difference_weights([-0.1_dp, 0.0_dp, 0.1_dp], weights)
    call transform_receptance(.false., h, weights, weights, good, line_info, rcond, info)
    bad = h
    bad(1, 3, 2) = cmplx(not_a_number(), 0.0_dp, dp)
    call transform_receptance(.false., bad, weights, weights, h_new, line_info, rcond, info)
    call check_bad_line(h_new, good, 2, -1_ip, line_info, rcond, info, 'NaN')
    bad = h
    bad(2, 2, 3) = -infinity()
    call transform_receptance(.false., bad, weights, weights, h_new, line_info, rcond, info)
    call check_bad_line(h_new, good, 3, -1_ip, line_info, rcond, info, 'Inf')
    bad = h
    bad(3, 3, 4) = huge(1.0_dp)
    call transform_receptance(.false., bad, weights, weights, h_new, line_info, rcond, info)
    call check_bad_line(h_new, good, 4, -2_ip, line_info, rcond, info, 'overflow')
  end subroutine bad_lines

  subroutine scales()
    real(dp), parameter :: factors(2) = [1.0e-150_dp, 1.0e150_dp]
    complex(dp) :: h(3, 3, 1), one(2, 2, 1), h_new(2, 2, 1)
    real(dp) :: weights(2, 3), one_weights(2, 3), rcond(1)
    integer(ip) :: line_info(1), info
    integer :: i

    h = random_lines(3, 3, 1)
    call difference_weights([-1.0_dp, 0.5_dp, 1.0_dp], one_weights)
    call transform_receptance(.false., h, one_weights, one_weights, one, line_info, rcond, info)
    do i = 1, 2
      call transform_receptance(.false., factors(i)*h, one_weights, one_weights, h_new, line_info, rcond, info)
      call check_close(h_new/factors(i), one, 1.0e-13_dp, 'scaled')
      call difference_weights(factors(i)*[-1.0_dp, 0.5_dp, 1.0_dp], weights)
      weights(2, :) = weights(2, :)*factors(i)
      call check(maxval(abs(weights - one_weights)) < 1.0e-13_dp, 'weights: scaled')
    end do
  end subroutine scales

  subroutine threads()
    integer, parameter :: lines = 3000
    complex(dp) :: h(3, 3, lines), h_new(2, 2, lines, 2)
    real(dp) :: weights(2, 3), rcond(lines)
    integer(ip) :: line_info(lines), info
    integer :: t

    h = random_lines(3, 3, lines)
    call difference_weights([-0.1_dp, 0.0_dp, 0.1_dp], weights)
    do t = 1, 2
      call set_threads(t)
      call transform_receptance(.false., h, weights, weights, h_new(:, :, :, t), line_info, rcond, info)
    end do
    call check_same(h_new(:, :, :, 1), h_new(:, :, :, 2), 'one thread and two')
  end subroutine threads
end program test_finite_difference
