"""Bricks against exact solutions: constant strain, rigid bodies, bending, and the frequencies of a cantilever."""

import sys

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse import linalg as sparse_linalg
from scipy.spatial.transform import Rotation

from jointfrf.workbench.solids.brick import Material, assemble_bricks, brick_quality, element_matrices

FORMULATIONS = ("reduced", "incompatible", "full")
CUBE = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], float)
ALUMINIUM = Material(70e9, 0.33, 2700.0)
# MacNeal and Harder's patch: a distorted brick inside a unit cube.
INNER = [
    [0.249, 0.342, 0.192], [0.826, 0.288, 0.288], [0.850, 0.649, 0.263], [0.273, 0.750, 0.230],
    [0.320, 0.186, 0.643], [0.677, 0.305, 0.683], [0.788, 0.693, 0.644], [0.165, 0.745, 0.702],
]  # fmt: skip
FACES = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]


def patch():
    """Unit cube: nodes 0 to 7 outside, 8 to 15 inside; seven elements."""
    # counter-clockwise from outside: the inner face, where the brick stands on it, comes first
    around = [[*(8 + n for n in face), *face] for face in FACES]
    return np.vstack([CUBE, INNER]), np.array([list(range(8, 16)), *around])


def box(divisions, lengths):
    """Nodes x fastest, then y, then z, of a box of equal bricks."""
    axes = [np.linspace(0, length, n + 1) for n, length in zip(divisions, lengths, strict=True)]
    z, y, x = np.meshgrid(*axes[::-1], indexing="ij")
    at = np.arange(x.size).reshape(x.shape)
    low, high = slice(None, -1), slice(1, None)
    corners = [(low, low, low), (low, low, high), (low, high, high), (low, high, low)]
    corners += [(high, *rest) for _, *rest in corners]
    return np.stack([x, y, z], -1).reshape(-1, 3), np.stack([at[c].ravel() for c in corners], 1)


def distorted(seed=0, size=0.15):
    """Bricks of all shapes: a distorted cube, stretched and turned."""
    rng = np.random.default_rng(seed)
    shapes = (CUBE + rng.uniform(-size, size, (5, 8, 3))) * rng.uniform(0.2, 2, (5, 1, 3))
    return shapes @ Rotation.random(random_state=seed).as_matrix()


def strain_matrix(gradients):
    """B of the textbook, rows xx, yy, zz, xy, yz, zx; gradients (8, 3)."""
    b = np.zeros((6, 24))
    for i, (x, y, z) in enumerate(gradients):
        b[:, 3 * i : 3 * i + 3] = [[x, 0, 0], [0, y, 0], [0, 0, z], [y, x, 0], [0, z, y], [z, 0, x]]
    return b


def elasticity(material):
    e, nu = material.youngs_modulus, material.poisson
    compliance = np.diag([1, 1, 1, *[2 * (1 + nu)] * 3]) - nu * (np.pad(np.ones((3, 3)) - np.eye(3), (0, 3)))
    return np.linalg.inv(compliance / e)


def textbook(x, material):
    """Stiffness at 2 x 2 x 2 points."""
    signs = 2 * CUBE - 1
    k = np.zeros((24, 24))
    for xi in signs / np.sqrt(3):
        factors = 1 + signs * xi
        slopes = (
            signs * np.stack([factors[:, [1, 2]].prod(1), factors[:, [0, 2]].prod(1), factors[:, :2].prod(1)], 1) / 8
        )
        jacobian = slopes.T @ x
        b = strain_matrix(np.linalg.solve(jacobian, slopes.T).T)
        k += b.T @ elasticity(material) @ b * np.linalg.det(jacobian)
    return k


def first_frequency(k, m, held):
    free = np.setdiff1d(np.arange(k.shape[0]), held)
    k, m = (sparse.csc_array(a)[free][:, free] for a in (k, m))
    squared = sparse_linalg.eigsh(k, 1, m, sigma=0, v0=np.ones(free.size), return_eigenvectors=False)
    return float(np.sqrt(squared[0]) / (2 * np.pi))


