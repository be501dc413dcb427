!> Bricks against the textbook's B^T D B in quadruple precision, bad elements, arguments, and the quality of shapes.
module quad_brick
  use testing, only: dp, qp, quad_inverse
  implicit none
  private
  public :: quad_stiffness, quad_mass, nodes_of_cube

  !> Corners of the reference cube.
  integer, parameter :: nodes_of_cube(3, 8) = reshape([ &
    -1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, -1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1], [3, 8])

contains

  !> Stiffness by formulation, the strains by name: xx, yy, zz, xy, yz, zx.
  function quad_stiffness(formulation, x, e, nu, hourglass) result(k)
    character, intent(in) :: formulation
    real(dp), intent(in) :: x(3, 8), e, nu, hourglass
    real(qp) :: k(24, 24), b(6, 33), d(6, 6), whole(33, 33), det, centre(3, 3), det_centre, slope(3, 11), mean(3, 8)
    real(qp) :: weight, volume, xi(3)
    integer :: g, a

    d = elasticity(real(e, qp), real(nu, qp))
    call jacobian(x, [0.0_qp, 0.0_qp, 0.0_qp], centre, det_centre)
    whole = 0
    do g = 1, 8
      xi = place(g)
      call gradients(x, xi, slope(:, :8), det)
      do a = 1, 3
        slope(:, 8 + a) = -2*inverse_row(centre, a)*xi(a)*det_centre/det
      end do
      b = strain(slope)
      whole = whole + det*matmul(transpose(b), matmul(d, b))
    end do
    select case (formulation)
    case ('F')
      k = whole(:24, :24)
    case ('I')
      k = whole(:24, :24) - matmul(whole(:24, 25:), matmul(real(quad_inverse(cmplx(whole(25:, 25:), kind=qp)), qp), &
                                                           whole(25:, :24)))
    case ('R')
      volume = volume_of(real(x, qp))
      mean = volume_slope(real(x, qp))/volume
      slope = 0
      slope(:, :8) = mean
      b = strain(slope)
      whole = volume*matmul(transpose(b), matmul(d, b))
      k = whole(:24, :24)
      weight = real(hourglass, qp)*e/(2*(1 + real(nu, qp)))*volume*sum(mean**2)/8
      call add_hourglass(real(x, qp), mean, weight, k)
    end select
  end function quad_stiffness

  !> The volume is linear in each coordinate of each node: its slope is a difference over a step of any size.
  function volume_slope(x) result(slope)
    real(qp), intent(in) :: x(3, 8)
    real(qp) :: slope(3, 8), moved(3, 8)
    integer :: a, i

    do i = 1, 8
      do a = 1, 3
        moved = x
        moved(a, i) = moved(a, i) + 1
        slope(a, i) = volume_of(moved) - volume_of(x)
      end do
    end do
  end function volume_slope

  !> A pattern minus the linear displacement of the same mean slopes.
  subroutine add_hourglass(x, mean, weight, k)
    real(qp), intent(in) :: x(3, 8), mean(3, 8), weight
    real(qp), intent(inout) :: k(24, 24)
    real(qp) :: gamma(8)
    integer :: h, a, i, j

    do h = 1, 4
      do i = 1, 8
        gamma(i) = product(nodes_of_cube(:, i))*merge(nodes_of_cube(min(h, 3), i), 1, h < 4)
      end do
      gamma = gamma - matmul(matmul(gamma, transpose(x)), mean)                  ! its product with every x is zero
      do j = 1, 8
        do i = 1, 8
          do a = 1, 3
            k(3*i - 3 + a, 3*j - 3 + a) = k(3*i - 3 + a, 3*j - 3 + a) + weight*gamma(i)*gamma(j)
          end do
        end do
      end do
    end do
  end subroutine add_hourglass

  function quad_mass(x, density, lumped) result(m)
    real(dp), intent(in) :: x(3, 8), density
    logical, intent(in) :: lumped
    real(qp) :: m(24, 24), n(3, 24), slope(3, 8), det
    integer :: g, i

    m = 0
    do g = 1, 8
      n = 0
      do i = 1, 24
        n(mod(i - 1, 3) + 1, i) = shape_function((i + 2)/3, place(g))
      end do
      call gradients(x, place(g), slope, det)
      m = m + density*det*matmul(transpose(n), n)
    end do
    if (.not. lumped) return
    do i = 1, 24
      m(i, i) = sum(m(:, i))
      m(:i - 1, i) = 0
      m(i + 1:, i) = 0
    end do
  end function quad_mass

  pure function place(g) result(xi)
    integer, intent(in) :: g
    real(qp) :: xi(3)

    xi = nodes_of_cube(:, g)/sqrt(3.0_qp)
  end function place

  pure function shape_function(i, xi) result(n)
    integer, intent(in) :: i
    real(qp), intent(in) :: xi(3)
    real(qp) :: n

    n = product(1 + nodes_of_cube(:, i)*xi)/8
  end function shape_function

  !> dx/dxi, x down, xi across. The shape functions are linear in each reference coordinate: differences are exact.
  subroutine jacobian(x, xi, j, det)
    real(dp), intent(in) :: x(3, 8)
    real(qp), intent(in) :: xi(3)
    real(qp), intent(out) :: j(3, 3), det
    integer :: a, i

    j = 0
    do a = 1, 3
      do i = 1, 8
        j(:, a) = j(:, a) + x(:, i)*slope_of(i, a, xi)
      end do
    end do
    det = j(1, 1)*(j(2, 2)*j(3, 3) - j(2, 3)*j(3, 2)) - j(1, 2)*(j(2, 1)*j(3, 3) - j(2, 3)*j(3, 1)) &
      + j(1, 3)*(j(2, 1)*j(3, 2) - j(2, 2)*j(3, 1))
  end subroutine jacobian

  pure function slope_of(i, a, xi) result(slope)
    integer, intent(in) :: i, a
    real(qp), intent(in) :: xi(3)
    real(qp) :: slope, upper(3), lower(3)

    upper = xi
    lower = xi
    upper(a) = 1
    lower(a) = -1
    slope = (shape_function(i, upper) - shape_function(i, lower))/2
  end function slope_of

  subroutine gradients(x, xi, slope, det)
    real(dp), intent(in) :: x(3, 8)
    real(qp), intent(in) :: xi(3)
    real(qp), intent(out) :: slope(3, 8), det
    real(qp) :: j(3, 3)
    integer :: a, i

    call jacobian(x, xi, j, det)
    slope = 0
    do i = 1, 8
      do a = 1, 3
        slope(:, i) = slope(:, i) + inverse_row(j, a)*slope_of(i, a, xi)
      end do
    end do
  end subroutine gradients

  !> Row a of the inverse.
  function inverse_row(j, a) result(row)
    real(qp), intent(in) :: j(3, 3)
    integer, intent(in) :: a
    real(qp) :: row(3)
    complex(qp) :: inverse(3, 3)

    inverse = quad_inverse(cmplx(j, kind=qp))
    row = real(inverse(a, :), qp)
  end function inverse_row

  function volume_of(x) result(volume)
    real(qp), intent(in) :: x(3, 8)
    real(qp) :: volume, j(3, 3)
    integer :: g, a, i

    volume = 0
    do g = 1, 8
      j = 0
      do a = 1, 3
        do i = 1, 8
          j(:, a) = j(:, a) + x(:, i)*slope_of(i, a, place(g))
        end do
      end do
      volume = volume + j(1, 1)*(j(2, 2)*j(3, 3) - j(2, 3)*j(3, 2)) - j(1, 2)*(j(2, 1)*j(3, 3) - j(2, 3)*j(3, 1)) &
        + j(1, 3)*(j(2, 1)*j(3, 2) - j(2, 2)*j(3, 1))
    end do
  end function volume_of

  pure function strain(slope) result(b)
    real(qp), intent(in) :: slope(3, 11)
    real(qp) :: b(6, 33)
    integer :: i

    b = 0
    do i = 1, 11
      b(1, 3*i - 2) = slope(1, i)
      b(2, 3*i - 1) = slope(2, i)
      b(3, 3*i) = slope(3, i)
      b(4, 3*i - 2:3*i - 1) = [slope(2, i), slope(1, i)]
      b(5, 3*i - 1:3*i) = [slope(3, i), slope(2, i)]
      b(6, 3*i - 2) = slope(3, i)
      b(6, 3*i) = slope(1, i)
    end do
  end function strain

  pure function elasticity(e, nu) result(d)
    real(qp), intent(in) :: e, nu
    real(qp) :: d(6, 6)
    integer :: a

    d = 0
    d(:3, :3) = e*nu/((1 + nu)*(1 - 2*nu))
    do a = 1, 3
      d(a, a) = e*(1 - nu)/((1 + nu)*(1 - 2*nu))
      d(3 + a, 3 + a) = e/(2*(1 + nu))
    end do
  end function elasticity
