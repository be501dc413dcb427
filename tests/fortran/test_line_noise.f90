!> Correlation between lines against sums in quadruple precision; outlying lines and slow variation that are made.
program test_line_noise
  use testing, only: check, check_close, dp, finish, normal, not_a_number, qp, seed
  use jointfrf_line_noise, only: level_space, line_correlation, line_levels, prepare_levels
  implicit none
  integer, parameter :: n_freq = 400, n_entries = 3

  call seed(5)
  call correlation(1, .false.)
  call correlation(6, .false.)
  call correlation(6, .true.)
  call independent_lines()
  call few_lines()
  call outlying_lines()
  call slow_variation()
  call missed_mode()
  call finish('line_noise')

contains

  function circular(n, m) result(noise)
    integer, intent(in) :: n, m
    complex(dp) :: noise(n, m)
    integer :: i, j

    do j = 1, m
      do i = 1, n
        noise(i, j) = normal()
      end do
    end do
  end function circular

  !> Moving means, some lines missing, one number far too large, part of the noise taken up.
  subroutine correlation(width, missing)
    integer, intent(in) :: width
    logical, intent(in) :: missing
    complex(dp) :: noise(n_freq, n_entries), raw(n_freq + width, n_entries), cut(n_freq, n_entries)
    real(dp) :: known_numbers(n_freq, n_entries), work(n_freq)
    real(qp) :: x(2, n_freq, n_entries), pairs, rho, power, total, limit
    real(dp) :: found, sizes(n_freq)
    real(dp), parameter :: share = 0.02_dp
    integer :: i, e, lag, known

    raw = circular(n_freq + width, n_entries)
    do i = 1, n_freq
      noise(i, :) = sum(raw(i:i + width - 1, :), 1)/sqrt(real(width, dp))
    end do
    noise(7, 2) = 100*noise(7, 2)
    if (missing) noise(50:60, :) = cmplx(not_a_number(), 0.0_dp, dp)
    if (missing) noise(80, 1) = cmplx(0.0_dp, not_a_number(), dp)
    cut = noise
    call line_correlation(cut, share, known_numbers, work, found)
    do e = 1, n_entries
      sizes = abs(noise(:, e))
      known = count(sizes <= huge(sizes))
      do i = 1, n_freq
        x(:, i, e) = 0
        if (.not. sizes(i) <= huge(sizes)) cycle
        x(:, i, e) = [real(noise(i, e), qp), real(aimag(noise(i, e)), qp)]
        if (sizes(i) > 3*middle(sizes, known)) x(:, i, e) = x(:, i, e)*3*middle(sizes, known)/sizes(i)
      end do
    end do
    power = sum(x**2)/count(abs(noise) <= huge(sizes))
    limit = 2.5_qp/sqrt(real(count(abs(noise) <= huge(sizes)), qp))
    total = 0
    do lag = 1, n_freq/4 - 1
      pairs = count(abs(noise(:n_freq - lag, :)) <= huge(sizes) .and. abs(noise(lag + 1:, :)) <= huge(sizes))
      rho = sum(x(:, :n_freq - lag, :)*x(:, lag + 1:, :))/pairs/power*(1 - share) + share
      if (rho < limit) exit
      total = total + rho*(1 - real(lag, qp)/n_freq)
    end do
    call check_close(found, real(max(1.0_qp, 1 + 2*total), dp), 1.0e-12_dp, 'correlation by its definition')
    if (width > 1) call check(found > 4 .and. found < 12, 'correlation of moving means')
  end subroutine correlation

  !> Median of the numbers that are finite.
  function middle(sizes, known) result(median)
    real(dp), intent(in) :: sizes(:)
    integer, intent(in) :: known
    real(dp) :: median, low, high
    integer :: i

    low = 0
    high = huge(high)
    do i = 1, size(sizes)
      if (count(sizes <= sizes(i)) >= (known + 1)/2) high = min(high, sizes(i))
      if (count(sizes >= sizes(i)) >= (known + 1)/2) low = max(low, sizes(i))
    end do
    median = (low + high)/2
  end function middle

  subroutine levels(noise, inflation, is_residual, usual, factor)
    complex(dp), contiguous, intent(in) :: noise(:, :)
    real(dp), intent(in) :: inflation
    logical, intent(in) :: is_residual
    real(dp), contiguous, intent(out) :: usual(:), factor(:)
    type(level_space) :: space
    integer :: stat

    call prepare_levels(size(noise, 1), space, stat)
    call check(stat == 0, 'memory')
    call line_levels(noise, inflation, is_residual, space, usual, factor)
  end subroutine levels

  subroutine independent_lines()
    complex(dp) :: noise(n_freq, n_entries)
    real(dp) :: found, usual(n_freq), factor(n_freq), known(n_freq, n_entries)
    integer :: k, outlying, large

    outlying = 0
    large = 0
    do k = 1, 50
      noise = circular(n_freq, n_entries)
      call levels(noise, 1.0_dp, .true., usual, factor)
      outlying = outlying + count(factor > 1)
      call check(all(abs(usual - 1) <= 0), 'noise without variation')
      call line_correlation(noise, 0.0_dp, known, usual, found)
      if (found > 1.05_dp) large = large + 1
    end do
    call check(large < 10, 'correlation of independent lines')
    call check(outlying < 15, 'outlying lines by chance')
  end subroutine independent_lines

  subroutine few_lines()
    complex(dp) :: noise(15, 1)
    real(dp) :: found, usual(15), factor(15), known(15, 1)

    noise = 1
    call line_correlation(noise, 0.0_dp, known, usual, found)
    call check(abs(found - 1) <= 0, 'correlation of few lines')
    call levels(noise, 1.0_dp, .false., usual, factor)
    call check(all(abs(factor - 1) <= 0) .and. all(abs(usual - 1) <= 0), 'levels of few equal lines')
    call levels(noise(:1, :), 1.0_dp, .false., usual(:1), factor(:1))
    call check(abs(factor(1) - 1) <= 0, 'levels of one line')
  end subroutine few_lines

  !> Of noise with one size, the factor is the power of a line.
  subroutine outlying_lines()
    complex(dp) :: noise(n_freq, n_entries)
    real(dp) :: usual(n_freq), factor(n_freq), expected(n_freq)

    noise = exp(cmplx(0.0_dp, real(circular(n_freq, n_entries)), dp))
    noise([1, 120, 121, 400], :) = 5*noise([1, 120, 121, 400], :)
    expected = 1
    expected([1, 120, 121, 400]) = 25
    call levels(noise, 1.0_dp, .true., usual, factor)
    call check(all(abs(factor - expected) < 1.0e-12_dp), 'outlying lines')
  end subroutine outlying_lines

  subroutine slow_variation()
    complex(dp) :: noise(n_freq, n_entries)
    real(dp) :: usual(n_freq), factor(n_freq)

    noise = exp(cmplx(0.0_dp, real(circular(n_freq, n_entries)), dp))
    noise(251:, :) = 10*noise(251:, :)
    call levels(noise, 1.0_dp, .true., usual, factor)
    call check(all(abs(usual(:225) - 1) < 1.0e-12_dp), 'low noise')
    call check(all(abs(usual(276:) - 100) < 1.0e-10_dp), 'high noise')
  end subroutine slow_variation

  !> A long run counts if it jumps from line to line, not if it goes smoothly; in differences both count.
  subroutine missed_mode()
    complex(dp) :: noise(n_freq, n_entries)
    real(dp) :: usual(n_freq), factor(n_freq)
    integer :: i

    noise = circular(n_freq, n_entries)
    noise(100:109, :) = 30*circular(10, n_entries)
    do i = 200, 209
      noise(i, :) = 30*exp(cmplx(0.0_dp, 0.2_dp*i, dp))
    end do
    call levels(noise, 1.0_dp, .true., usual, factor)
    call check(all(factor(100:109) > 1), 'lines that jump')
    call check(all(factor(200:209) <= 1), 'a mode that is missed')
    call levels(noise, 1.0_dp, .false., usual, factor)
    call check(all(factor(200:209) > 1), 'lines of differences')
  end subroutine missed_mode
end program test_line_noise
