"""The hammer tests of the accuracy study: the analyser measures the structure, and the structure has the joint."""

import hammer
import impacts
import numpy as np

import jointfrf as jf

ROWS = np.eye(len(impacts.structure().shapes))[list(hammer.PLACES)]


def test_a_quiet_analyser_measures_the_receptances():
    quiet = impacts.quieter(impacts.Analyser(averages=1))
    freq, h = impacts.measured(impacts.structure(), ROWS, ROWS[:1], quiet, np.random.default_rng(0))
    inside = (freq > 20) & (freq < 1000)
    exact = impacts.structure().receptance(freq[inside], ROWS, ROWS[:1])
    error = abs(h[inside] - exact) / np.maximum(abs(exact), 0.02 * np.median(abs(exact), axis=0))
    assert np.median(error) < 1e-4
    assert np.quantile(error, 0.99) < 3e-3


def test_exact_frfs_of_the_structure_give_its_joint():
    freq = np.arange(20.0, 1000.0, 2.0)
    h = impacts.structure().receptance(freq, ROWS, ROWS)
    fit = jf.identify(freq, jf.pollute(h, 1e-3, seed=1), hammer.DOFS, transform=hammer.TRANSFORM, damping="viscous")
    for name, truth in hammer.TRUTH.items():
        assert abs(fit.value[name] - truth) < 4 * fit.std_error[name] < 0.02 * truth


def test_a_mass_is_that_of_a_loaded_structure():
    """By the formula of mass cancellation."""
    freq, place = np.arange(20.0, 1000.0, 7.0), hammer.PLACES[2]
    loaded = impacts.structure(((place, 5e-3),)).receptance(freq, ROWS[2:3], ROWS)[:, 0]
    h = impacts.structure().receptance(freq, ROWS, ROWS)
    factor = 1 / (1 - (2 * np.pi * freq) ** 2 * 5e-3 * h[:, 2, 2])
    np.testing.assert_allclose(loaded, h[:, 2] * factor[:, None], rtol=1e-6)