end module quad_brick

program test_brick
  use, intrinsic :: ieee_arithmetic, only: ieee_is_nan
  use testing, only: check, check_same, dp, finish, infinity, ip, not_a_number, qp, random_real, seed
  use jointfrf, only: jf_brick_matrices, jf_brick_quality
  use jointfrf_brick, only: is_formulation
  use quad_brick, only: nodes_of_cube, quad_mass, quad_stiffness
  implicit none
  character, parameter :: formulations(3) = ['R', 'I', 'F']
  integer, parameter :: n = 6
  real(dp) :: x(3, 8, n), e(n), nu(n), density(n), stiffness(24, 24, n), mass(24, 24, n), good(24, 24, n)
  real(dp) :: scaled(n), aspect(n)
  integer(ip) :: element_info(n), info
  integer :: i

  call seed(5)
  do i = 1, n
    x(:, :, i) = real(nodes_of_cube, dp) + 0.35_dp*random_real(3, 8)
    x(2, :, i) = 3.0_dp**(i - 2)*x(2, :, i)
    x(:, :, i) = 0.01_dp*x(:, :, i) + 0.02_dp*i
  end do
  e = [70.0e9_dp, 210.0e9_dp, 1.0_dp, 3.0e6_dp, 1.0e11_dp, 5.0e10_dp]
  nu = [0.33_dp, 0.0_dp, 0.49_dp, -0.4_dp, 0.2_dp, 0.3_dp]
  density = [2700.0_dp, 7850.0_dp, 1.0_dp, 0.001_dp, 1.0e4_dp, 2.0_dp]
  call references()
  call bad_elements()
  call arguments()
  call shapes()
  call finish('brick')

