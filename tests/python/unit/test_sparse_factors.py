"""Orders of elimination, factors of sparse matrices by each library, and solutions on two levels."""

import sys

import numpy as np
import pytest
from scipy import sparse

import jointfrf as jf
from jointfrf.extras import MissingPackageError
from jointfrf.models import factors as factors_module
from jointfrf.models.factors import SingularMatrixError, SparseSolver, elimination_order
from jointfrf.models.krylov import reduce_model
from jointfrf.models.matrices import ModelMatrices, as_ports

PACKAGES = {"PARDISO": "pypardiso", "MUMPS": "mumps"}
RNG = np.random.default_rng(0)


def solid_grid(*shape: int) -> sparse.csc_array:
    """Laplacian of a grid of bricks: the fill of its factors is that of a solid."""
    found = sparse.csc_array((1, 1))
    for n in shape:
        line = sparse.diags_array([-1.0, 2.5, -1.0], offsets=[-1, 0, 1], shape=(n, n))
        eye = sparse.eye_array(found.shape[0])
        found = sparse.kron(found, sparse.eye_array(n)) + sparse.kron(eye, line)
    return sparse.csc_array(found)


@pytest.fixture(params=["METIS", "nested dissection"])
def ordering(request, monkeypatch) -> str:
    if request.param == "METIS":
        pytest.importorskip("pymetis")
    else:
        monkeypatch.setitem(sys.modules, "pymetis", None)
    return request.param


def fill(matrix: sparse.csc_array, order: np.ndarray) -> int:
    """Entries of the Cholesky factor by elimination on the graph."""
    graph = matrix[order][:, order].toarray() != 0
    count = 0
    for i in range(len(graph)):
        later = np.flatnonzero(graph[i, i + 1 :]) + i + 1
        graph[np.ix_(later, later)] = True
        count += later.size + 1
    return count


def test_orders_by_dissection_keep_the_factors_small(ordering):
    matrix = solid_grid(6, 6, 24)
    order, name = elimination_order(matrix)
    assert name == ordering
    assert sorted(order) == list(range(864))
    n_grid = 6 * 6 * 24
    mixed = np.random.default_rng(1).permutation(n_grid)
    assert fill(matrix, order) < 0.8 * fill(matrix, np.arange(n_grid)) < 0.8 * fill(matrix, mixed)
    # neither does it matter in which order the DOFs are given
    again, _ = elimination_order(matrix[mixed][:, mixed])
    assert fill(matrix[mixed][:, mixed], again) < 0.8 * fill(matrix, np.arange(n_grid))


@pytest.mark.parametrize(
    "matrix",
    [
        sparse.csc_array((0, 0)),
        sparse.eye_array(1, format="csc"),
        sparse.eye_array(200, format="csc"),  # nothing is connected
        sparse.csc_array(np.ones((150, 150))),  # everything is
        sparse.block_diag([solid_grid(5, 20), solid_grid(4, 30)], format="csc"),
        sparse.csc_array(np.triu(solid_grid(9, 15).toarray())),  # not symmetric
    ],
)
def test_any_graph_is_ordered(matrix, ordering):
    order, _ = elimination_order(matrix)
    assert sorted(order) == list(range(matrix.shape[0]))


@pytest.mark.parametrize("kind", ["real", "complex"])
@pytest.mark.parametrize("library", ["SuperLU", "PARDISO", "MUMPS"])
def test_each_library_solves_what_numpy_solves(library, kind, monkeypatch):
    if library in PACKAGES:
        pytest.importorskip(PACKAGES[library], exc_type=ImportError)  # not installed, or not what it links with
    if (library, kind) == ("PARDISO", "complex"):
        pytest.skip("PARDISO factors real matrices only")
    monkeypatch.setattr(factors_module, "_DISSECTED", 100)
    a = solid_grid(5, 5, 12) - 1.7 * sparse.eye_array(300)  # indefinite
    a = sparse.csc_array(a + 0.1j * solid_grid(5, 5, 12) if kind == "complex" else a)
    found = SparseSolver(library).factor(a)
    assert found.name.startswith(library)
    assert found.is_complex == (kind == "complex")
    for b in (RNG.standard_normal(300), RNG.standard_normal((300, 3)) + 1j * RNG.standard_normal((300, 3))):
        for x, matrix in ((found.solve(b), a.toarray()), (found.solve(b, "H"), a.toarray().conj().T)):
            assert x.shape == b.shape
            np.testing.assert_allclose(x, np.linalg.solve(matrix, b), rtol=1e-9, atol=1e-9 * abs(x).max())