def cantilever(formulation, divisions, **options):
    """First frequency of the beam of 0.3 x 0.025 x 0.006 m along z, Hz."""
    nodes, elements = box(divisions, (0.025, 0.006, 0.3))
    k, m = assemble_bricks(nodes, elements, ALUMINIUM, formulation, **options)
    return first_frequency(k, m, np.arange(3 * (divisions[0] + 1) * (divisions[1] + 1)))


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_constant_strain_on_distorted_bricks(formulation, mass):
    nodes, elements = patch()
    assert brick_quality(nodes, elements)[0].min() < 0  # one corner even turns inside out
    k, m = assemble_bricks(nodes, elements, ALUMINIUM, formulation, mass=mass)
    slope = np.random.default_rng(3).standard_normal((3, 3))
    exact = (nodes @ slope.T).ravel()
    outside, inside = np.arange(24), np.arange(24, 48)
    found = sparse_linalg.spsolve(k[inside][:, inside].tocsc(), -(k[inside][:, outside] @ exact[outside]))
    assert abs(found - exact[inside]).max() < 1e-13 * abs(exact).max()

    # The forces on the outer nodes have the moments of the exact stress: sum f_i x_j = sigma_ij V.
    force = (k @ exact).reshape(-1, 3)
    e = (slope + slope.T) / 2
    normal, shear = np.diag(e), np.array([2 * e[0, 1], 2 * e[1, 2], 2 * e[2, 0]])
    xx, yy, zz, xy, yz, zx = elasticity(ALUMINIUM) @ np.concatenate([normal, shear])
    stress = np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])
    assert abs(force.T @ nodes - stress).max() < 1e-13 * abs(stress).max()
    assert abs(force[8:]).max() < 1e-13 * abs(force).max()
    assert m.sum() == pytest.approx(3 * 2700.0, rel=1e-13)

    # So has each element.
    k_elements, _ = element_matrices(nodes[elements], ALUMINIUM, formulation)
    for k_element, element in zip(k_elements, elements, strict=True):
        x = nodes[element]
        volume = sum(np.linalg.det(_jacobian(x, xi)) for xi in (2 * CUBE - 1) / np.sqrt(3))
        moments = (k_element @ (x @ slope.T).ravel()).reshape(8, 3).T @ x
        assert abs(moments - volume * stress).max() < 1e-13 * abs(stress).max()


def _jacobian(x, xi):
    signs = 2 * CUBE - 1
    step = np.eye(3)  # the shape functions are linear in each reference coordinate
    return np.stack([((1 + signs * (xi + s)).prod(1) - (1 + signs * (xi - s)).prod(1)) @ x / 16 for s in step])


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_six_motions_without_energy_and_no_more(formulation):
    shapes = distorted()
    k, _ = element_matrices(shapes, ALUMINIUM, formulation)
    assert (k == k.swapaxes(1, 2)).all()
    for k_element, x in zip(k, shapes, strict=True):
        energies = np.linalg.eigvalsh(k_element)
        assert abs(energies[:6]).max() < 1e-13 * energies[-1]
        assert energies[6] > 1e-6 * energies[-1]
        moves = np.hstack([np.tile(np.eye(3), (8, 1)), np.cross(x[:, None], np.eye(3)).swapaxes(1, 2).reshape(24, 3)])
        assert abs(k_element @ moves).max() < 1e-13 * energies[-1] * abs(moves).max()


def test_without_hourglass_control_twelve_more_motions_have_no_energy():
    k, _ = element_matrices(distorted(), ALUMINIUM, "reduced", hourglass=0.0)
    energies = np.linalg.eigvalsh(k)
    assert (abs(energies[:, :18]) < 1e-13 * energies[:, -1:]).all()
    assert (energies[:, 18] > 1e-3 * energies[:, -1]).all()