contains

  subroutine matrices(formulation, hourglass, lumped)
    character, intent(in) :: formulation
    real(dp), intent(in) :: hourglass
    integer, intent(in) :: lumped

    call jf_brick_matrices(formulation, int(n, ip), x, e, nu, density, hourglass, int(lumped, ip), stiffness, mass, &
                           element_info, info)
  end subroutine matrices

  subroutine references()
    real(qp) :: expected(24, 24)
    integer :: f, lumped

    do f = 1, 3
      do lumped = 0, 1
        call matrices(formulations(f), 0.02_dp, lumped)
        call check(info == 0 .and. all(element_info == 0), formulations(f)//': good')
        do i = 1, n
          expected = quad_stiffness(formulations(f), x(:, :, i), e(i), nu(i), 0.02_dp)
          call check(maxval(abs(stiffness(:, :, i) - expected)) < 2.0e-13_dp*maxval(abs(expected)), &
                     formulations(f)//': stiffness')
          expected = quad_mass(x(:, :, i), density(i), lumped == 1)
          call check(maxval(abs(mass(:, :, i) - expected)) < 2.0e-14_dp*maxval(abs(expected)), &
                     formulations(f)//': mass')
          call check_same([stiffness(:, :, i)], [transpose(stiffness(:, :, i))], formulations(f)//': symmetric')
          call check_same([mass(:, :, i)], [transpose(mass(:, :, i))], formulations(f)//': symmetric mass')
        end do
      end do
    end do
    call matrices('I', 0.02_dp, 0)
    good = stiffness
    call matrices('i', 0.9_dp, 0)
    call check_same([stiffness], [good], 'small letter, and the hourglass stiffness is for R')
    call matrices('R', 0.0_dp, 0)
    do i = 1, n
      expected = quad_stiffness('R', x(:, :, i), e(i), nu(i), 0.0_dp)
      call check(maxval(abs(stiffness(:, :, i) - expected)) < 2.0e-13_dp*maxval(abs(expected)), 'no hourglass control')
    end do
  end subroutine references

  !> A bad element is NaN and named; the others keep every bit.
  subroutine bad_elements()
    !> Its corners are right-handed, its integration point 1 is not.
    real(dp), parameter :: bent(3, 8) = reshape(real([ &
      1, -1, -1, -1, -4, 1, 6, 3, -8, -7, 7, -5, -10, -10, 5, 0, -8, 5, 5, 1, 2, -7, 3, 0], dp), [3, 8])
    real(dp) :: kept(3, 8), kept_mass(24, 24, n)
    integer :: f, case_number
    integer(ip), parameter :: codes(7) = [-1_ip, -1_ip, 1_ip, 7_ip, 1_ip, 1_ip, -2_ip]

    kept = x(:, :, 3)
    do f = 1, 3
      x(:, :, 3) = kept
      call matrices(formulations(f), 0.005_dp, 0)
      good = stiffness
      kept_mass = mass
      do case_number = 1, 7
        x(:, :, 3) = kept
        select case (case_number)
        case (1)
          x(2, 7, 3) = not_a_number()
        case (2)
          x(1, 1, 3) = -infinity()
        case (3)
          x(:, :, 3) = kept(:, [5, 6, 7, 8, 1, 2, 3, 4])                   ! the other way round
        case (4)
          x(:, :, 3) = nodes_of_cube
          x(:, 7, 3) = -0.6_dp                                             ! its last corner pushed in
        case (5)
          x(:, :, 3) = nodes_of_cube
          x(3, :, 3) = 0.1_dp*x(1, :, 3) + 0.3_dp*x(2, :, 3)               ! flat
        case (6)
          x(:, :, 3) = bent
        case (7)
          x(:, :, 3) = 1.0e120_dp*nodes_of_cube                            ! its volume is 8e360
        end select
        call matrices(formulations(f), 0.005_dp, 0)
        call check(info == 1 .and. element_info(3) == codes(case_number), formulations(f)//': code of a bad element')
        call check(count(element_info /= 0) == 1, formulations(f)//': codes of the others')
        call check(all(ieee_is_nan(stiffness(:, :, 3))) .and. all(ieee_is_nan(mass(:, :, 3))), &
                   formulations(f)//': a bad element is NaN')
        call check_same([stiffness(:, :, [1, 2, 4, 5, 6])], [good(:, :, [1, 2, 4, 5, 6])], formulations(f)//': others')
        call check_same([mass(:, :, [1, 2, 4, 5, 6])], [kept_mass(:, :, [1, 2, 4, 5, 6])], &
                        formulations(f)//': masses of the others')
      end do
    end do
    x(:, :, 3) = nodes_of_cube
    x(:, 8, 3) = x(:, 4, 3)                                                ! a corner is flat, the inside is not
    call matrices('R', 0.005_dp, 0)
    call check(info == 0, 'an edge without length')
    x(:, 8, 3) = not_a_number()
    x(1, 1, 5) = not_a_number()
    call matrices('F', 0.005_dp, 0)
    call check(info == 2, 'two bad elements')
    x(:, :, 3) = kept
    x(:, :, 5) = kept
  end subroutine bad_elements

  !> A wrong argument is named by its place, and nothing is done.
  subroutine arguments()
    integer :: letter
    real(dp) :: nothing(3, 8, 0), none(0), no_aspect(0), no_matrix(24, 24, 0), no_mass(24, 24, 0)
    integer(ip) :: no_info(0)

    do letter = 0, 127
      call check(is_formulation(achar(letter)) .eqv. any(achar(letter) == ['R', 'r', 'I', 'i', 'F', 'f']), 'letters')
    end do
    call refused(-1, 'X', n, 1.0_dp, 0.3_dp, 1.0_dp, 0.0_dp, 0)
    call refused(-2, 'R', -1, 1.0_dp, 0.3_dp, 1.0_dp, 0.0_dp, 0)
    call refused(-4, 'R', n, 0.0_dp, 0.3_dp, 1.0_dp, 0.0_dp, 0)
    call refused(-4, 'R', n, infinity(), 0.3_dp, 1.0_dp, 0.0_dp, 0)
    call refused(-5, 'R', n, 1.0_dp, 0.5_dp, 1.0_dp, 0.0_dp, 0)
    call refused(-5, 'R', n, 1.0_dp, -1.0_dp, 1.0_dp, 0.0_dp, 0)
    call refused(-5, 'R', n, 1.0_dp, not_a_number(), 1.0_dp, 0.0_dp, 0)
    call refused(-6, 'R', n, 1.0_dp, 0.3_dp, -1.0_dp, 0.0_dp, 0)
    call refused(-7, 'R', n, 1.0_dp, 0.3_dp, 1.0_dp, -0.1_dp, 0)
    call refused(-7, 'R', n, 1.0_dp, 0.3_dp, 1.0_dp, not_a_number(), 0)
    call refused(-8, 'R', n, 1.0_dp, 0.3_dp, 1.0_dp, 0.0_dp, 2)
    call jf_brick_matrices('R', 0_ip, nothing, none, none, none, 0.0_dp, 0_ip, no_matrix, no_mass, no_info, info)
    call check(info == 0, 'no elements')
    info = 7
    call jf_brick_quality(0_ip, nothing, none, no_aspect, info)
    call check(info == 0, 'quality of no elements')
    call jf_brick_quality(-1_ip, nothing, none, no_aspect, info)
    call check(info == -1, 'quality of fewer than none')
  end subroutine arguments

  subroutine refused(code, formulation, n_elements, modulus, poisson, rho, hourglass, lumped)
    integer, intent(in) :: code, n_elements, lumped
    character, intent(in) :: formulation
    real(dp), intent(in) :: modulus, poisson, rho, hourglass
    real(dp) :: modulus_each(n), poisson_each(n), rho_each(n)
    character(len=6) :: text

    modulus_each = 1.0_dp
    poisson_each = 0.3_dp
    rho_each = 1.0_dp
    modulus_each(n) = modulus
    poisson_each(n) = poisson
    rho_each(n) = rho
    stiffness = -7.0_dp
    mass = -7.0_dp
    call jf_brick_matrices(formulation, int(n_elements, ip), x, modulus_each, poisson_each, rho_each, hourglass, &
                           int(lumped, ip), stiffness, mass, element_info, info)
    write (text, '(i0)') code
    call check(info == code .and. all(abs(stiffness + 7.0_dp) <= 0.0_dp) .and. all(abs(mass + 7.0_dp) <= 0.0_dp), &
               'argument '//text)
  end subroutine refused

  subroutine shapes()
    real(dp) :: cube(3, 8)

    cube = nodes_of_cube
    x(:, :, 1) = cube + 5
    x(:, :, 2) = cube
    x(2, :, 2) = 3*cube(2, :)                              ! 2 x 6 x 2
    x(:, :, 3) = cube
    x(1, :, 3) = cube(1, :) + 0.75_dp*cube(2, :)           ! edges 2, 2.5, 2: sheared by atan(0.75)
    x(:, :, 4) = cube(:, [5, 6, 7, 8, 1, 2, 3, 4])
    x(:, :, 5) = cube
    x(:, 8, 5) = cube(:, 4)
    x(:, :, 6) = cube
    x(3, 2, 6) = not_a_number()
    call jf_brick_quality(int(n, ip), x, scaled, aspect, info)
    call check(info == 1 .and. ieee_is_nan(scaled(6)) .and. ieee_is_nan(aspect(6)), 'quality of NaN')
    call check(all(abs(scaled(:5) - [1.0_dp, 1.0_dp, 0.8_dp, -1.0_dp, 0.0_dp]) < 1.0e-15_dp), 'scaled Jacobian')
    call check(all(abs(aspect(:4) - [1.0_dp, 3.0_dp, 1.25_dp, 1.0_dp]) < 1.0e-15_dp), 'aspect ratio')
    call check(aspect(5) > huge(1.0_dp), 'an edge without length')
  end subroutine shapes
end program test_brick
