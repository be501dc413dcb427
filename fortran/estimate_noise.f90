!> Noise of measured FRFs by the residual of smooth ones: parts by entry, correlation, outlying lines.
module jointfrf_estimate_noise
  use, intrinsic :: ieee_arithmetic, only: ieee_quiet_nan, ieee_value
  use jointfrf_kinds, only: dp, ip
  use jointfrf_line_noise, only: level_space, line_correlation, line_levels, prepare_levels
  use jointfrf_noise_parts, only: parts_of_lines
  use jointfrf_order_statistics, only: find_median, rising_order
  use jointfrf_status, only: info_good, info_no_memory
  implicit none
  private
  public :: estimate_noise

  !> Most of the noise power that residuals are corrected for: beyond, the correction would exceed a factor of five.
  real(dp), parameter :: most_taken = 0.8_dp
  !> Parts of the noise by entry and its variation over frequency are found in turn so often at most.
  integer, parameter :: level_turns = 10
  !> Fewer lines hardly show what a floor is constant in.
  integer, parameter :: fewest_lines = 25
  !> A floor is taken to be constant in acceleration, as accelerometers have it, if it raises the likelihood by odds of
  !> 20 to 1, unless a constant one lowers -2 log likelihood by a share of the number of squares. Smooth FRFs hide a
  !> floor of acceleration, of few lines, more than they hide a constant one.
  real(dp), parameter :: clear = 0.1_dp, clearly = 6.0_dp
  !> No residual counts more than so many times its expectation in this choice, as outlying lines have.
  real(dp), parameter :: capped = 10.0_dp

  !> Residuals with their squares, terms of the variance, and workspace.
  type :: noise_space
    complex(dp), allocatable :: rest(:, :), differences(:, :), scaled(:, :)
    real(dp), allocatable :: squares(:, :)                     !< over the floor's dependence on frequency
    real(dp), allocatable :: terms(:, :, :)                    !< likewise, (n_freq, n_entries, n_terms)
    real(dp), allocatable :: described(:, :), shape_of(:), known(:, :), line(:), work(:, :), own(:, :)
    real(dp), allocatable :: usual(:, :), factor(:, :)         !< of residuals, of differences
    integer, allocatable :: order(:, :), some(:), spare(:)
    type(level_space) :: levels
  end type noise_space