def test_hourglass_stiffness_of_a_box():
    """The pattern u_z = eta zeta of a box a x b x c: b : b = (1/a^2 + 1/b^2 + 1/c^2)/2, gamma u = 8."""
    sides, nu = np.array([0.3, 0.2, 0.5]), 0.25
    k, _ = element_matrices([CUBE * sides], Material(1.0, nu, 1.0), "reduced", hourglass=0.01)
    signs = 2 * CUBE - 1
    u = signs[:, 1] * signs[:, 2]
    expected = 0.01 / (2 * (1 + nu)) * sides.prod() * (sides**-2.0).sum() / 2 / 8 * 8**2
    assert u @ k[0, 2::3, 2::3] @ u == pytest.approx(expected, rel=1e-13)


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_turned_element_has_turned_matrices(formulation):
    shapes = distorted(1)
    turn = Rotation.from_rotvec([0.3, -1.1, 0.7]).as_matrix()
    whole = np.kron(np.eye(8), turn)
    for before, after in zip(
        element_matrices(shapes, ALUMINIUM, formulation),
        element_matrices(shapes @ turn.T + [0.3, -2, 1], ALUMINIUM, formulation),
        strict=True,
    ):
        size = abs(before).max(axis=(1, 2), keepdims=True)
        assert (abs(after - whole @ before @ whole.T) < 1e-12 * size).all()


@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_the_first_node_may_be_any(formulation):
    """The cube turned onto itself numbers its nodes anew, and nothing else changes."""
    x = distorted(2)[:1]
    order = [3, 0, 1, 2, 7, 4, 5, 6], [0, 4, 5, 1, 3, 7, 6, 2], [1, 0, 4, 5, 2, 3, 7, 6]
    before, _ = element_matrices(x, ALUMINIUM, formulation)
    for new in order:
        after, _ = element_matrices(x[:, new], ALUMINIUM, formulation)
        rows = (3 * np.array(new)[:, None] + np.arange(3)).ravel()
        assert abs(after[0] - before[0][np.ix_(rows, rows)]).max() < 1e-14 * abs(before).max()


@pytest.mark.parametrize("poisson", [-0.3, 0.0, 0.33, 0.49])
def test_full_integration_is_the_textbook(poisson):
    material = Material(3.0, poisson, 1.0)
    shapes = distorted(3)
    k, _ = element_matrices(shapes, [material] * 5, "full")
    for k_element, x in zip(k, shapes, strict=True):
        expected = textbook(x, material)
        assert abs(k_element - expected).max() < 1e-13 * abs(expected).max()


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_mass_of_a_rigid_body(mass):
    """Mass, centre, and for the consistent mass the moments of inertia of a turned box."""
    sides, density = np.array([0.3, 0.2, 0.5]), 2700.0
    turn, middle = Rotation.from_rotvec([0.4, 0.2, -0.9]).as_matrix(), np.array([1.0, 2.0, -0.5])
    x = (CUBE - 0.5) * sides @ turn.T + middle
    _, m = element_matrices([x], ALUMINIUM, mass=mass)
    total = density * sides.prod()
    share = m[0, ::3, ::3]
    assert (m[0, 1::3, 1::3] == share).all()
    assert not m[0, ::3, 1::3].any()
    assert share.sum() == pytest.approx(total, rel=1e-13)
    assert np.allclose(share.sum(axis=0) @ x, total * middle, rtol=1e-13)
    second = (x - middle).T @ share @ (x - middle)
    exact = total * turn @ np.diag(sides**2 / 12) @ turn.T
    assert np.allclose(second, exact if mass == "consistent" else 3 * exact, rtol=1e-12, atol=1e-12 * exact.max())
    if mass == "lumped":
        assert (share == np.diag(np.full(8, total / 8))).all() or np.allclose(share, np.eye(8) * total / 8, rtol=1e-14)


def test_lumped_mass_is_the_sum_of_rows():
    shapes = distorted(4)
    consistent, lumped = (element_matrices(shapes, ALUMINIUM, mass=mass)[1] for mass in ("consistent", "lumped"))
    diagonal = np.zeros_like(lumped)
    diagonal[:, np.arange(24), np.arange(24)] = consistent.sum(axis=2)
    assert np.allclose(lumped, diagonal, rtol=1e-13, atol=1e-13 * abs(diagonal).max())
    assert (np.linalg.eigvalsh(consistent) > 0).all()


