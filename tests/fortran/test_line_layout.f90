!> Storage order, blocks and the check for NaN and Inf, on matrices that are not square.
program test_line_layout
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use testing, only: check, check_same, dp, finish, infinity, not_a_number, random_lines, seed, transposed
  use jointfrf_line_layout, only: all_finite, load, store, store_nan, subtract, take_block
  implicit none
  complex(dp) :: a(3, 5, 1), b(3, 5, 1), m(3, 5, 1), t(5, 3, 1), block(2, 3, 1), turned(3, 2, 1)

  call seed(1)
  a = random_lines(3, 5, 1)
  b = random_lines(3, 5, 1)

  call load(.false., a(:, :, 1), m(:, :, 1))
  call check_same(m, a, 'load')
  call load(.true., a(:, :, 1), t(:, :, 1))
  call check_same(t, transposed(a), 'load transposed')
  call store(.false., b(:, :, 1), m(:, :, 1))
  call check_same(m, b, 'store')
  call store(.true., t(:, :, 1), m(:, :, 1))
  call check_same(m, a, 'store transposed')
  call subtract(a(:, :, 1), b(:, :, 1), m(:, :, 1))
  call check_same(m, a - b, 'subtract')

  call take_block(.false., 1.0_dp, a(:, :, 1), 1, 2, block(:, :, 1))
  call check_same(block, a(2:3, 3:5, :), 'block')
  call take_block(.true., -1.0_dp, a(:, :, 1), 1, 2, turned(:, :, 1))
  call check_same(turned, -transposed(a(2:3, 3:5, :)), 'block transposed and negative')

  call check(all_finite(a(:, :, 1)), 'finite')
  call check(all_finite(a(:, :0, 1)), 'empty is finite')
  m = huge(1.0_dp)
  call check(all_finite(m(:, :, 1)), 'the largest number is finite')
  m(3, 5, 1) = cmplx(0.0_dp, not_a_number(), dp)
  call check(.not. all_finite(m(:, :, 1)), 'NaN in the last imaginary part')
  m(3, 5, 1) = cmplx(-infinity(), 0.0_dp, dp)
  call check(.not. all_finite(m(:, :, 1)), 'Inf in the last real part')
  call store_nan(m(:, :, 1))
  call check(all(ieee_is_nan(real(m, dp)) .and. ieee_is_nan(aimag(m))), 'store_nan')
  call finish('line_layout')
end program test_line_layout
