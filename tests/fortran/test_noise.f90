!> Noise numbers are those of the published generator and of the formula, and depend on what they may depend on only.
program test_noise
  use, intrinsic :: iso_fortran_env, only: int64
  use testing, only: check, check_same, dp, finish, infinity, ip, not_a_number, qp, random_lines, seed, set_threads, &
    transposed
  use jointfrf, only: jf_pollute
  use jointfrf_engine, only: engine_automatic, engine_lapack, engine_plain, engine_v4, find_kernels, set_engine
  use jointfrf_lanes, only: lane_kernels, lanes
  use jointfrf_noise, only: make_noise, noise_model, pollute
  implicit none

  !> A kind of noise: its letter, E|e|^2 and E|e|^4 at level 1, whether all phases are equally likely, or e is real.
  type :: noise_kind
    character :: letter
    real(dp) :: power, fourth
    logical :: is_circular
  end type noise_kind

  type(noise_kind), parameter :: kinds(*) = [ &
    noise_kind('C', 1.0_dp, 2.0_dp, .true.), noise_kind('P', 2.0_dp, 8.0_dp, .true.), &
    noise_kind('N', 1.0_dp, 3.0_dp, .false.), noise_kind('U', 1.0_dp/3.0_dp, 0.2_dp, .false.), &
    noise_kind('S', 1.0_dp, 1.8_dp, .false.)]
  integer(ip), parameter :: some_seed(2) = [-5_ip, 77_ip]
  integer(ip) :: info, engine

  call seed(21)
  do engine = engine_lapack, engine_v4
    call set_engine(engine, info)
    if (info /= 0) cycle                   ! this processor does not have it
    call known_answers()
    call formula()
    call definition()
  end do
  call same_bits()
  call moments()
  call shared()
  call references()
  call scales()
  call arguments()
  call finish('noise')

