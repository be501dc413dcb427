"""Receptances of models: dense, banded and modal against each other and against closed forms."""

import numpy as np
import pytest
from scipy import sparse

import jointfrf as jf


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


@pytest.mark.parametrize("method", ["dense", "banded"])
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
    for method in ("dense", "banded", "modal"):
        found = jf.receptance(freq, [[50.0]], [[0.3]], [[0.7]], 0.01, method=method)[:, 0, 0]
        np.testing.assert_allclose(found, 1 / (50 * (1 + 0.01j) - 0.3 * omega**2 + 0.7j * omega), rtol=1e-12)


@pytest.mark.parametrize("method", ["dense", "banded", "modal"])
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
        (dict(freq_hz=[1.0, np.inf]), "freq_hz holds NaN or Inf at index"),
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


def test_a_tolerance_that_cannot_be_met_leads_to_a_direct_solution_and_is_told():
    k, m = plate(9)
    arguments = dict(loss_factor=0.02, outputs=[0], inputs=[0], tolerance=1e-18, full_output=True)
    with pytest.warns(jf.ConvergenceWarning, match=r"above the tolerance 1\.0e-18"):
        h, info = jf.receptance(LINES, k, m, method="krylov", **arguments)
    assert info.method in ("dense", "banded")
    assert "reduced model" in info.reason
    assert relative_error(h, solved_by_numpy(LINES, k, m, None, 0.02, [0])) < 1e-11
    h, info = jf.receptance(LINES, k.toarray(), m.toarray(), **arguments)
    assert info.method == "banded"


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


def solved_in_long_double(freq, k, m, eta, dofs):
    """Elimination without exchanging rows in 80 bits, for symmetric matrices with a positive loss factor."""
    result = []
    for omega in 2 * np.pi * freq.astype(np.longdouble):
        z = k.astype(np.longdouble) * np.clongdouble(1 + 1j * eta) - omega**2 * m.astype(np.longdouble)
        x = np.eye(len(k), dtype=np.clongdouble)[:, dofs]
        for p in range(len(k)):
            below = slice(p + 1, min(p + 7, len(k)))
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
