!> Stiffness and mass of eight-node bricks of isotropic material, and the quality of their shape.
!>
!> Nodes 1 to 4 go round one face, counter-clockwise as seen from the opposite face; 5 to 8 lie there, 5 over 1 (C3D8 of
!> Abaqus and CalculiX, the hexahedron of VTK). DOFs are x, y, z of node 1, then of node 2, ...
module jointfrf_brick
  use, intrinsic :: ieee_arithmetic, only: ieee_positive_inf, ieee_quiet_nan, ieee_value
  use jointfrf_kinds, only: dp, ip
  use jointfrf_status, only: line_good, line_not_finite, line_overflow
  implicit none
  private
  public :: is_formulation, brick_matrices, brick_quality

  integer, parameter :: nodes = 8, points = 8, bubbles = 3
  integer, parameter :: dofs = 3*nodes, all_dofs = dofs + 3*bubbles
  !> Corners of the reference cube, node by node; the integration points lie at 1/sqrt(3) of them.
  real(dp), parameter :: corner(3, nodes) = reshape(real([ &
    -1, -1, -1, 1, -1, -1, 1, 1, -1, -1, 1, -1, -1, -1, 1, 1, -1, 1, 1, 1, 1, -1, 1, 1], dp), [3, nodes])
  !> The three nodes beside each node, right-handed.
  integer, parameter :: beside(3, nodes) = reshape([ &
    2, 4, 5, 3, 1, 6, 4, 2, 7, 1, 3, 8, 8, 6, 1, 5, 7, 2, 6, 8, 3, 7, 5, 4], [3, nodes])
  !> Hourglass patterns of a cube: products of two reference coordinates, and of all three.
  real(dp), parameter :: pattern(nodes, 4) = reshape([corner(2, :)*corner(3, :), corner(1, :)*corner(3, :), &
    corner(1, :)*corner(2, :), corner(1, :)*corner(2, :)*corner(3, :)], [nodes, 4])
  !> What is no larger than this share is rounding: a volume of the product of its edges, an edge of the coordinates.
  real(dp), parameter :: rounding = 16*epsilon(1.0_dp)

  !> What all elements share: shape functions and their slopes at the integration points, slopes at the centre.
  type :: reference_cube
    real(dp) :: place(3, points)
    real(dp) :: shape(nodes, points)
    real(dp) :: slope(3, nodes, points)
    real(dp) :: slope_centre(3, nodes)
  end type reference_cube

