"""What FRFs show of their own noise."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.frf.entry_groups import reciprocity_noise


def test_noise_from_reciprocity_is_robust():
    h = np.ones((1, 2000, 3, 3), complex)
    noisy = jf.realisations(h[0], 0.03, seed=1)
    assert reciprocity_noise(noisy)[0] == pytest.approx(0.03, rel=0.05)
    noisy[0, :100, 0, 1] *= 50  # a few FRFs gone wrong
    assert reciprocity_noise(noisy)[0] == pytest.approx(0.03, rel=0.1)
    assert reciprocity_noise(h)[0] == 0


def test_noise_from_reciprocity_does_not_count_zeros():
    h = jf.realisations(np.ones((500, 6, 6), complex), 0.03, seed=1)
    inside = np.kron(np.eye(3), np.ones((2, 2))) > 0
    h = np.where(inside, h, 1e-14 * np.random.default_rng(1).standard_normal(h.shape))
    assert reciprocity_noise(h)[0] == pytest.approx(0.03, rel=0.1)
    assert reciprocity_noise(h * np.eye(6))[0] == 0


@pytest.mark.parametrize("shape", [(0, 2, 2), (0, 0, 0), (5, 0, 2), (5, 2, 0), (1, 0, 0)])
@pytest.mark.parametrize("function", [jf.estimate_noise, jf.smooth_frfs])
@pytest.mark.parametrize("options", [{}, {"reciprocal": False}])
def test_frfs_of_nothing_are_rejected(shape, function, options):
    """Without lines the noise was an IndexError after a warning of numpy."""
    message = rf"h has no FRFs, its shape is {' x '.join(map(str, shape))}: give at least one frequency line"
    with pytest.raises(ValueError, match=message):
        function(np.arange(1.0, shape[0] + 1), np.ones(shape, complex), **options)