def bending_energy_ratio(k, x, poisson, middle=0.0):
    """Energy of the nodes moved as in pure bending, u_z = -y z, over E I L/2 for unit curvature and modulus."""
    y, z = x[:, 1] - middle, x[:, 2]
    u = np.stack([poisson * x[:, 0] * y, (z**2 - poisson * (x[:, 0] ** 2 - y**2)) / 2, -y * z], 1)
    width, height, length = np.ptp(x, axis=0)
    return float(u.ravel() @ (k @ u.ravel()) / (width * height**3 / 12 * length))


@pytest.mark.parametrize("slenderness", [1, 10, 100])
@pytest.mark.parametrize("poisson", [0.0, 0.33])
def test_one_incompatible_brick_bends_exactly(poisson, slenderness):
    sides = np.array([0.5, 0.1, 0.1 * slenderness])
    x = CUBE * sides - [0.25, 0.05, 0]
    k, _ = element_matrices([x], Material(1.0, poisson, 1.0))
    # The corners hold no quadratic displacement 1 - xi^2: the internal ones do.
    assert bending_energy_ratio(k[0], x, poisson) == pytest.approx(1, rel=1e-7)

    # A moment at the free end turns it by M L/(E I), and moves it by M L^2/(2 E I).
    if poisson == 0:
        inertia = sides[0] * sides[1] ** 3 / 12
        force = np.zeros((8, 3))
        force[4:, 2] = np.where(x[4:, 1] > 0, -1, 1) / (2 * sides[1])  # unit moment, tension below
        held = [0, 1, 2, 5, 8, 9, 11]
        free = np.setdiff1d(np.arange(24), held)
        u = np.zeros(24)
        u[free] = np.linalg.solve(k[0][np.ix_(free, free)], force.ravel()[free])
        assert u.reshape(8, 3)[4:, 1] == pytest.approx(sides[2] ** 2 / (2 * inertia), rel=1e-7)
        locked = textbook(x, Material(1.0, 0.0, 1.0))
        u[free] = np.linalg.solve(locked[np.ix_(free, free)], force.ravel()[free])
        assert u.reshape(8, 3)[4, 1] < 0.7 * sides[2] ** 2 / (2 * inertia)


@pytest.mark.parametrize("layers", [1, 2, 3, 5])
def test_layers_of_reduced_bricks_bend_as_one_minus_one_over_their_number_squared(layers):
    nodes, elements = box((1, layers, 1), (0.02, 0.06, 0.05))
    k, _ = assemble_bricks(nodes, elements, Material(1.0, 0.0, 1.0), "reduced", hourglass=0.0)
    assert bending_energy_ratio(k, nodes, 0.0, 0.03) == pytest.approx(1 - 1 / layers**2, abs=1e-12)


@pytest.mark.parametrize("slenderness", [4, 100])
def test_cantilever_under_a_tip_force(slenderness):
    """Euler-Bernoulli for a slender beam, Timoshenko with shear coefficient 5/6 for a short one, no Poisson effect."""
    height, length = 0.1, 0.1 * slenderness
    nodes, elements = box((1, 4, 40), (height, height, length))
    k, _ = assemble_bricks(nodes, elements, Material(1.0, 0.0, 1.0))
    tip = np.flatnonzero(nodes[:, 2] == nodes[:, 2].max())
    force = np.zeros(nodes.size)
    y = nodes[tip, 1] / height  # a parabola of shear stress, lumped to the nodes
    weights = 6 * y * (1 - y) + 1 / 16 * np.isin(y, (0, 1))
    force[3 * tip + 1] = weights / weights.sum()
    free = np.arange(30, nodes.size)
    u = np.zeros(nodes.size)
    u[free] = sparse_linalg.spsolve(k[free][:, free].tocsc(), force[free])
    bending = length**3 / (3 * height**4 / 12)
    shear = length / (5 / 6 * height**2 / 2)
    assert u[3 * tip + 1].mean() == pytest.approx(bending + shear, rel=3e-3)
    if slenderness == 100:
        assert u[3 * tip + 1].mean() == pytest.approx(bending, rel=1e-3)


