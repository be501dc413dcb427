"""Receptances of models: all methods against each other, plain inverses, closed forms, and without rigid motions."""

from itertools import product

import numpy as np
import pytest
from scipy import linalg, sparse

import jointfrf as jf
from jointfrf.models import krylov
from jointfrf.models.factors import factor
from jointfrf.models.receptance import _reciprocal_condition
from jointfrf.parallel.pool import one_thread


def model(n=12, seed=0):
    rng = np.random.default_rng(seed)
    k = (
        np.diag(rng.uniform(1e3, 2e3, n))
        - np.diag(rng.uniform(100, 400, n - 1), 1)
        - np.diag(rng.uniform(100, 400, n - 1), -1)
    )
    m = np.diag(rng.uniform(1, 2, n)) + np.diag(rng.uniform(0, 0.2, n - 2), 2)
    c = np.diag(rng.uniform(0, 2, n)) + np.diag(rng.uniform(0, 1, n - 1), -1)
    h = np.diag(rng.uniform(0, 20, n))
    return k, m, c, h


FREQ = np.array([0.0, 1.3, 4.0, 9.7])


@pytest.mark.parametrize("method", ["dense", "banded", "sparse"])
def test_against_a_plain_inverse_of_a_non_symmetric_model(method):
    k, m, c, h = model()
    found = jf.receptance(FREQ, k, m, c, 0.03, h, [3, 0], [1, 5, 11], method=method)
    for i, omega in enumerate(2 * np.pi * FREQ):
        exact = np.linalg.inv((1 + 0.03j) * k - omega**2 * m + 1j * omega * c + 1j * h)[np.ix_([3, 0], [1, 5, 11])]
        np.testing.assert_allclose(found[i], exact, rtol=1e-10)


def test_sparse_and_dense_matrices_are_the_same():
    k, m, c, h = model()
    given = [sparse.csr_array(x) for x in (k, m, c, h)]
    np.testing.assert_allclose(
        jf.receptance(FREQ, given[0], given[1], given[2], 0.03, given[3]),
        jf.receptance(FREQ, k, m, c, 0.03, h),
        rtol=1e-10,
    )


def test_modal_superposition_is_exact_with_all_modes():
    k, m, _, _ = model()
    k, m = (k + k.T) / 2, (m + m.T) / 2
    c = 0.5 * m + 1e-4 * k
    found = jf.receptance(FREQ, k, m, c, 0.02, 0.1 * k, [2, 7], method="modal")
    np.testing.assert_allclose(found, jf.receptance(FREQ, k, m, c, 0.02, 0.1 * k, [2, 7], method="dense"), rtol=1e-8)


def test_modal_refuses_what_it_cannot_do():
    k, m, c, _ = model()
    with pytest.raises(ValueError, match="stiffness is not symmetric"):
        jf.receptance(FREQ, k, m, method="modal")
    k, m = (k + k.T) / 2, (m + m.T) / 2
    with pytest.raises(ValueError, match="damping couples the modes"):
        jf.receptance(FREQ, k, m, (c + c.T) / 2, method="modal")
    with pytest.raises(ValueError, match="mass is not positive definite"):
        jf.receptance(FREQ, k, 0 * m, method="modal")


def test_single_degree_of_freedom():
    freq = np.array([0.0, 1.0, 2.0])
    omega = 2 * np.pi * freq
    for method in ("dense", "banded", "sparse", "modal"):
        found = jf.receptance(freq, [[50.0]], [[0.3]], [[0.7]], 0.01, method=method)[:, 0, 0]
        np.testing.assert_allclose(found, 1 / (50 * (1 + 0.01j) - 0.3 * omega**2 + 0.7j * omega), rtol=1e-12)