contains

  !> The known answers of Random123 for threefry2x64 with 20 rounds.
  subroutine known_answers()
    integer(int64), parameter :: pi(2) = [int(z'243F6A8885A308D3', int64), int(z'13198A2E03707344', int64)]
    integer(int64) :: full, low, high

    full = -1_int64
    call answer([0_int64, 0_int64], [0_int64, 0_int64], 'C2B6E3A8C2C69865', '6F81ED42F350084D')
    call answer([full, full], [full, full], 'E02CB7C4D95D277A', 'D06633D0893B8B68')
    low = ior(shiftl(int(z'A4093822', int64), 32), int(z'299F31D0', int64))
    high = int(z'082EFA98EC4E6C89', int64)
    call answer(pi, [low, high], '263C7D30BB0F0AF1', '56BE8361D3311526')
  end subroutine known_answers

  subroutine answer(counter, key, first, second)
    integer(int64), intent(in) :: counter(2), key(2)
    character(len=16), intent(in) :: first, second
    type(lane_kernels) :: kernels
    integer(int64) :: low(lanes, 3), high(lanes), words(lanes, 2, 3)
    character(len=16) :: text(2)
    logical :: found

    call find_kernels(kernels, found, info)
    low = 5
    low(:, 2) = counter(1)
    high = counter(2)
    high(3) = counter(2) + 1
    call kernels%random_words(3, key, low, high, words)
    write (text, '(z16.16)') words(4, :, 2)
    call check(text(1) == first .and. text(2) == second, 'known answer '//first)
    call check(all(words(1, :, 2) == words(8, :, 2)) .and. all(words(3, :, 2) /= words(4, :, 2)) &
               .and. all(words(1, :, 1) /= words(1, :, 2)), 'a number depends on its own counter')
  end subroutine answer

  !> Box and Muller in quadruple precision from the same words.
  subroutine formula()
    integer, parameter :: n = 2001
    type(lane_kernels) :: kernels
    integer(int64) :: key(2), low(lanes, n), high(lanes), words(lanes, 2, n)
    real(dp) :: x(lanes, 2, n), uniform(lanes, 2, n)
    real(qp) :: u, t, r, worst, worst_uniform
    logical :: found
    integer :: i, l

    call find_kernels(kernels, found, info)
    key = [77_int64, -9_int64]
    low = reshape([(int(i, int64), i=1, lanes*n)], [lanes, n])
    high = [(int(l, int64)**15, l=1, lanes)]
    call kernels%random_words(n, key, low, high, words)
    call kernels%normals(n, 0.5_dp, key, low, high, x)
    call kernels%uniforms(n, 3.0_dp, key, low, high, uniform)
    worst = 0
    worst_uniform = 0
    do i = 1, n
      do l = 1, lanes
        u = real(2*real(shiftr(words(l, 1, i), 1), qp) + 1, dp)/2.0_qp**64
        t = (2*real(shiftr(words(l, 1, i), 13), qp) + 1)/2.0_qp**52 - 0.5_qp
        worst_uniform = max(worst_uniform, abs(uniform(l, 1, i) - 6*t), abs(real(uniform(l, 2, i), qp)))
        t = (2*real(shiftr(words(l, 2, i), 13), qp) + 1)/2.0_qp**52 - 0.5_qp
        r = sqrt(-log(u))
        t = t*8*atan(1.0_qp)
        worst = max(worst, abs(x(l, 1, i) - r*cos(t))/r, abs(x(l, 2, i) - r*sin(t))/r)
      end do
    end do
    call check(worst < 4.0e-15_qp, 'normal numbers to 4e-15 of their modulus')
    call check(worst_uniform < 1.0e-15_qp, 'uniform numbers to 1e-15')
  end subroutine formula

  !> Entry (i, j) of line f in realisation r has the counter (entry from 0 row by row, line from 0; r), whoever asks.
  subroutine definition()
    integer, parameter :: lines = 11
    type(lane_kernels) :: kernels
    complex(dp) :: h(2, 3, lines), polluted(2, 3, lines*2), e, expected
    integer(int64) :: low(lanes, 1), high(lanes), key(2)
    real(dp) :: x(lanes, 2, 1)
    real(dp) :: worst
    logical :: found
    integer :: i, j, f, r

    call find_kernels(kernels, found, info)
    h = random_lines(2, 3, lines)
    key = [ior(shiftl(77_int64, 32), 2_int64**32 - 5_int64), 0_int64]
    call pollute(.false., make_noise('C', 'E', .false., 1, 0.25_dp, some_seed), 4_ip, 2_ip, h, polluted, info)
    worst = 0
    do r = 0, 1
      do f = 1, lines
        do j = 1, 3
          do i = 1, 2
            low = 3*(i - 1) + j - 1 + shiftl(int(f - 1, int64), 32)
            high = 4 + r
            call kernels%normals(1, 0.5_dp, key, low, high, x)
            e = cmplx(x(3, 1, 1), x(3, 2, 1), dp)
            expected = h(i, j, f)*(1 + 0.25_dp*e)
            worst = max(worst, abs(polluted(i, j, r*lines + f) - expected)/abs(expected))
          end do
        end do
      end do
    end do
    call check(info == 0 .and. worst < 1.0e-15_dp, 'pollution by definition')
  end subroutine definition

  !> Every kind on all engines, by both orders of storage, on one thread and two, in one call or several.
  subroutine same_bits()
    integer, parameter :: lines = 403, count = 5
    complex(dp) :: h(3, 3, lines), one(3, 3, lines*count), other(3, 3, lines*count)
    type(noise_model) :: noise
    character(len=3) :: name
    integer :: k, r
    logical :: plain

    h = random_lines(3, 3, lines)
    do k = 1, size(kinds)
      noise = make_noise(kinds(k)%letter, 'L', .false., 1, 0.1_dp, some_seed)
      name = ' '//kinds(k)%letter//' '
      call set_engine(engine_plain, info)
      call set_threads(1)
      call pollute(.false., noise, 2_ip, int(count, ip), h, one, info)
      do engine = engine_automatic, engine_v4
        call set_engine(engine, info)
        if (info /= 0) cycle
        call set_threads(2)
        call pollute(.false., noise, 2_ip, int(count, ip), h, other, info)
        call check_same(other, one, 'same bits on every engine and on two threads'//name)
      end do
      call pollute(.true., noise, 2_ip, int(count, ip), transposed(h), other, info)
      call check_same(transposed(other), one, 'same bits by either order of storage'//name)
      do r = 0, count - 1
        call pollute(.false., noise, int(2 + r, ip), 1_ip, h, other(:, :, r*lines + 1:(r + 1)*lines), info)
      end do
      call check_same(other, one, 'same bits one by one'//name)
      noise%key(1) = noise%key(1) + 1
      call pollute(.false., noise, 2_ip, int(count, ip), h, other, info)
      plain = any(abs(other - one) <= 0.0_dp)
      call check(.not. plain, 'another seed, other noise'//name)
    end do
    call set_engine(engine_automatic, info)
  end subroutine same_bits

  !> No mean, the second and fourth moment of the kind, and its phases.
  subroutine moments()
    integer, parameter :: n = 100000
    complex(dp) :: h(1, 1, n), e(1, 1, n)
    type(noise_kind) :: kind
    integer :: k
    real(dp) :: tolerance

    h = 1.0_dp
    tolerance = 6/sqrt(real(n, dp))
    do k = 1, size(kinds)
      kind = kinds(k)
      call pollute(.false., make_noise(kind%letter, 'E', .false., 1, 1.0_dp, some_seed), 0_ip, 1_ip, h, e, info)
      e = e - h
      call check(abs(sum(e))/n < tolerance*sqrt(kind%power), 'no mean '//kind%letter)
      call check(abs(sum(abs(e)**2)/n - kind%power) < 2*tolerance*kind%power, 'power '//kind%letter)
      call check(abs(sum(abs(e)**4)/n - kind%fourth) < 5*tolerance*kind%fourth, 'fourth moment '//kind%letter)
      if (kind%is_circular) then
        call check(abs(sum(e**2))/n < 2*tolerance*kind%power, 'circular '//kind%letter)
      else
        call check(all(abs(aimag(e)) <= 0.0_dp), 'real '//kind%letter)
      end if
      call check(abs(sum(e(1, 1, 2:)*conjg(e(1, 1, :n - 1))))/n < tolerance*kind%power, &
                 'lines are independent '//kind%letter)
    end do
  end subroutine moments

  !> Reciprocal noise and blocks.
  subroutine shared()
    complex(dp) :: h(4, 4, 9), e(4, 4, 9)
    integer :: i, j

    h = 1.0_dp
    call pollute(.true., make_noise('C', 'E', .true., 1, 1.0_dp, some_seed), 0_ip, 1_ip, h, e, info)
    call check_same(e, transposed(e), 'reciprocal')
    call pollute(.false., make_noise('C', 'E', .false., 2, 1.0_dp, some_seed), 0_ip, 1_ip, h, e, info)
    do j = 1, 4
      do i = 1, 4
        call check_same(e(i:i, j:j, :), e((i + 1)/2*2:(i + 1)/2*2, (j + 1)/2*2:(j + 1)/2*2, :), 'block')
      end do
    end do
    call check(all(abs(e(1, 1, :) - e(3, 1, :)) > 0) .and. all(abs(e(1, 3, :) - e(3, 1, :)) > 0), 'other blocks')
    call pollute(.false., make_noise('C', 'E', .true., 2, 1.0_dp, some_seed), 0_ip, 1_ip, h, e, info)
    call check_same(e(1:2, 3:4, :), e(3:4, 1:2, :), 'reciprocal blocks')
  end subroutine shared

  !> The level refers to the entry, to the largest of the line, or to the largest of the spectrum.
  subroutine references()
    integer, parameter :: lines = 10
    complex(dp) :: h(2, 2, lines), unit(2, 2, lines), e(2, 2, lines), polluted(2, 2, lines), expected(2, 2, lines)
    integer :: i

    h = random_lines(2, 2, lines)
    unit = 1.0_dp
    call pollute(.false., make_noise('C', 'E', .false., 1, 0.5_dp, some_seed), 0_ip, 1_ip, unit, e, info)
    e = e - unit
    call pollute(.false., make_noise('C', 'E', .false., 1, 0.5_dp, some_seed), 0_ip, 1_ip, h, polluted, info)
    call check(all(abs(polluted - h*(1 + e)) < 1.0e-14_dp), 'relative to the entry')
    call pollute(.false., make_noise('C', 'L', .false., 1, 0.5_dp, some_seed), 0_ip, 1_ip, h, polluted, info)
    do i = 1, lines
      expected(:, :, i) = h(:, :, i) + e(:, :, i)*maxval(abs(h(:, :, i)))
    end do
    call check(all(abs(polluted - expected) < 1.0e-14_dp), 'relative to the line')
    call pollute(.false., make_noise('C', 'S', .false., 1, 0.5_dp, some_seed), 0_ip, 1_ip, h, polluted, info)
    call check(all(abs(polluted - (h + e*maxval(abs(h)))) < 1.0e-14_dp), 'relative to the spectrum')
    call pollute(.false., make_noise('C', 'S', .false., 1, 0.0_dp, some_seed), 0_ip, 1_ip, h, polluted, info)
    call check_same(polluted, h, 'no level, no noise')
  end subroutine references

  !> Receptances of any unit, and lines that hold NaN.
  subroutine scales()
    complex(dp) :: h(2, 2, 9), polluted(2, 2, 9), scaled(2, 2, 9)
    type(noise_model) :: noise

    h = random_lines(2, 2, 9)
    noise = make_noise('C', 'S', .false., 1, 0.5_dp, some_seed)
    call pollute(.false., noise, 0_ip, 1_ip, h, polluted, info)
    call pollute(.false., noise, 0_ip, 1_ip, h*2.0_dp**(-900), scaled, info)
    call check_same(scaled*2.0_dp**900, polluted, 'tiny receptances')
    call pollute(.false., noise, 0_ip, 1_ip, h*2.0_dp**900, scaled, info)
    call check_same(scaled*2.0_dp**(-900), polluted, 'huge receptances')
    h(1, 1, 4) = not_a_number()
    h(2, 1, 5) = infinity()
    call pollute(.false., make_noise('C', 'L', .false., 1, 0.5_dp, some_seed), 0_ip, 1_ip, h, polluted, info)
    call check(.not. abs(polluted(1, 1, 4)) <= huge(1.0_dp) .and. .not. abs(polluted(2, 1, 5)) <= huge(1.0_dp), &
               'NaN stays')
    call check(count(abs(polluted) <= huge(1.0_dp)) == size(h) - 2, 'and spoils nothing else')
  end subroutine scales

  subroutine arguments()
    complex(dp) :: h(2, 4, 3), polluted(2, 4, 3)

    h = 1.0_dp
    call refused(-1, 'X', 'C', 'E', 0, 1, 0.1_dp, 2, 4, 3, 0, 1)
    call refused(-2, 'N', 'Q', 'E', 0, 1, 0.1_dp, 2, 4, 3, 0, 1)
    call refused(-3, 'N', 'C', 'Q', 0, 1, 0.1_dp, 2, 4, 3, 0, 1)
    call refused(-4, 'N', 'C', 'E', 1, 1, 0.1_dp, 2, 4, 3, 0, 1)
    call refused(-4, 'N', 'C', 'E', 2, 1, 0.1_dp, 2, 4, 3, 0, 1)
    call refused(-5, 'N', 'C', 'E', 0, 0, 0.1_dp, 2, 4, 3, 0, 1)
    call refused(-5, 'N', 'C', 'E', 0, 4, 0.1_dp, 2, 4, 3, 0, 1)
    call refused(-6, 'N', 'C', 'E', 0, 1, -0.1_dp, 2, 4, 3, 0, 1)
    call refused(-6, 'N', 'C', 'E', 0, 1, not_a_number(), 2, 4, 3, 0, 1)
    call refused(-8, 'N', 'C', 'E', 0, 1, 0.1_dp, -2, 4, 3, 0, 1)
    call refused(-9, 'N', 'C', 'E', 0, 1, 0.1_dp, 2, -4, 3, 0, 1)
    call refused(-10, 'N', 'C', 'E', 0, 1, 0.1_dp, 2, 4, -3, 0, 1)
    call refused(-11, 'N', 'C', 'E', 0, 1, 0.1_dp, 2, 4, 3, -1, 1)
    call refused(-12, 'N', 'C', 'E', 0, 1, 0.1_dp, 2, 4, 3, 0, -1)
    call refused(-12, 'N', 'C', 'E', 0, 1, 0.1_dp, 2, 4, 3, huge(0) - 3, 5)
    call jf_pollute('n', 'c', 'e', 0_ip, 2_ip, 0.1_dp, some_seed, 2_ip, 4_ip, 3_ip, 0_ip, 1_ip, h, polluted, info)
    call check(info == 0 .and. all(abs(polluted - h) > 0), 'small letters')
    call jf_pollute('N', 'C', 'E', 0_ip, 1_ip, 0.1_dp, some_seed, 0_ip, 4_ip, 3_ip, 0_ip, 1_ip, h, polluted, info)
    call check(info == 0, 'nothing to pollute')
  end subroutine arguments

  subroutine refused(code, trans, kind, reference, reciprocal, block, level, n_out, n_in, n_freq, first, count)
    integer, intent(in) :: code, reciprocal, block, n_out, n_in, n_freq, first, count
    character, intent(in) :: trans, kind, reference
    real(dp), intent(in) :: level
    complex(dp) :: h(2, 4, 3), polluted(2, 4, 3)
    character(len=6) :: text

    h = 1.0_dp
    polluted = -7.0_dp
    call jf_pollute(trans, kind, reference, int(reciprocal, ip), int(block, ip), level, some_seed, int(n_out, ip), &
                    int(n_in, ip), int(n_freq, ip), int(first, ip), int(count, ip), h, polluted, info)
    write (text, '(i0)') code
    call check(info == code .and. all(abs(polluted + 7.0_dp) <= 0.0_dp), 'argument '//text)
  end subroutine refused
end program test_noise