@pytest.mark.parametrize(
    ("formulation", "divisions", "expected"),
    [
        ("reduced", (10, 1, 100), 6.7532),
        ("reduced", (10, 2, 100), 47.8910),
        ("reduced", (10, 3, 50), 52.2538),
        ("reduced", (10, 4, 50), 53.5947),
        ("incompatible", (5, 2, 103), 55.1582),
        ("full", (5, 2, 103), 59.3042),
    ],
)
def test_first_frequency_of_a_cantilever(formulation, divisions, expected):
    """The figures of the docstring of `element_matrices`, from a program written apart."""
    assert cantilever(formulation, divisions) == pytest.approx(expected, abs=1e-4)


def test_frequency_of_one_layer_goes_with_the_root_of_the_hourglass_stiffness():
    soft, stiff = (cantilever("reduced", (5, 1, 50), hourglass=h) for h in (0.001, 0.004))
    assert stiff / soft == pytest.approx(2, rel=0.01)


def test_masses_change_the_first_frequency_little():
    consistent, lumped = (cantilever("incompatible", (2, 2, 50), mass=mass) for mass in ("consistent", "lumped"))
    assert 0 < consistent - lumped < 0.02


def test_assembly_is_the_sum_of_elements():
    nodes, elements = box((2, 2, 3), (1.0, 0.7, 2.0))
    nodes = nodes + np.random.default_rng(6).uniform(-0.05, 0.05, nodes.shape)
    nodes = np.vstack([nodes, [[9.0, 9.0, 9.0]]])  # a node of no element
    materials = [Material(1.0 + i, 0.02 * i, 3.0 + i) for i in range(len(elements))]
    for formulation in FORMULATIONS:
        for mass in ("consistent", "lumped"):
            found = assemble_bricks(nodes, elements, materials, formulation, mass=mass)
            parts = element_matrices(nodes[elements], materials, formulation, mass=mass)
            for matrix, part in zip(found, parts, strict=True):
                expected = np.zeros((nodes.size, nodes.size))
                for element, entries in zip(elements, part, strict=True):
                    dofs = (3 * element[:, None] + np.arange(3)).ravel()
                    expected[np.ix_(dofs, dofs)] += entries
                assert isinstance(matrix, sparse.csr_array)
                assert abs(matrix.toarray() - expected).max() < 1e-14 * abs(expected).max()
                assert (matrix != matrix.T).nnz == 0
                assert matrix.has_canonical_format


def calls_of(function):
    """Count the calls of functions, compiled ones too, that a call makes."""
    count = 0

    def seen(_frame, event, _argument):
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(seen)
    try:
        function()
    finally:
        sys.setprofile(None)
    return count


def test_elements_are_assembled_together():
    """Of each element only its material is looked at by itself, in two calls."""
    few, many = (box((10, 5, n), (0.025, 0.006, 0.003 * n)) for n in (1, 100))
    assert len(many[1]) == 100 * len(few[1]) == 5000
    assemble_bricks(*few, ALUMINIUM)  # what is imported and kept
    more = calls_of(lambda: assemble_bricks(*many, ALUMINIUM)) - calls_of(lambda: assemble_bricks(*few, ALUMINIUM))
    assert more <= 2 * (len(many[1]) - len(few[1]))


def test_quality():
    shapes = np.array(
        [CUBE, CUBE * [1, 2, 5], CUBE + np.outer(CUBE[:, 1], [0.75, 0, 0]), CUBE[[4, 5, 6, 7, 0, 1, 2, 3]]]
    )
    scaled, aspect = brick_quality(shapes.reshape(-1, 3), np.arange(32).reshape(4, 8))
    assert scaled == pytest.approx([1, 1, 0.8, -1])
    assert aspect == pytest.approx([1, 5, 1.25, 1])


NODES, ELEMENTS = box((1, 1, 3), (1.0, 1.0, 3.0))


def changed(element, place, node):
    elements = ELEMENTS.copy()
    elements[element, place] = node
    return elements