contains

  !> Whether a letter names a formulation.
  pure function is_formulation(letter) result(known)
    character, intent(in) :: letter
    logical :: known

    known = scan(letter, 'RrIiFf') > 0
  end function is_formulation

  !> Stiffness and mass of every element.
  !> formulation      'R' one strain, the mean over the element, and stiffness against hourglass patterns (Flanagan and
  !>                  Belytschko 1981); 'I' 2 x 2 x 2 points and incompatible modes (Taylor, Beresford and Wilson 1976);
  !>                  'F' 2 x 2 x 2 points
  !> coordinates      shape (3, 8, n), m
  !> youngs_modulus   shape (n), N/m^2
  !> poisson          shape (n)
  !> density          shape (n), kg/m^3
  !> hourglass        stiffness of hourglass patterns as a share of the shear modulus; for 'R'
  !> lumped           whether the rows of the mass are summed into its diagonal
  !> stiffness        shape (24, 24, n), N/m
  !> mass             shape (24, 24, n), kg
  !> element_info     shape (n): 0 good; -1 NaN or Inf in the coordinates; -2 the result overflows; > 0 the element is
  !>                  turned inside out or flat, first seen at the integration point nearest to that node, 1 to 8. A bad
  !>                  element is filled with NaN.
  !> info             number of bad elements
  pure subroutine brick_matrices(formulation, coordinates, youngs_modulus, poisson, density, hourglass, lumped, &
                                 stiffness, mass, element_info, info)
    character, intent(in) :: formulation
    real(dp), contiguous, intent(in) :: coordinates(:, :, :), youngs_modulus(:), poisson(:), density(:)
    real(dp), intent(in) :: hourglass
    logical, intent(in) :: lumped
    real(dp), contiguous, intent(out) :: stiffness(:, :, :), mass(:, :, :)
    integer(ip), contiguous, intent(out) :: element_info(:)
    integer(ip), intent(out) :: info
    type(reference_cube) :: cube
    real(dp) :: x(3, nodes), cofactor(3, nodes, points), determinant(points), lame, shear
    integer :: e

    cube = make_cube()
    do e = 1, size(coordinates, 3)
      call map_element(cube, coordinates(:, :, e), x, cofactor, determinant, element_info(e))
      if (element_info(e) == line_good) then
        shear = youngs_modulus(e)/(2*(1 + poisson(e)))
        lame = 2*shear*poisson(e)/(1 - 2*poisson(e))
        select case (formulation)
        case ('R', 'r')
          call mean_strain(x, cofactor, determinant, lame, shear, hourglass, stiffness(:, :, e))
        case ('I', 'i')
          call incompatible_modes(cube, x, cofactor, determinant, lame, shear, stiffness(:, :, e))
        case default
          call full_integration(cofactor, determinant, lame, shear, stiffness(:, :, e))
        end select
        call mass_matrix(cube, determinant, density(e), lumped, mass(:, :, e))
        if (.not. (all(abs(stiffness(:, :, e)) <= huge(1.0_dp)) .and. all(abs(mass(:, :, e)) <= huge(1.0_dp)))) &
          element_info(e) = line_overflow
      end if
      if (element_info(e) /= line_good) then
        stiffness(:, :, e) = ieee_value(1.0_dp, ieee_quiet_nan)
        mass(:, :, e) = ieee_value(1.0_dp, ieee_quiet_nan)
      end if
    end do
    info = int(count(element_info /= line_good), ip)
  end subroutine brick_matrices

  !> Shape of every element by its corners.
  !> coordinates        shape (3, 8, n), m
  !> scaled_jacobian    shape (n): volume that the three edges of a corner span over the product of their lengths, the
  !>                    smallest of the eight; 1 where all angles are right, not positive where a corner is turned
  !>                    inside out
  !> aspect_ratio       shape (n): longest edge over shortest, Inf where an edge has no length
  !> info               number of elements with NaN or Inf, whose results are NaN
  pure subroutine brick_quality(coordinates, scaled_jacobian, aspect_ratio, info)
    real(dp), contiguous, intent(in) :: coordinates(:, :, :)
    real(dp), contiguous, intent(out) :: scaled_jacobian(:), aspect_ratio(:)
    integer(ip), intent(out) :: info
    real(dp) :: edges(3, 3), length(3), shortest, longest, largest
    integer :: e, i

    info = 0
    do e = 1, size(coordinates, 3)
      if (.not. all(abs(coordinates(:, :, e)) <= huge(1.0_dp))) then
        info = info + 1_ip
        scaled_jacobian(e) = ieee_value(1.0_dp, ieee_quiet_nan)
        aspect_ratio(e) = ieee_value(1.0_dp, ieee_quiet_nan)
        cycle
      end if
      largest = maxval(abs(coordinates(:, :, e)))
      scaled_jacobian(e) = 1.0_dp
      shortest = huge(shortest)
      longest = 0.0_dp
      do i = 1, nodes
        edges = edges_at(i, coordinates(:, :, e))
        length = norm2(edges, dim=1)
        shortest = min(shortest, minval(length))
        longest = max(longest, maxval(length))
        scaled_jacobian(e) = min(scaled_jacobian(e), scaled_volume(edges, largest))
      end do
      if (shortest > 0.0_dp) then
        aspect_ratio(e) = longest/shortest
      else
        aspect_ratio(e) = ieee_value(1.0_dp, ieee_positive_inf)
      end if
    end do
  end subroutine brick_quality

  ! Geometry

  pure function make_cube() result(cube)
    type(reference_cube) :: cube
    real(dp) :: factor(3)
    integer :: i, g

    cube%place = corner/sqrt(3.0_dp)
    do g = 1, points
      do i = 1, nodes
        factor = 1 + corner(:, i)*cube%place(:, g)
        cube%shape(i, g) = product(factor)/8
        cube%slope(:, i, g) = corner(:, i)*[factor(2)*factor(3), factor(1)*factor(3), factor(1)*factor(2)]/8
      end do
    end do
    cube%slope_centre = corner/8
  end function make_cube

  !> The element at the integration points, each of weight 1.
  !> corners        coordinates of the nodes
  !> x              the same from the first node on, so that a far origin costs no digits
  !> cofactor       gradients of the shape functions times the determinant, shape (3, 8, points)
  !> determinant    of the Jacobian, shape (points)
  pure subroutine map_element(cube, corners, x, cofactor, determinant, element_info)
    type(reference_cube), intent(in) :: cube
    real(dp), intent(in) :: corners(3, nodes)
    real(dp), intent(out) :: x(3, nodes), cofactor(3, nodes, points), determinant(points)
    integer(ip), intent(out) :: element_info
    real(dp) :: jacobian(3, 3), c(3, 3)
    integer :: i, g

    element_info = line_not_finite
    if (.not. all(abs(corners) <= huge(1.0_dp))) return
    do i = 1, nodes
      x(:, i) = corners(:, i) - corners(:, 1)
    end do
    do g = 1, points
      element_info = int(g, ip)
      jacobian = matmul(x, transpose(cube%slope(:, :, g)))
      if (.not. scaled_volume(jacobian, maxval(abs(corners))) > rounding) return
      determinant(g) = volume(jacobian)
      c = cofactors(jacobian)
      do i = 1, nodes
        cofactor(:, i, g) = c(:, 1)*cube%slope(1, i, g) + c(:, 2)*cube%slope(2, i, g) + c(:, 3)*cube%slope(3, i, g)
      end do
    end do
    element_info = line_good
  end subroutine map_element

  !> The edges from a node to the three beside it, as columns.
  pure function edges_at(i, x) result(edges)
    integer, intent(in) :: i
    real(dp), intent(in) :: x(3, nodes)
    real(dp) :: edges(3, 3)
    integer :: a

    do a = 1, 3
      edges(:, a) = x(:, beside(a, i)) - x(:, i)
    end do
  end function edges_at

  !> Volume over the product of the lengths of the columns; 0 where a column has no length.
  !> largest   of the coordinates that the columns come from
  pure function scaled_volume(columns, largest) result(scaled)
    real(dp), intent(in) :: columns(3, 3), largest
    real(dp) :: scaled, unit(3, 3), length
    integer :: a

    scaled = 0.0_dp
    do a = 1, 3
      length = norm2(columns(:, a))
      if (.not. length > rounding*largest) return
      unit(:, a) = columns(:, a)/length
    end do
    scaled = volume(unit)
  end function scaled_volume

  pure function volume(a) result(v)
    real(dp), intent(in) :: a(3, 3)
    real(dp) :: v

    v = dot_product(a(:, 1), cross(a(:, 2), a(:, 3)))
  end function volume

  !> Determinant times the transposed inverse.
  pure function cofactors(a) result(c)
    real(dp), intent(in) :: a(3, 3)
    real(dp) :: c(3, 3)

    c(:, 1) = cross(a(:, 2), a(:, 3))
    c(:, 2) = cross(a(:, 3), a(:, 1))
    c(:, 3) = cross(a(:, 1), a(:, 2))
  end function cofactors

  pure function cross(a, b) result(c)
    real(dp), intent(in) :: a(3), b(3)
    real(dp) :: c(3)

    c = [a(2)*b(3) - a(3)*b(2), a(3)*b(1) - a(1)*b(3), a(1)*b(2) - a(2)*b(1)]
  end function cross

  ! Formulations

  pure subroutine full_integration(cofactor, determinant, lame, shear, stiffness)
    real(dp), intent(in) :: cofactor(dofs, points), determinant(points), lame, shear
    real(dp), intent(out) :: stiffness(dofs, dofs)
    real(dp) :: gradient(dofs, points)
    integer :: g

    do g = 1, points
      gradient(:, g) = cofactor(:, g)/sqrt(determinant(g))
    end do
    call strain_energy(dofs, points, gradient, lame, shear, stiffness)
  end subroutine full_integration

  !> Three displacements 1 - xi^2 in each direction beside those of the nodes, condensed. Their gradients take the
  !> Jacobian of the centre and detJ(centre)/detJ, so that their mean is zero: the patch test.
  pure subroutine incompatible_modes(cube, x, cofactor, determinant, lame, shear, stiffness)
    type(reference_cube), intent(in) :: cube
    real(dp), intent(in) :: x(3, nodes), cofactor(dofs, points), determinant(points), lame, shear
    real(dp), intent(out) :: stiffness(dofs, dofs)
    real(dp) :: gradient(all_dofs, points), whole(all_dofs, all_dofs), centre(3, 3), row(all_dofs), factor
    integer :: a, g, j, p

    centre = cofactors(matmul(x, transpose(cube%slope_centre)))
    do g = 1, points
      gradient(:dofs, g) = cofactor(:, g)/sqrt(determinant(g))
      do a = 1, bubbles
        gradient(dofs + 3*a - 2:dofs + 3*a, g) = -2*cube%place(a, g)*centre(:, a)/sqrt(determinant(g))
      end do
    end do
    call strain_energy(all_dofs, points, gradient, lame, shear, whole)
    do p = all_dofs, dofs + 1, -1                        ! the lower triangle is eliminated from below
      row(:p - 1) = whole(p, :p - 1)
      do j = 1, p - 1
        factor = row(j)/whole(p, p)
        whole(j:p - 1, j) = whole(j:p - 1, j) - factor*row(j:p - 1)
      end do
    end do
    do j = 1, dofs
      stiffness(j:, j) = whole(j:dofs, j)
      stiffness(j, j:) = whole(j:dofs, j)
    end do
  end subroutine incompatible_modes

  !> The mean gradients make a uniform strain. What they do not see, the patterns made orthogonal to every linear
  !> displacement, is held by hourglass G V (b : b) gamma gamma^T/8, the gradients b per node and direction.
  pure subroutine mean_strain(x, cofactor, determinant, lame, shear, hourglass, stiffness)
    real(dp), intent(in) :: x(3, nodes), cofactor(3, nodes, points), determinant(points), lame, shear, hourglass
    real(dp), intent(out) :: stiffness(dofs, dofs)
    real(dp) :: gradient(3, nodes), gamma(nodes, 4), held(nodes, nodes), whole
    integer :: a, i, j

    whole = sum(determinant)
    gradient = sum(cofactor, dim=3)/whole
    gamma = pattern - matmul(transpose(gradient), matmul(x, pattern))
    held = hourglass*shear*whole*sum(gradient**2)/8*matmul(gamma, transpose(gamma))
    call strain_energy(dofs, 1, sqrt(whole)*gradient, lame, shear, stiffness)
    do j = 1, nodes
      do i = 1, nodes
        do a = 1, 3
          associate (entry => stiffness(3*i - 3 + a, 3*j - 3 + a))
            entry = entry + held(max(i, j), min(i, j))
          end associate
        end do
      end do
    end do
  end subroutine mean_strain

  !> Stiffness of an isotropic material from the gradients at some points.
  !> n           number of DOFs, three a shape function
  !> m           number of points
  !> gradient    of the shape functions at the points times the root of the weight, shape (n, m)
  !> stiffness   shape (n, n), exactly symmetric
  pure subroutine strain_energy(n, m, gradient, lame, shear, stiffness)
    integer, intent(in) :: n, m
    real(dp), intent(in) :: gradient(n, m), lame, shear
    real(dp), intent(out) :: stiffness(n, n)
    real(dp) :: product(n, n), trace
    integer :: a, b, g, i, j

    product = 0.0_dp                                     ! sum over the points of dN_i/dx_a dN_j/dx_b
    do j = 1, n
      do g = 1, m
        product(:, j) = product(:, j) + gradient(j, g)*gradient(:, g)
      end do
    end do
    do j = 0, n - 3, 3
      do i = j, n - 3, 3
        trace = shear*(product(i + 1, j + 1) + product(i + 2, j + 2) + product(i + 3, j + 3))
        do b = 1, 3
          do a = 1, 3
            stiffness(i + a, j + b) = lame*product(i + a, j + b) + shear*product(i + b, j + a)
          end do
          stiffness(i + b, j + b) = stiffness(i + b, j + b) + trace
        end do
      end do
    end do
    do j = 1, n
      do i = 1, j - 1
        stiffness(i, j) = stiffness(j, i)
      end do
    end do
  end subroutine strain_energy

  pure subroutine mass_matrix(cube, determinant, density, lumped, mass)
    type(reference_cube), intent(in) :: cube
    real(dp), intent(in) :: determinant(points), density
    logical, intent(in) :: lumped
    real(dp), intent(out) :: mass(dofs, dofs)
    real(dp) :: share(nodes, nodes)
    integer :: a, g, i, j

    share = 0.0_dp
    do g = 1, points
      do j = 1, nodes
        if (lumped) then
          share(j, j) = share(j, j) + density*determinant(g)*cube%shape(j, g)     ! the shape functions add up to 1
        else
          share(:, j) = share(:, j) + density*determinant(g)*(cube%shape(j, g)*cube%shape(:, g))
        end if
      end do
    end do
    mass = 0.0_dp
    do j = 1, nodes
      do i = 1, nodes
        do a = 1, 3
          mass(3*i - 3 + a, 3*j - 3 + a) = share(i, j)
        end do
      end do
    end do
  end subroutine mass_matrix
end module jointfrf_brick