def test_an_adjoint_of_a_matrix_that_is_not_symmetric(monkeypatch):
    monkeypatch.setattr(factors_module, "_DISSECTED", 100)
    monkeypatch.setattr(factors_module, "_LARGE", 100)
    a = sparse.csc_array(solid_grid(10, 20) + sparse.diags_array([0.3j], offsets=[1], shape=(200, 200)))
    solver = SparseSolver()
    found = solver.factor(a, is_symmetric=False)
    assert solver.used == found.name
    assert found.name.startswith("SuperLU, ordered by")
    b = RNG.standard_normal(200)
    np.testing.assert_allclose(found.solve(b, "H"), np.linalg.solve(a.toarray().conj().T, b), rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("size", [3, 200])
def test_a_singular_matrix_is_named(size, monkeypatch):
    monkeypatch.setattr(factors_module, "_DISSECTED", 100)
    with pytest.raises(SingularMatrixError, match="a pivot is zero"):
        SparseSolver("SuperLU").factor(sparse.csc_array(np.diag(np.arange(size) * 1.0)))


def test_where_no_library_is_installed_superlu_does_it(monkeypatch):
    for package in ("pypardiso", "mumps", "pymetis"):
        monkeypatch.setitem(sys.modules, package, None)
    monkeypatch.setattr(factors_module, "_LARGE", 100)
    monkeypatch.setattr(factors_module, "_DISSECTED", 100)
    a = solid_grid(10, 20)
    assert SparseSolver().factor(a).name == "SuperLU, ordered by nested dissection"
    for library, extra in (("PARDISO", "pardiso"), ("MUMPS", "mumps")):
        with pytest.raises(MissingPackageError, match=rf"pip install 'jointfrf\[{extra}\]'"):
            SparseSolver(library).factor(a)


def test_what_a_library_cannot_do_superlu_does(monkeypatch):
    pytest.importorskip("pypardiso", exc_type=ImportError)
    monkeypatch.setattr(factors_module, "_LARGE", 2)
    monkeypatch.setitem(sys.modules, "mumps", None)
    a = sparse.csc_array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # a row of zeros crashes PARDISO
    with pytest.raises(SingularMatrixError):
        SparseSolver().factor(a)


def beam(loss_factor: float = 0.02):
    material = jf.Material(70e9, 0.33, 2700.0, loss_factor)
    return jf.brick_beam(
        0.2, 0.03, 0.02, material, divisions=(4, 3, 40), ends=("clamped", "free"), sections={"tip": 0.2}
    )


@pytest.mark.parametrize("tolerance", [1e-4, 1e-13])
def test_two_levels_find_the_error_that_complex_factors_find(tolerance, monkeypatch):
    model, freq = beam(), np.linspace(20, 9000, 50)
    matrices = ModelMatrices(model.stiffness, model.mass, None, None, model.loss_factor)
    ports = as_ports("dofs", model.ports("tip:x", "tip:y", "tip:theta_y"), matrices.n)
    assert matrices.n > 2000
    errors = []
    for limit in (0, 10**9):
        monkeypatch.setattr("jointfrf.models.krylov._ITERATED", limit)
        monkeypatch.setattr("jointfrf.models.krylov._MOST_SHIFTS", 1)  # the first space, as good as it is
        monkeypatch.setattr("jointfrf.models.krylov._VECTORS", 6)
        errors.append(reduce_model(freq, matrices, ports, ports, tolerance).error_estimate)
    assert errors[1] > 1e-9
    assert errors[0] == pytest.approx(errors[1], rel=0.02)


def test_an_iteration_that_does_not_get_there_leaves_it_to_factors(monkeypatch):
    model, freq = beam(), np.array([100.0, 5000.0])
    monkeypatch.setattr("jointfrf.models.krylov._STEPS", 1)
    ports = model.ports("tip:x", "tip:y")
    h, info = jf.receptance(
        freq, model.stiffness, model.mass, loss_factor=model.loss_factor, outputs=ports, inputs=ports, method="krylov",
        full_output=True,
    )  # fmt: skip
    exact, direct = jf.receptance(
        freq, model.stiffness, model.mass, loss_factor=model.loss_factor, outputs=ports, inputs=ports, method="sparse",
        full_output=True,
    )  # fmt: skip
    assert (info.method, direct.method) == ("krylov", "sparse")
    assert info.solver == direct.solver == "SuperLU"
    np.testing.assert_allclose(h, exact, atol=1e-8 * abs(exact).max())