@pytest.mark.parametrize("method", ["dense", "banded", "sparse", "modal"])
def test_a_line_on_an_undamped_resonance_is_singular(method):
    freq = np.array([1.0, np.sqrt(2.0) / (2 * np.pi), 0.0])
    k, m = np.diag([4.0, 0.0]), np.diag([1.0, 1.0])
    with pytest.raises(jf.SingularLineError, match=r"line 2 \(0 Hz\)") as caught:
        jf.receptance(freq, k, m, method=method)
    assert caught.value.lines.tolist() == [2]
    assert caught.value.freq_hz.tolist() == [0.0]
    kept = jf.receptance(freq, k, m, method=method, on_singular="nan")
    assert np.isnan(kept[2]).all()
    assert np.isfinite(kept[:2]).all()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (dict(mass=np.eye(3)), r"mass must have shape \(12, 12\)"),
        (dict(stiffness=np.ones((2, 3))), r"stiffness must have shape \(n, n\)"),
        (dict(outputs=[12]), "outputs names DOF 12"),
        (dict(loss_factor=np.nan), "loss_factor must be finite"),
        (dict(freq_hz=[1.0, -2.0]), "line 1 is -2 Hz"),
        (dict(freq_hz=[1.0, np.inf]), "freq_hz contains NaN or Inf at index"),
        (dict(method="krylow"), "method must be one of"),
        (dict(mass=None), "mass is missing"),
    ],
)
def test_bad_arguments_get_one_sentence(change, message):
    k, m, _, _ = model()
    arguments = dict(freq_hz=FREQ, stiffness=k, mass=m) | change
    with pytest.raises(ValueError, match=message):
        jf.receptance(**arguments)


def test_auto_solves_a_narrow_band_as_one():
    beam = jf.beam(
        0.3, 40, youngs_modulus=1e9, density=1e3, width=0.01, height=0.01, ends=("clamped", "free"), loss_factor=0.1
    )
    freq = [10.0, 50.0]
    np.testing.assert_allclose(
        beam.receptance(freq, [5, 60]), beam.receptance(freq, [5, 60], method="dense"), rtol=1e-6
    )


def test_no_frequencies_no_lines():
    k, m, _, _ = model()
    assert jf.receptance([], k, m).shape == (0, 12, 12)


def plate(n_side, seed=3):
    """Springs and masses on a square grid: a wide band, symmetric."""
    rng = np.random.default_rng(seed)
    line = sparse.diags_array([-1.0, 2.0, -1.0], offsets=[-1, 0, 1], shape=(n_side, n_side))
    one = sparse.eye_array(n_side)
    k = 1e4 * (sparse.kron(line, one) + sparse.kron(one, line))
    m = sparse.diags_array(rng.uniform(0.5, 1.0, n_side**2))
    return sparse.csr_array(k), sparse.csr_array(m)


def solved_by_numpy(freq, k, m, c, eta, dofs):
    k, m, c = (np.zeros(k.shape) if x is None else sparse.csr_array(x).toarray() for x in (k, m, c))
    return np.array(
        [np.linalg.inv((1 + 1j * eta) * k - w**2 * m + 1j * w * c)[np.ix_(dofs, dofs)] for w in 2 * np.pi * freq]
    )


def relative_error(h, exact):
    return (abs(h - exact).max(axis=(1, 2)) / abs(exact).max(axis=(1, 2))).max()


LINES = np.linspace(1.0, 15.0, 60)


def test_krylov_meets_its_tolerance_with_few_vectors():
    k, m = plate(12)
    h, info = jf.receptance(
        LINES, k, m, loss_factor=0.02, outputs=[0, 70], inputs=[0, 70], method="krylov", full_output=True
    )
    assert info.method == "krylov"
    assert info.n_vectors < 100
    assert info.error_estimate <= info.tolerance == 1e-8
    assert relative_error(h, solved_by_numpy(LINES, k, m, None, 0.02, [0, 70])) < 1e-8


def test_krylov_takes_proportional_damping_and_outputs_that_are_not_inputs():
    k, m = plate(12)
    c = 0.3 * m + 1e-5 * k
    h, info = jf.receptance(
        LINES, k, m, c, 0.01, 0.02 * k, outputs=[5, 99, 143], inputs=[17], method="krylov", full_output=True
    )
    assert info.method == "krylov"
    exact = jf.receptance(LINES, k, m, c, 0.03, outputs=[5, 99, 143], inputs=[17], method="dense")
    assert relative_error(h, exact) < 1e-8


def test_krylov_refuses_damping_that_couples_the_modes():
    k, m = plate(9)
    c = sparse.diags_array(np.arange(81.0))
    with pytest.raises(ValueError, match="damping couples the modes"):
        jf.receptance(LINES, k, m, c, method="krylov")
    with pytest.raises(ValueError, match="stiffness is not symmetric"):
        jf.receptance(LINES, k + sparse.triu(k, 1), m, method="krylov")


