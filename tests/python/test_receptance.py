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
