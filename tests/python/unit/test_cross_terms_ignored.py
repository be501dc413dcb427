"""Cross terms of a few percent that are not sought: intervals contain 1/C_dd and stay narrow."""

import warnings

import numpy as np
import pytest

import jointfrf as jf

FREQ = np.arange(15.0, 800.0, 2.0)
SECTION = {"youngs_modulus": 67e9, "density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01}
K, C = np.array([6e5, 5e3]), np.array([20.0, 1.5])


def coupled(share):
    a = jf.beam(0.3, 12, ends=("clamped", "free"), **SECTION)
    b = jf.beam(0.225, 9, **SECTION)
    h_a = a.receptance(FREQ, a.index("13:y", "13:theta"))
    h_b = b.receptance(FREQ, b.index("1:y", "1:theta"))
    k = np.zeros((FREQ.size, 2, 2), complex)
    k[:, [0, 1], [0, 1]] = K + 2j * np.pi * FREQ[:, None] * C
    k[:, 0, 1] = k[:, 1, 0] = share * np.sqrt(K[0] * K[1])
    stiffness = (1 / np.einsum("ldd->ld", np.linalg.inv(k))).real.mean(axis=0)
    return jf.couple(h_a, h_b, k, [0, 1], [0, 1]), stiffness


@pytest.mark.parametrize("share", [0.005, 0.02])
def test_small_cross_terms_make_intervals_neither_wrong_nor_wide(share):
    h, stiffness = coupled(share)
    errors, widths = [], []
    for seed in range(10):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            fit = jf.identify(FREQ, jf.pollute(h, 0.003, seed=seed), ["y", "theta"], damping="viscous")
        assert "cross-terms-ignored" in {one.code for one in fit.findings}
        limits = fit.confidence_interval()
        errors.append([fit.value["k_y"], fit.value["k_theta"]] - stiffness)
        widths.append([np.ptp(limits[name]) / 2 for name in ("k_y", "k_theta")])
    rmse = np.sqrt(np.square(errors).mean(axis=0))
    ratio = np.median(widths, axis=0) / (1.96 * rmse)
    assert (ratio > 0.5).all()
    assert (ratio < 4).all()