def test_a_tolerance_that_cannot_be_met_leads_to_a_direct_solution_and_is_told(monkeypatch):
    monkeypatch.setattr(krylov, "_LOSS", 0)  # rounding is no excuse
    k, m = plate(9)
    arguments = dict(loss_factor=0.02, outputs=[0], inputs=[0], tolerance=1e-18, full_output=True)
    with pytest.warns(jf.ConvergenceWarning, match=r"above the tolerance 1\.0e-18"):
        h, info = jf.receptance(LINES, k, m, method="krylov", **arguments)
    assert info.method in ("dense", "banded")
    assert "reduced model" in info.reason
    assert relative_error(h, solved_by_numpy(LINES, k, m, None, 0.02, [0])) < 1e-11
    h, info = jf.receptance(LINES, k.toarray(), m.toarray(), **arguments)
    assert info.method == "banded"


def test_a_reduced_model_need_not_be_better_than_rounding():
    k, m = plate(9)
    h, info = jf.receptance(
        LINES, k, m, None, 0.02, outputs=[0], inputs=[0], method="krylov", tolerance=1e-18, full_output=True
    )
    assert info.method == "krylov"
    assert info.tolerance < info.error_estimate < 1e-12
    assert relative_error(h, solved_by_numpy(LINES, k, m, None, 0.02, [0])) < 1e-11


@pytest.mark.parametrize(
    ("n_side", "changes", "method", "reason"),
    [
        (6, {}, "dense", "small model"),
        (9, {"freq_hz": LINES[:5]}, "banded", "narrow band"),
        (9, {}, "banded", "narrow band"),
    ],
)
def test_auto_says_what_it_chose(n_side, changes, method, reason):
    k, m = plate(n_side)
    arguments = dict(freq_hz=LINES, loss_factor=0.02, outputs=[0, 5], inputs=[5]) | changes
    _, info = jf.receptance(stiffness=k, mass=m, full_output=True, **arguments)
    assert info.method == method
    assert reason in info.reason


@pytest.mark.parametrize(
    ("damping", "lines", "method", "reason"),
    [
        (None, 60, "modal", "modes the damping does not couple"),
        ("general", 60, "dense", "damping couples the modes"),
        (None, 8, "dense", "few lines: 8"),
    ],
)
def test_auto_with_full_matrices(damping, lines, method, reason):
    rng = np.random.default_rng(8)
    n = 90
    a = rng.standard_normal((n, n))
    k, m = 1e3 * (a @ a.T / n + np.eye(n)), np.diag(rng.uniform(1, 2, n))
    c = None if damping is None else np.diag(rng.uniform(0, 1, n))
    freq = LINES[:lines]
    h, info = jf.receptance(freq, k, m, c, 0.02, outputs=[3, 80], inputs=[3, 80], full_output=True)
    assert info.method == method
    assert reason in info.reason
    assert relative_error(h, solved_by_numpy(freq, k, m, c, 0.02, [3, 80])) < 1e-10


def test_auto_reduces_a_large_model_with_a_wide_band():
    k, m = plate(26)
    order = np.random.default_rng(1).permutation(26**2)  # no band is left
    k, m = k[order][:, order], m[order][:, order]
    h, info = jf.receptance(LINES, k, m, loss_factor=0.02, outputs=[0, 9], inputs=[9], full_output=True)
    assert info.method == "krylov"
    assert info.error_estimate <= 1e-8
    some = LINES[::20]
    exact = jf.receptance(some, k, m, loss_factor=0.02, outputs=[0, 9], inputs=[9], method="dense")
    assert relative_error(h[::20], exact) < 1e-8


def solved_in_long_double(freq, k, m, eta, dofs, band=6):
    """Elimination without exchanging rows in 80 bits, for symmetric matrices with a positive loss factor."""
    result = []
    for omega in 2 * np.pi * freq.astype(np.longdouble):
        z = k.astype(np.longdouble) * np.clongdouble(1 + 1j * eta) - omega**2 * m.astype(np.longdouble)
        x = np.eye(len(k), dtype=np.clongdouble)[:, dofs]
        for p in range(len(k)):
            below = slice(p + 1, min(p + 1 + band, len(k)))
            factor = z[below, p] / z[p, p]
            z[below] -= factor[:, None] * z[p]
            x[below] -= factor[:, None] * x[p]
        for p in range(len(k) - 1, -1, -1):
            x[p] = (x[p] - z[p, p + 1 :] @ x[p + 1 :]) / z[p, p]
        result.append(x[dofs])
    return np.array(result)


