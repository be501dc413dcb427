"""Expansion of measured FRFs by a model, against its definition: parent, removed and overlay model coupled."""

import numpy as np
import pytest

import jointfrf as jf

FREQ = np.linspace(20, 500, 30)
OUT = [4, 8]


def structures():
    section = {"density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.02}
    real = jf.beam(0.3, 5, ends=("clamped", "free"), youngs_modulus=67e9, **section).receptance(FREQ)
    model = jf.beam(0.3, 5, ends=("clamped", "free"), youngs_modulus=62e9, **section).receptance(FREQ)
    return real, model


def coupled(model, measured, removed_at, out):
    """Dual assembly (LM-FBS) of parent, minus removed, plus measured: u_par = u_rem where removed, u_rem = u_meas."""
    n, r, m = model.shape[1], len(removed_at), len(out)
    y = np.zeros((len(model), n + r + m, n + r + m), complex)
    y[:, :n, :n] = model
    y[:, n : n + r, n : n + r] = -model[:, removed_at][:, :, removed_at]
    y[:, n + r :, n + r :] = measured
    b = np.zeros((r + m, n + r + m))
    b[np.arange(r), removed_at] = 1
    b[np.arange(r), n + np.arange(r)] = -1
    b[r + np.arange(m), n + np.array([list(removed_at).index(dof) for dof in out])] = 1
    b[r + np.arange(m), n + r + np.arange(m)] = -1
    # B Y B^T is singular by construction where the removed model cancels the parent: the pseudo-inverse of LM-FBS.
    inner = np.linalg.pinv(b @ y @ b.T, rcond=1e-11)
    return (y - y @ b.T @ inner @ b @ y)[:, :n, :n]


def test_original_is_the_coupling_of_three_models():
    real, model = structures()
    measured = real[:, OUT][:, :, OUT]
    mixed = jf.semm(model, measured, OUT, method="original")
    assert np.allclose(mixed, coupled(model, measured, OUT, OUT), rtol=1e-6, atol=1e-9 * abs(mixed).max())


@pytest.mark.parametrize("method", ["original", "extended"])
def test_what_is_measured_is_kept_and_an_exact_model_is_not_changed(method):
    real, model = structures()
    measured = real[:, OUT][:, :, OUT[:1]]
    mixed = jf.semm(model, measured, OUT, OUT[:1], method=method)
    if method == "extended":
        assert np.allclose(mixed[:, OUT][:, :, OUT[:1]], measured, rtol=1e-7)
    exact = jf.semm(real, measured, OUT, OUT[:1], method=method)
    assert np.allclose(exact, real, rtol=1e-9, atol=1e-14)
    square = jf.semm(model, real[:, OUT][:, :, OUT], OUT, method=method)
    assert np.allclose(square[:, OUT][:, :, OUT], real[:, OUT][:, :, OUT], rtol=1e-6, atol=1e-9 * abs(real).max())


def test_all_dofs_measured_give_the_measurement_and_the_extended_method_keeps_less_of_the_model():
    real, model = structures()
    assert np.allclose(jf.semm(model, real, range(10), rcond=1e-15), real, rtol=1e-4, atol=1e-6 * abs(real).max())
    at = [0, 4, 8]
    errors = [
        abs(jf.semm(model, real[:, at][:, :, at], at, method=method)[:, 6, 6] - real[:, 6, 6]).sum()
        for method in ("original", "extended")
    ]
    assert max(errors) < 0.5 * abs(model[:, 6, 6] - real[:, 6, 6]).sum()


def test_what_is_wrong_is_one_sentence():
    real, model = structures()
    with pytest.raises(ValueError, match="h_model must be square"):
        jf.semm(model[:, :, :3], real[:, :2, :2], [0, 1])
    with pytest.raises(ValueError, match="h_measured"):
        jf.semm(model, real[:, :3, :2], [0, 1])


@pytest.mark.parametrize("method", ["original", "extended"])
@pytest.mark.parametrize("kind", ["square", "rectangular", "reciprocal"])
def test_standard_errors_are_the_scatter_of_draws(method, kind):
    """The measured FRFs drawn many times: the scatter of what they are expanded to, and how often intervals hold."""
    real, model = structures()
    into = OUT[:1] if kind == "rectangular" else OUT
    truth = real[:, OUT][:, :, into]
    variance = (0.02 * abs(truth)) ** 2
    rng = np.random.default_rng(5)
    shape = (400, *truth.shape)
    noise = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)
    if kind == "reciprocal":
        noise[:, :, 1, 0] = noise[:, :, 0, 1]
    drawn = truth + noise * np.sqrt(variance)
    given = truth if kind == "reciprocal" else drawn[0]
    error = jf.semm_standard_error(model, given, OUT, into, noise=variance, method=method)
    without = jf.semm(model, truth, OUT, into, method=method)
    apart = np.array([jf.semm(model, one, OUT, into, method=method) for one in drawn]) - without
    seen = error > 1e-6 * error.max(axis=(1, 2), keepdims=True)
    # A mean of 400 |e|^2 is known to 5 %; over lines and entries to less.
    ratio = np.sqrt((abs(apart) ** 2).mean(axis=0))[seen] / error[seen]
    assert np.median(ratio) == pytest.approx(1, abs=0.02)
    assert abs(ratio - 1).max() < 0.15
    held = (abs(apart.real) < 1.96 / np.sqrt(2) * error).mean(axis=0)[seen]
    assert held.mean() == pytest.approx(0.95, abs=0.01)


def test_noise_of_an_expansion_is_found_where_it_is_not_said():
    freq = np.linspace(20, 500, 241)
    section = {"density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.02}
    real, model = (
        jf.beam(0.3, 5, ends=("clamped", "free"), youngs_modulus=e, **section).receptance(freq) for e in (67e9, 62e9)
    )
    measured = jf.pollute(real[:, OUT][:, :, OUT], 0.02, seed=4)
    said = jf.semm_standard_error(model, measured, OUT, noise=0.02)
    found = jf.semm_standard_error(model, measured, OUT, freq_hz=freq)
    assert np.median(found / said) == pytest.approx(1, rel=0.1)
    with pytest.raises(ValueError, match="freq_hz is missing, from which the noise"):
        jf.semm_standard_error(model, measured, OUT)
    with pytest.raises(ValueError, match="noise must not be negative"):
        jf.semm_standard_error(model, measured, OUT, noise=-1)
    with pytest.raises(ValueError, match="h_measured has too few lines or too little noise"):
        jf.semm_standard_error(model[:3], measured[:3, :, :1], OUT, OUT[:1], freq_hz=freq[:3])