@pytest.mark.parametrize(
    ("nodes", "elements", "message"),
    [
        (NODES, changed(1, 3, 16), r"element 2 \(centre 0.571429, 0.428571, 1.57143 m\) names node 16; .* 0 to 15$"),
        (NODES, changed(2, 0, -1), r"element 3 \(centre .* m\) names node -1; there are nodes 0 to 15$"),
        (NODES, changed(1, 0, 5), r"element 2 \(centre 0.625, 0.5, 1.5 m\) names node 5 twice$"),
        (
            NODES,
            ELEMENTS[:, [4, 5, 6, 7, 0, 1, 2, 3]],
            r"element 1 \(centre 0.5, 0.5, 0.5 m\) .* near its node 1; number nodes 1 to 4",
        ),
        (NODES * [1, 1, 0], ELEMENTS, r"element 1 \(centre 0.5, 0.5, 0 m\) is turned inside out or flat"),
        (np.where(NODES == 3, np.nan, NODES), ELEMENTS, r"nodes contains NaN or Inf at index \(12, 2\)"),
        (NODES[:, :2], ELEMENTS, r"nodes must have shape \(n, 3\)"),
        (NODES, ELEMENTS[:, :7], r"elements must be node numbers of shape \(n, 8\), not int64 of shape \(3, 7\)"),
        (NODES, ELEMENTS + 0.5, "elements must be node numbers .* not float64"),
        (NODES, ELEMENTS[:0], "elements must contain at least one element"),
    ],
)
def test_bad_meshes_are_named(nodes, elements, message):
    with pytest.raises(ValueError, match=message):
        assemble_bricks(nodes, elements, ALUMINIUM)


def test_the_first_bad_element_is_named():
    nodes = NODES.copy()
    nodes[[4, 12]] = nodes[[12, 4]]
    with pytest.raises(ValueError, match=r"element 2 \(centre 0.5, 0.5, 1.75 m\) is turned inside out or flat"):
        assemble_bricks(nodes, ELEMENTS, ALUMINIUM)
    bent = [[1, -1, -1], [-1, -4, 1], [6, 3, -8], [-7, 7, -5], [-10, -10, 5], [0, -8, 5], [5, 1, 2], [-7, 3, 0]]
    with pytest.raises(ValueError, match=r"element 2 .* inside out or flat near its node 1"):
        element_matrices([CUBE, bent], ALUMINIUM)
    with pytest.raises(OverflowError, match=r"the matrices of element 1 \(centre 5e\+119, .* m\) overflow"):
        element_matrices([1e120 * CUBE], ALUMINIUM)


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"youngs_modulus": 0.0}, ValueError, "youngs_modulus must be positive, not 0"),
        ({"density": -1.0}, ValueError, "density must be positive, not -1"),
        ({"density": np.nan}, ValueError, "density must be finite"),
        ({"poisson": 0.5}, ValueError, "poisson must lie between -1 and 0.5, not 0.5"),
        ({"poisson": -1.0}, ValueError, "poisson must lie between"),
        ({"poisson": "0.3"}, TypeError, "poisson must be one real number"),
        ({"loss_factor": -0.01}, ValueError, "loss_factor must not be negative"),
    ],
)
def test_bad_materials_are_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        Material(**{"youngs_modulus": 70e9, "poisson": 0.33, "density": 2700.0, **arguments})


@pytest.mark.parametrize(
    ("arguments", "error", "message"),
    [
        ({"formulation": "C3D8"}, ValueError, "formulation must be one of reduced, incompatible, full"),
        ({"mass": "diagonal"}, ValueError, "mass must be one of consistent, lumped"),
        ({"hourglass": -0.1}, ValueError, "hourglass must not be negative"),
        ({"hourglass": None}, TypeError, "hourglass must be one real number"),
        ({"materials": [ALUMINIUM] * 2}, ValueError, "one material for each of the 1 elements, not 2"),
        ({"materials": "steel"}, TypeError, "materials must be one Material or a sequence"),
        ({"materials": [7.0]}, TypeError, "materials must be one Material or a sequence"),
        ({"coordinates": CUBE}, ValueError, r"coordinates must have shape \(n, 8, 3\), not \(8, 3\)"),
        ({"coordinates": np.zeros((0, 8, 3))}, ValueError, "coordinates must contain at least one element"),
    ],
)
def test_bad_arguments_are_refused(arguments, error, message):
    with pytest.raises(error, match=message):
        element_matrices(**{"coordinates": [CUBE], "materials": ALUMINIUM, **arguments})