def test_a_chain_side_by_side_is_as_accurate_as_zgbsv():
    beam = jf.beam(0.3, 60, youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006, axial=True)
    dofs = beam.index("1:y", "1:theta", "21:y", "61:y")
    freq = np.linspace(20.0, 900.0, 16)
    k, m = beam.stiffness.toarray(), beam.mass.toarray()
    exact = solved_in_long_double(freq, k, m, 0.01, dofs)
    errors = {}
    for engine in ("lapack", "auto"):
        with jf.use_engine(engine):
            h = jf.receptance(freq, k, m, loss_factor=0.01, outputs=dofs, inputs=dofs, method="banded")
        errors[engine] = abs(h - exact).max(axis=(1, 2)) / abs(exact).max(axis=(1, 2))
    assert errors["auto"].max() < 2 * errors["lapack"].max()
    assert errors["auto"].max() < 1e-6


ALUMINIUM = jf.Material(70e9, 0.33, 2700.0, loss_factor=0.01)
ENDS = [f"{end}:{d}" for end in "ab" for d in ("x", "y", "z", "theta_x", "theta_y", "theta_z")]


def bricks(ends, size=(0.3, 0.025, 0.006), divisions=(2, 2, 20)):
    """Beam of bricks with a reference point at every end that is free."""
    sections = {"a": 0.0, "b": size[0]} if ends[0] == "free" else {"b": size[0]}
    return jf.brick_beam(*size, ALUMINIUM, ends=ends, sections=sections, divisions=divisions)


@pytest.fixture(scope="module")
def free_beam():
    return bricks(("free", "free"))


WIDE = np.linspace(1.0, 1200.0, 300)


def test_krylov_and_sparse_agree_on_a_beam_that_is_held():
    beam = bricks(("clamped", "free"), (0.08, 0.025, 0.02), (3, 3, 8))
    at = beam.index("b:x", "b:y", "b:theta_x", "51:z")
    freq = np.linspace(1.0, 17e3, 300)  # over the first six modes
    given = dict(stiffness=beam.stiffness, mass=beam.mass, loss_factor=0.01, outputs=at, inputs=at)
    h, info = jf.receptance(freq, method="krylov", tolerance=1e-9, full_output=True, **given)
    assert info.method == "krylov"
    spots = [0, 14, 62, 87, 200, 299]
    exact, direct = jf.receptance(freq[spots], method="sparse", full_output=True, **given)
    assert (direct.method, direct.reason, direct.error_estimate) == ("sparse", "as requested", None)
    assert relative_error(h[spots], exact) < 1e-9


def test_on_a_slender_beam_krylov_loses_no_more_than_a_direct_solution():
    beam = bricks(("clamped", "free"), divisions=(1, 1, 20))
    at = beam.index("b:x", "b:y", "b:theta_x", "20:z")
    given = dict(stiffness=beam.stiffness, mass=beam.mass, loss_factor=0.01, outputs=at, inputs=at)
    h, info = jf.receptance(WIDE, method="krylov", tolerance=1e-12, full_output=True, **given)
    assert info.method == "krylov"
    spots = [0, 2, 40, 150]
    k, m = beam.stiffness.toarray(), beam.mass.toarray()
    exact = solved_in_long_double(WIDE[spots], k, m, 0.01, at, band=len(k))
    sparse_error = relative_error(jf.receptance(WIDE[spots], method="sparse", **given), exact)
    assert sparse_error > 1e-12  # rounding stands in the way of the tolerance
    assert relative_error(h[spots], exact) < 3 * sparse_error


