"""The figure of the noise found in FRFs."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.workbench.report.draw import draw
from jointfrf.workbench.report.receptance import noise_figure, noise_panel

NAMES = ["j:y", "j:theta", "k:y", "k:theta"]
HUM = 40


@pytest.fixture(scope="module")
def found(beams):
    """Lines in falling order, relative noise and a floor, and one line of hum."""
    # Exact FRFs: of interpolated ones, which no rational function meets, the order found hangs on rounding.
    own = np.flatnonzero((beams.freq >= 15) & (beams.freq < 615))[::2][::-1]
    freq, h = beams.freq[own], beams.gamma(beams.joint)[own]
    rng = np.random.default_rng(1)
    e = (rng.standard_normal((2, *h.shape, 2)) @ [1, 1j]) / np.sqrt(2)
    x = h * (1 + 0.02 * e[0]) + 0.02 * np.median(abs(h), axis=0) * e[1]
    x[HUM] += 3 * np.median(abs(h), axis=0) * e[1][HUM]
    return freq, x, jf.estimate_noise(freq, x)


def curves(panel):
    return {curve.label: curve for curve in panel.curves}


def test_a_panel_shows_frf_noise_and_its_parts(found):
    freq, h, noise = found
    panel = noise_panel(freq, h[:, 1, 0], noise, (1, 0), ("j:theta", "j:y"))
    shown = curves(panel)
    assert panel.log_y
    assert (panel.x_label, panel.y_label) == ("frequency, Hz", "modulus, rad/N")
    for curve in shown.values():
        assert (np.diff(curve.x) > 0).all()
    np.testing.assert_allclose(shown["measured"].y, abs(h[::-1, 1, 0]))
    np.testing.assert_allclose(shown["smooth"].y, abs(noise.smooth.h[::-1, 1, 0]))
    total = shown["noise, standard deviation"].y
    parts = np.hypot(shown["relative part"].y, shown["constant part"].y)
    np.testing.assert_allclose(parts, total, rtol=1e-9)
    out = shown["noise of outlying lines"]
    assert freq[HUM] in out.x
    np.testing.assert_allclose(out.y, np.sqrt(noise.variance[noise.outlying[::-1], 1, 0]))
    low, high = panel.y_limits
    assert low < np.quantile(total, 0.25) / 5
    assert high > abs(h[:, 1, 0]).max()


def test_a_figure_holds_each_driving_point_and_says_what_was_found(found):
    freq, h, noise = found
    figure = noise_figure(freq, h, noise, NAMES, NAMES)
    assert [panel.title for panel in figure.panels] == [f"response {name}, force {name}" for name in NAMES]
    assert "outlying line" in figure.caption
    assert f"{100 * noise.level:.2g} % of the FRFs" in figure.caption
    chosen = noise_figure(freq, h, noise, NAMES, NAMES, entries=[(0, 2)])
    assert [panel.title for panel in chosen.panels] == ["response j:y, force k:y"]
    assert draw(chosen).png.startswith(b"\x89PNG")
    rectangular = noise_figure(freq, h[:, :, :1], jf.estimate_noise(freq, h[:, :, :1]), NAMES, NAMES[:1])
    assert [panel.title for panel in rectangular.panels] == [f"response {name}, force j:y" for name in NAMES]


def test_what_coherence_tells_is_a_part(found):
    freq, h, _ = found
    squared = np.full(h.shape, 0.95)
    squared[::2] = 0.6
    e = np.random.default_rng(4).standard_normal((*h.shape, 2)) @ [1, 1j] / np.sqrt(2)
    x = h + np.sqrt((1 - squared) / (10 * squared)) * abs(h) * e
    noise = jf.estimate_noise(freq, x, coherence=squared, averages=10)
    shown = curves(noise_panel(freq, x[:, 0, 0], noise, (0, 0), ("j:y", "j:y")))
    reported = shown["part from coherence"].y
    expected = noise.coherence_factor[0, 0] * np.sqrt((1 - squared) / (10 * squared))[::-1, 0, 0] * abs(x[::-1, 0, 0])
    expected = expected * np.sqrt(noise.line_level[::-1])
    np.testing.assert_allclose(reported, expected, rtol=1e-6)


def test_frfs_without_noise_have_no_panels(beams):
    h = beams.gamma(beams.joint)
    h = (h + h.swapaxes(1, 2)) / 2
    noise = jf.estimate_noise(beams.freq[:10], h[:10])
    assert noise_figure(beams.freq[:10], h[:10], noise, NAMES, NAMES).panels == ()