contains

  !> Noise model E|e|^2 = usual factor (relative^2 |h|^2 + floor^2 s + given_factor^2 given).
  !>
  !> s is 1 or follows `floor_shape`. Outlying lines are found first, then, without these, slow variation. If there is
  !> any, parts and it follow in turn until it stays: parts that were found without it have taken up some of it.
  !> robust           for weights: errors of smooth FRFs that are not the last, at peaks and antiresonances, are not
  !>                  taken for noise, nor for outlying lines if differences show these
  !> floor_shape      dependence of floor^2 on frequency if the floor is not constant, shape (n_freq)
  !> h, smooth        measured and smooth FRFs, shape (n_freq, n_entries)
  !> share            part of the noise power of each entry that smoothing has taken up, shape (n_entries)
  !> given            variance that is known up to a factor, shape (n_freq, n_entries); all 0 if none is
  !> first, second    entries that are the same FRF measured twice, shape (n_pairs)
  !> inflation        lines that carry the noise of one independent line, as far as they are known
  !> parts            relative, floor, and factor of what is given, shape (n_entries, 3)
  !> variance         shape (n_freq, n_entries)
  !> usual, factor    as in `line_levels`
  !> is_shaped        1 if s follows it, 0 if s is 1
  !> found            lines that carry this noise of one independent line
  subroutine estimate_noise(robust, floor_shape, h, smooth, share, given, first, second, inflation, parts, variance, &
                            usual, factor, is_shaped, found, info)
    logical, intent(in) :: robust
    real(dp), contiguous, intent(in) :: floor_shape(:), share(:), given(:, :)
    complex(dp), contiguous, intent(in) :: h(:, :), smooth(:, :)
    integer(ip), contiguous, intent(in) :: first(:), second(:)
    real(dp), intent(in) :: inflation
    real(dp), contiguous, intent(out) :: parts(:, :), variance(:, :), usual(:), factor(:)
    integer(ip), intent(out) :: is_shaped
    real(dp), intent(out) :: found
    integer(ip), intent(out) :: info
    type(noise_space) :: space
    logical :: of_acceleration
    integer :: turn, e, stat

    call prepare(size(h, 1), size(h, 2), size(first), any(given > 0.0_dp), space, stat)
    if (stat /= 0) then
      info = info_no_memory
      return
    end if
    info = info_good
    found = 1.0_dp
    is_shaped = 0_ip
    if (size(h) == 0) then
      parts(:, :) = 0.0_dp
      usual(:) = 1.0_dp
      factor(:) = 1.0_dp
      return
    end if
    call take_residuals(h, smooth, share, first, second, inflation, space)
    call choose_floor(floor_shape, given, space, of_acceleration)
    is_shaped = merge(1_ip, 0_ip, of_acceleration)
    usual(:) = 1.0_dp
    factor(:) = 1.0_dp
    do turn = 0, level_turns + 1
      call describe(robust .or. turn == 0, usual, factor, parts, space)
      call find_levels(robust, first, second, inflation, space)
      factor(:) = maxval(space%factor, 2)
      associate (slow => space%usual(:, merge(1, 2, .not. robust .or. size(first) == 0)))
        if (turn > 0 .and. all(abs(slow - 1.0_dp) <= 0.0_dp)) exit
        if (turn > 0 .and. turn <= level_turns) usual(:) = usual*slow
      end associate
    end do
    do e = 1, size(h, 2)
      variance(:, e) = space%described(:, e)*factor
    end do
    parts(:, :) = sqrt(parts)
    call find_inflation(h, smooth, share, first, second, variance, factor, space, found)
  end subroutine estimate_noise

  subroutine prepare(n_freq, m, n_pairs, is_given, space, stat)
    integer, intent(in) :: n_freq, m, n_pairs
    logical, intent(in) :: is_given
    type(noise_space), intent(inout) :: space
    integer, intent(out) :: stat
    integer :: n_terms

    n_terms = merge(3, 2, is_given)
    allocate (space%rest(n_freq, m), space%differences(n_freq, n_pairs), space%scaled(n_freq, max(m, n_pairs)), &
              space%squares(n_freq, m), space%terms(n_freq, m, n_terms), space%described(n_freq, m), &
              space%shape_of(n_freq), space%known(n_freq, max(m, n_pairs)), space%line(n_freq), &
              space%work(n_freq, n_terms + 1), space%own(n_freq, 3), space%usual(n_freq, 2), space%factor(n_freq, 2), &
              space%order(n_freq, m), space%some(n_freq), space%spare(n_freq), stat=stat)
    if (stat == 0) call prepare_levels(n_freq, space%levels, stat)
  end subroutine prepare

  !> Measured minus smooth, with what smoothing has taken up, and differences of FRFs that were measured twice.
  pure subroutine take_residuals(h, smooth, share, first, second, inflation, space)
    complex(dp), intent(in) :: h(:, :), smooth(:, :)
    real(dp), intent(in) :: share(:), inflation
    integer(ip), intent(in) :: first(:), second(:)
    type(noise_space), intent(inout) :: space
    integer :: e, k

    do e = 1, size(h, 2)
      space%rest(:, e) = (h(:, e) - smooth(:, e))/sqrt(1.0_dp - min(inflation*share(e), most_taken))
      space%squares(:, e) = real(space%rest(:, e))**2 + aimag(space%rest(:, e))**2
      space%terms(:, e, 1) = real(smooth(:, e))**2 + aimag(smooth(:, e))**2
      space%terms(:, e, 2) = 1.0_dp
    end do
    do k = 1, size(first)
      space%differences(:, k) = h(:, first(k)) - h(:, second(k))
    end do
  end subroutine take_residuals

  !> Decide by the likelihood what the floor is constant in, divide squares and terms by its dependence on frequency,
  !> as lines of one size then have one variance, and sort lines by the first term.
  pure subroutine choose_floor(floor_shape, given, space, of_acceleration)
    real(dp), contiguous, intent(in) :: floor_shape(:), given(:, :)
    type(noise_space), intent(inout) :: space
    logical, intent(out) :: of_acceleration
    real(dp) :: loss(3), median
    integer :: e

    loss = 0.0_dp
    space%shape_of(:) = floor_shape
    do e = 1, size(space%squares, 2)
      call rising_order(space%terms(:, e, 1), space%order(:, e), space%spare)
      if (size(floor_shape) < fewest_lines) cycle
      space%line(:) = space%squares(:, e)/max(space%terms(:, e, 1), tiny(median))
      call find_median(space%line, median)
      space%own(:, 3) = median/log(2.0_dp)*space%terms(:, e, 1)
      loss(1) = loss(1) + capped_loss(space%squares(:, e), space%own(:, 3))
      call describe_with_floor(e, .false., space, loss(2))
      call describe_with_floor(e, .true., space, loss(3))
    end do
    of_acceleration = size(floor_shape) >= fewest_lines &
                      .and. loss(3) < min(loss(1) - clearly, loss(2) + clear*size(space%squares))
    if (.not. of_acceleration) space%shape_of(:) = 1.0_dp
    do e = 1, size(space%squares, 2)
      if (size(space%terms, 3) > 2) space%terms(:, e, 3) = given(:, e)/space%shape_of
      if (.not. of_acceleration) cycle
      space%squares(:, e) = space%squares(:, e)/space%shape_of
      space%terms(:, e, 1) = space%terms(:, e, 1)/space%shape_of
      call rising_order(space%terms(:, e, 1), space%order(:, e), space%spare)
    end do
  end subroutine choose_floor

  !> Add -2 log likelihood of an entry with a floor that is constant, or of acceleration.
  pure subroutine describe_with_floor(e, of_acceleration, space, loss)
    integer, intent(in) :: e
    logical, intent(in) :: of_acceleration
    type(noise_space), intent(inout) :: space
    real(dp), intent(inout) :: loss
    real(dp) :: parts(2)

    space%line(:) = 1.0_dp
    space%some(:) = space%order(:, e)
    if (of_acceleration) then
      space%line(:) = space%shape_of
      space%own(:, 1) = space%terms(:, e, 1)/space%line
      call rising_order(space%own(:, 1), space%some, space%spare)
    end if
    space%own(:, 1) = space%terms(:, e, 1)/space%line
    space%own(:, 2) = 1.0_dp
    space%own(:, 3) = space%squares(:, e)/space%line
    call parts_of_lines(.true., space%own(:, 3), space%own(:, :2), space%some, space%work, parts)
    space%own(:, 3) = (parts(1)*space%own(:, 1) + parts(2))*space%line
    loss = loss + capped_loss(space%squares(:, e), space%own(:, 3))
  end subroutine describe_with_floor

  !> -2 log likelihood; no square counts more than outlying lines may.
  pure function capped_loss(squares, variance) result(loss)
    real(dp), intent(in) :: squares(:), variance(:)
    real(dp) :: loss, v
    integer :: k

    loss = 0.0_dp
    do k = 1, size(squares)
      v = max(variance(k), tiny(v))
      loss = loss + 2.0_dp*(log(v) + min(squares(k)/v, capped))
    end do
  end function capped_loss

  !> Squares of the parts by lines that are not outlying, and the variance without the factor of outlying lines.
  pure subroutine describe(robust, usual, factor, parts, space)
    logical, intent(in) :: robust
    real(dp), intent(in) :: usual(:), factor(:)
    real(dp), intent(out) :: parts(:, :)
    type(noise_space), intent(inout) :: space
    real(dp) :: own(size(space%terms, 3))
    integer :: e, k, line, n

    parts(:, :) = 0.0_dp
    do e = 1, size(space%squares, 2)
      n = 0
      do k = 1, size(usual)
        line = space%order(k, e)
        if (factor(line) > 1.0_dp) cycle
        n = n + 1
        space%some(n) = line
      end do
      space%line(:) = space%squares(:, e)/usual
      call parts_of_lines(robust, space%line, space%terms(:, e, :), space%some(:n), space%work, own)
      parts(e, :size(own)) = own
      do k = 1, size(usual)
        space%described(k, e) = max(sum(own*space%terms(k, e, :))*space%shape_of(k)*usual(k), tiny(own))
      end do
    end do
  end subroutine describe

  !> Variation over the lines of residuals, column 1, and of differences, column 2, by the variance described.
  pure subroutine find_levels(robust, first, second, inflation, space)
    logical, intent(in) :: robust
    integer(ip), intent(in) :: first(:), second(:)
    real(dp), intent(in) :: inflation
    type(noise_space), intent(inout) :: space
    integer :: e, n_pairs

    n_pairs = size(first)
    space%usual(:, :) = 1.0_dp
    space%factor(:, :) = 1.0_dp
    if (n_pairs > 0) then
      call scale_differences(first, second, space%described, space)
      call line_levels(space%scaled(:, :n_pairs), inflation, .false., space%levels, space%usual(:, 2), &
                       space%factor(:, 2))
    end if
    if (robust .and. n_pairs > 0) return
    do e = 1, size(space%rest, 2)
      space%scaled(:, e) = space%rest(:, e)/sqrt(space%described(:, e))
    end do
    call line_levels(space%scaled(:, :size(space%rest, 2)), inflation, .true., space%levels, space%usual(:, 1), &
                     space%factor(:, 1))
  end subroutine find_levels

  pure subroutine scale_differences(first, second, variance, space)
    integer(ip), intent(in) :: first(:), second(:)
    real(dp), intent(in) :: variance(:, :)
    type(noise_space), intent(inout) :: space
    integer :: k

    do k = 1, size(first)
      space%scaled(:, k) = space%differences(:, k)/sqrt(variance(:, first(k)) + variance(:, second(k)))
    end do
  end subroutine scale_differences

  !> Lines that carry the noise of one independent line, by differences, or else by residuals; without outlying lines.
  pure subroutine find_inflation(h, smooth, share, first, second, variance, factor, space, inflation)
    complex(dp), intent(in) :: h(:, :), smooth(:, :)
    real(dp), intent(in) :: share(:), variance(:, :), factor(:)
    integer(ip), intent(in) :: first(:), second(:)
    type(noise_space), intent(inout) :: space
    real(dp), intent(out) :: inflation
    real(dp) :: taken
    integer :: e, line, n

    n = size(first)
    taken = 0.0_dp
    if (n > 0) then
      call scale_differences(first, second, variance, space)
    else
      n = size(h, 2)
      taken = sum(share)/n
      do e = 1, n
        space%scaled(:, e) = (h(:, e) - smooth(:, e))/sqrt(variance(:, e))
      end do
    end if
    do line = 1, size(factor)
      if (factor(line) > 1.0_dp) space%scaled(line, :n) = cmplx(ieee_value(taken, ieee_quiet_nan), 0.0_dp, dp)
    end do
    call line_correlation(space%scaled(:, :n), taken, space%known(:, :n), space%line, inflation)
  end subroutine find_inflation
end module jointfrf_estimate_noise