def without_rigid_motions(beam, freq, forces):
    """Elastic and rigid motion of a free body, by lines: the one regularised by M r r^T M, the other by its mass."""
    k, m = beam.stiffness.toarray(), beam.mass.toarray()
    rigid = np.zeros((len(beam.dofs), 6))
    for row, dof in enumerate(beam.dofs):
        name, direction = dof.split(":")
        place = beam.references[name] if name in beam.references else beam.mesh.nodes[int(name) - 1]
        axis = ("x", "y", "z", "theta_x", "theta_y", "theta_z").index(direction)
        for column, unit in enumerate(np.eye(6)):
            rigid[row, column] = np.append(unit[:3] + np.cross(unit[3:], place), unit[3:])[axis]
    rigid = linalg.solve_triangular(linalg.cholesky(rigid.T @ m @ rigid), rigid.T, trans="T").T
    momenta = m @ rigid
    left = forces - momenta @ (rigid.T @ forces)
    stiff = (abs(k).max() / abs(m).max()) * 1e-4
    for omega in 2 * np.pi * freq:
        elastic = np.linalg.solve((1 + 0.01j) * k - omega**2 * m + stiff * momenta @ momenta.T, left)
        yield elastic - rigid @ (momenta.T @ elastic), -rigid @ (rigid.T @ forces) / omega**2


def test_krylov_on_a_free_beam_near_0_hz(free_beam):
    """Where a direct solution has lost most of its digits."""
    at = free_beam.index(*ENDS)
    freq = np.array([1.0, 5.0, 40.0, *WIDE[50:]])
    k, m = free_beam.stiffness, free_beam.mass
    h, info = jf.receptance(freq, k, m, None, 0.01, outputs=at, inputs=at, method="krylov", full_output=True)
    assert info.method == "krylov"
    forces = np.eye(len(free_beam.dofs))[:, at]
    parts = without_rigid_motions(free_beam, freq[:3], forces)
    exact = np.array([(elastic + rigid)[at] for elastic, rigid in parts])
    size = np.sqrt(abs(np.einsum("fii->fi", exact)))
    # each entry against its own kind: metres and radians
    assert (abs(h[:3] - exact) / (size[:, :, None] * size[:, None, :])).max() < 1e-9
    direct = jf.receptance(freq[:1], k, m, None, 0.01, outputs=at, inputs=at, method="sparse")
    assert relative_error(direct, exact[:1]) > 1e-8


def test_what_strains_a_free_beam_is_as_exact_as_if_it_were_held(free_beam):
    """Equal and opposite forces: no motion as a rigid body is left to hide errors."""
    stretch = np.zeros((2, len(free_beam.dofs)))
    stretch[0, free_beam.index("b:z", "a:z")] = 1, -1
    stretch[1, free_beam.index("b:theta_x", "a:theta_x")] = 1, -1
    freq = np.array([1.0, 5.0, *WIDE[50:]])
    given = dict(loss_factor=0.01, outputs=stretch, inputs=stretch, method="krylov", full_output=True)
    h, info = jf.receptance(freq, free_beam.stiffness, free_beam.mass, **given)
    assert info.method == "krylov"
    exact = [stretch @ elastic for elastic, _ in without_rigid_motions(free_beam, freq[:2], stretch.T)]
    np.testing.assert_allclose(h[:2, [0, 1], [0, 1]], np.diagonal(exact, axis1=1, axis2=2), rtol=1e-9)
    # a bar that stretches, far below its first natural frequency
    assert h[0, 0, 0].real == pytest.approx(0.3 / (70e9 * 0.025 * 0.006), rel=0.02)


@pytest.mark.parametrize("method", ["krylov", "auto"])
def test_a_free_beam_is_singular_at_0_hz_only(free_beam, method):
    at = free_beam.index("a:y", "b:y")
    given = dict(stiffness=free_beam.stiffness, mass=free_beam.mass, loss_factor=0.01, outputs=at, inputs=at)
    freq = np.linspace(0.0, 400.0, 41)
    if method == "krylov":
        with pytest.raises(jf.SingularLineError, match=r"line 0 \(0 Hz\)"):
            jf.receptance(freq, method=method, **given)
        h = jf.receptance(freq, method=method, on_singular="nan", **given)
        assert np.isnan(h[0]).all()
    else:
        h = np.concatenate([np.full((1, 2, 2), np.nan), jf.receptance(freq[1:], method=method, **given)])
    exact = jf.receptance(freq[[2, 20, 40]], method="sparse", **given)
    assert relative_error(h[[2, 20, 40]], exact) < 1e-6


@pytest.mark.parametrize("method", ["dense", "sparse"])
def test_a_direct_solution_of_a_free_solid_at_0_hz_is_singular(free_beam, method):
    at = free_beam.index("a:y", "b:y")
    given = dict(stiffness=free_beam.stiffness, mass=free_beam.mass, outputs=at, inputs=at, method=method)
    with pytest.raises(jf.SingularLineError, match=r"line 0 \(0 Hz\)"):
        jf.receptance([0.0, 300.0], **given)
    h = jf.receptance([0.0, 300.0], on_singular="nan", **given)
    assert np.isnan(h[0]).all()
    with one_thread():  # a BLAS with several threads factors one line otherwise than two that threads share
        alone = jf.receptance([300.0], **given)
        np.testing.assert_array_equal(jf.receptance([0.0, 300.0], on_singular="nan", **given)[1:], alone)
    seen = jf.receptance([0.0, 300.0], on_singular="nan", **given | {"outputs": np.eye(len(free_beam.dofs))[at]})
    assert np.isnan(seen[0]).all()
    np.testing.assert_allclose(seen[1:], h[1:], rtol=1e-9, atol=1e-9 * abs(h[1]).max())


@pytest.mark.long
def test_96_free_beams_are_singular_at_0_hz_however_they_are_solved():
    """Rounding leaves elimination a pivot of zero in most of them, one of 1e-18 of the others in some."""
    count = 0
    sizes = product((0.05, 0.3, 2.0), (3, 10, 40, 80), ((0.025, 0.006), (0.01, 0.01)))
    for (length, n, (width, height)), element, axial in product(
        sizes, ("euler-bernoulli", "shear-flexible"), (False, True)
    ):
        shape = dict(width=width, height=height, element=element, axial=axial)
        beam = jf.beam(length, n, youngs_modulus=67e9, density=2700.0, **shape)
        count += 1
        for method in ("auto", "dense", "banded", "sparse", "modal", "krylov"):
            given = dict(loss_factor=0.01, outputs=[0], inputs=[0], method=method)
            with pytest.raises(jf.SingularLineError, match=r"line 0 \(0 Hz\)") as caught:
                jf.receptance([0.0, 50.0], beam.stiffness, beam.mass, **given)
            assert caught.value.lines.tolist() == [0]
    assert count == 96


def test_the_error_estimate_says_of_which_lines():
    k, m = plate(12)
    order = np.random.default_rng(0).permutation(k.shape[0])  # no narrow band, which is solved line by line
    k, m = k.toarray()[np.ix_(order, order)], m.toarray()[np.ix_(order, order)]
    for method, freq in (("krylov", LINES), ("auto", np.linspace(1, 15, 900))):
        given = dict(loss_factor=0.02, outputs=[0, 70], inputs=[0, 70])
        h, info = jf.receptance(freq, k, m, method=method, full_output=True, **given)
        assert info.method == {"krylov": "krylov", "auto": "modal"}[method]
        lines = np.searchsorted(freq, info.checked_hz)
        np.testing.assert_array_equal(freq[lines], info.checked_hz)
        exact = jf.receptance(freq[lines], k, m, method="sparse", **given)
        assert relative_error(h[lines], exact) == pytest.approx(info.error_estimate, rel=0.5, abs=1e-13)
    assert jf.receptance(freq[:1], k, m, outputs=[0], inputs=[0], full_output=True)[1].checked_hz == ()


@pytest.mark.parametrize("n", [1, 4, 12, 80])
def test_the_condition_of_a_sparse_line(n):
    rng = np.random.default_rng(n)
    z = sparse.csc_matrix(np.diag(10.0 ** rng.uniform(-4, 2, n)) + 0.1 * rng.standard_normal((n, n)) / n + 0.01j)
    found = _reciprocal_condition(z, factor(z))
    exact = 1 / np.linalg.cond(z.toarray(), 1)
    assert exact * (1 - 1e-10) < found < 3 * exact


def coupled_plate(n_side):
    """A wide band without order, and damping that couples the modes."""
    k, m = plate(n_side)
    rng = np.random.default_rng(4)
    order = rng.permutation(n_side**2)
    k, m = k[order][:, order], m[order][:, order]
    c = sparse.diags_array(rng.uniform(0, 5, n_side**2))
    h = sparse.diags_array(rng.uniform(0, 50, n_side**2))
    return k, m, sparse.csr_array(c), sparse.csr_array(h)


def test_auto_factors_a_large_model_of_few_entries_whose_damping_couples_the_modes():
    k, m, c, h = coupled_plate(26)
    found, info = jf.receptance(LINES, k, m, c, 0.02, h, outputs=[0, 9], inputs=[9], full_output=True)
    assert (info.method, info.reason) == ("sparse", "damping couples the modes")
    assert (info.error_estimate, info.tolerance, info.n_vectors) == (None, None, None)
    for i in (0, 31, 59):
        z = (1 + 0.02j) * k + 1j * h + 2j * np.pi * LINES[i] * c - (2 * np.pi * LINES[i]) ** 2 * m
        exact = np.linalg.solve(z.toarray(), np.eye(26**2)[:, [9]])[[0, 9]]
        np.testing.assert_allclose(found[i], exact, rtol=1e-9)
    assert jf.receptance(LINES[:3], k, m, c, full_output=True, outputs=[0], inputs=[0])[1].method == "sparse"


METHODS = ["auto", "dense", "banded", "sparse", "modal", "krylov"]


@pytest.mark.parametrize("kind", [np.asarray, sparse.csr_array, sparse.coo_array, np.ndarray.tolist])
@pytest.mark.parametrize("method", METHODS)
def test_weights_are_products_with_the_whole_matrix(method, kind):
    k, m = plate(9)
    rng = np.random.default_rng(5)
    to, into = np.zeros((4, 81)), np.zeros((2, 81))
    to[0, [3, 4, 5]] = 1 / 3  # a mean
    to[1, [70, 10]] = 1, -1  # a difference
    to[2, rng.integers(0, 81, 20)] = rng.standard_normal(20)
    into[0, 70] = -2.5
    into[1, [8, 3]] = 0.5
    whole = solved_by_numpy(LINES, k, m, None, 0.02, range(81))
    given = dict(loss_factor=0.02, method=method)
    found = jf.receptance(LINES, k, m, outputs=kind(to), inputs=kind(into), **given)
    np.testing.assert_array_equal(found[:, 3], 0)  # a row without weights
    assert relative_error(found, to @ whole @ into.T) < 1e-8
    dofs = jf.receptance(LINES, k, m, outputs=[5, 70, 5], inputs=kind(into), **given)
    assert relative_error(dofs, whole[:, [5, 70, 5]] @ into.T) < 1e-8
    np.testing.assert_allclose(dofs[:, 0], dofs[:, 2], rtol=1e-12)


@pytest.mark.parametrize("method", METHODS)
def test_weights_that_are_all_zero_see_nothing(method):
    k, m = plate(9)
    given = dict(loss_factor=0.02, method=method)
    assert not jf.receptance(LINES, k, m, outputs=np.zeros((2, 81)), inputs=[4], **given).any()
    assert not jf.receptance(LINES, k, m, outputs=np.zeros((2, 81)), inputs=np.zeros((1, 81)), **given).any()
    assert jf.receptance(LINES, k, m, outputs=np.zeros((0, 81)), inputs=[4], **given).shape == (60, 0, 1)


@pytest.mark.parametrize("method", METHODS)
def test_results_go_where_the_caller_wants_them(method):
    k, m = plate(9)
    for at in ([4, 8], np.eye(81)[[4, 8]]):
        out = np.full((60, 2, 2), np.nan + 0j)
        arguments = dict(loss_factor=0.02, outputs=at, inputs=at, method=method)
        assert jf.receptance(LINES, k, m, out=out, **arguments) is out
        np.testing.assert_allclose(out, jf.receptance(LINES, k, m, **arguments), rtol=1e-12)
        with pytest.raises(ValueError, match=r"out must have shape \(60, 2, 2\), not \(60, 2, 3\)"):
            jf.receptance(LINES, k, m, out=np.zeros((60, 2, 3), complex), **arguments)


def test_a_bad_line_of_a_sparse_sweep_leaves_the_others():
    k, m = sparse.diags_array([4.0, 9.0, 1.0]), sparse.eye_array(3)
    freq = np.array([0.1, 3 / (2 * np.pi), 0.7])
    k = sparse.csr_array(k) * (1 / 9)
    m = sparse.csr_array(m) * (1 / ((2 * np.pi * freq[1]) ** 2))
    out = np.zeros((3, 3, 3), complex)
    with pytest.raises(jf.SingularLineError, match=r"line 1 \(0.477465 Hz\)") as caught:
        jf.receptance(freq, k, m, method="sparse", out=out)
    assert caught.value.lines.tolist() == [1]
    kept = jf.receptance(freq, k, m, method="sparse", on_singular="nan")
    np.testing.assert_array_equal(kept, out)
    assert np.isnan(kept[1]).all()
    omega = 2 * np.pi * freq[[0, 2], None]
    exact = 1 / (np.array([4, 9, 1]) / 9 - omega**2 / (2 * np.pi * freq[1]) ** 2)
    np.testing.assert_allclose(np.diagonal(kept[[0, 2]], axis1=1, axis2=2), exact, rtol=1e-12)


@pytest.mark.parametrize(
    ("outputs", "error", "message"),
    [
        (np.ones((2, 11)), ValueError, r"outputs must be DOFs, or weights of shape \(m, 12\), not \(2, 11\)"),
        (sparse.csr_array((2, 11)), ValueError, r"outputs must be DOFs, or weights of shape \(m, 12\), not \(2, 11\)"),
        (np.full((1, 12), np.nan), ValueError, "outputs contains NaN or Inf"),
        (sparse.csr_array(np.full((1, 12), np.inf)), ValueError, "outputs contains NaN or Inf"),
        (1j * np.ones((1, 12)), TypeError, "outputs must contain real numbers, not complex128"),
        (sparse.csr_array(1j * np.ones((1, 12))), TypeError, "outputs must contain real numbers, not complex128"),
        (np.ones((1, 12, 1)), TypeError, "outputs must be a list of DOF numbers"),
        ([0.5], TypeError, "outputs must be a list of DOF numbers"),
    ],
)
def test_bad_weights_get_one_sentence(outputs, error, message):
    k, m, _, _ = model()
    with pytest.raises(error, match=message):
        jf.receptance(FREQ, k, m, outputs=outputs)


@pytest.mark.parametrize("side", ["lower", "upper"])
@pytest.mark.parametrize("name", ["stiffness", "mass", "damping"])
@pytest.mark.parametrize("kind", [np.asarray, sparse.csr_array])
def test_half_a_symmetric_matrix_is_refused_and_completed_when_asked(side, name, kind):
    """Finite-element programs write one triangle; taken as it is, receptances are wrong by far."""
    k, m, c, _ = model()
    whole = {"stiffness": k + k.T, "mass": m + m.T, "damping": c + c.T}
    half = np.tril if side == "lower" else np.triu
    given = {key: kind(half(x) if key == name else x) for key, x in whole.items()}
    with pytest.raises(ValueError, match=f"{name} contains its {side} triangle only.*from_triangle"):
        jf.receptance(FREQ, **given)
    given[name] = jf.from_triangle(given[name])
    np.testing.assert_allclose(jf.receptance(FREQ, **given), jf.receptance(FREQ, **whole), rtol=1e-10)


def test_a_whole_matrix_is_not_completed():
    with pytest.raises(ValueError, match="both sides of the diagonal"):
        jf.from_triangle(model()[0])
    with pytest.raises(ValueError, match=r"must have shape \(n, n\), not \(2, 3\)"):
        jf.from_triangle(np.zeros((2, 3)))


@pytest.mark.parametrize("dtype", [object, "U32"])
def test_matrices_that_hold_no_numbers_get_one_sentence(dtype):
    with pytest.raises(TypeError, match="stiffness must contain real numbers, not"):
        jf.receptance(FREQ, np.eye(2).astype(dtype), np.eye(2))


def test_numbers_of_another_byte_order_are_numbers():
    k, m, _, _ = model()
    given = [(x + x.T).astype(">f8") for x in (k, m)]
    np.testing.assert_allclose(jf.receptance(FREQ, *given), jf.receptance(FREQ, k + k.T, m + m.T), rtol=1e-9)


def test_a_model_takes_names_of_dofs():
    beam = jf.beam(0.3, 2, youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006)
    h = beam.receptance([50.0, 60.0])
    named = beam.receptance([50.0, 60.0], ["3:y", "1:theta"], "2:y")
    np.testing.assert_allclose(named[:, :, 0], h[:, [4, 1], 2], rtol=1e-9)
    with pytest.raises(ValueError, match="the model has no DOF '9:y'"):
        beam.receptance([50.0], ["9:y"])


def test_a_model_has_a_name_for_each_dof():
    with pytest.raises(ValueError, match="dofs must name 2 different DOFs of stiffness, not 1"):
        jf.Model(np.eye(2), np.eye(2), ("1:x",))
