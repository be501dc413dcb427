"""What a fit reports: each sentence for its cause, and none without."""

import re
from dataclasses import replace

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.identification.describe import describe_springs
from jointfrf.identification.manifold.fit import DofDamping, fit_springs
from jointfrf.identification.manifold.prepare import FitOptions, prepare_compliance
from jointfrf.identification.noise import NoiseOptions
from jointfrf.identification.prepare import as_measured
from jointfrf.identification.residual_test import ResidualTest, Trend
from jointfrf.messages.finding import as_warning

LEVEL = 0.01


def between(s, stiffness):
    """FRFs at the joint of the assembly for any K*(w)."""
    h = jf.couple(s.h_a, s.h_b, stiffness, s.at, s.at)
    dofs = s.at + [2 * s.n + i for i in s.at]
    return h[:, dofs][:, :, dofs]


def fit_of(freq, h, dofs, *, noise=LEVEL, damping="viscous", cross="zero"):
    """Return the fit described."""
    options = FitOptions(damping, cross, True)
    problem = prepare_compliance(as_measured(freq, h, square=False), dofs, None, None, NoiseOptions(noise), options)
    return describe_springs(fit_springs(problem), problem)


class Found:
    """A fit with its problem, numbers of which may be changed."""

    def __init__(self, fit, problem):
        self.fit, self.problem = fit, problem

    def described(self):
        return describe_springs(self.fit, self.problem)

    def with_(self, **change):
        return Found(self.fit._replace(**change), self.problem)

    def of_noise(self, **change):
        return Found(self.fit, replace(self.problem, noise=replace(self.problem.noise, **change)))

    def of_groups(self, **change):
        groups = tuple(replace(one, **change) for one in self.fit.estimate.groups)
        return self.with_(estimate=self.fit.estimate._replace(groups=groups))

    def of_intervals(self, **limits):
        """Other intervals of some parameters."""
        known = self.fit.intervals(0.95)
        return self.with_(intervals=lambda probability: known | limits)


@pytest.fixture(scope="module")
def found(beams):
    """A fit of which there is nothing to tell."""
    gamma = as_measured(beams.freq, jf.pollute(beams.gamma(beams.joint), LEVEL, seed=3), square=False)
    options = FitOptions("viscous", "zero", True)
    problem = prepare_compliance(gamma, ["y", "theta"], None, None, NoiseOptions(LEVEL), options)
    return Found(fit_springs(problem), problem)


def test_nothing_to_tell(found):
    described = found.described()
    assert described.findings == ()
    np.testing.assert_array_equal(described.estimate, found.fit.estimate.theta)


def test_a_fit_that_did_not_converge_warns_of_its_own_kind(found):
    described = found.of_groups(converged=False, iterations=17).described()
    assert [type(as_warning(one)) for one in described.findings] == [jf.ConvergenceWarning]
    assert [one.text for one in described.findings] == [
        "the fit did not converge in 17 iterations. Fit fewer terms, or start nearer to the joint"
    ]


@pytest.mark.parametrize(("margin", "strength"), [(11.0, "clearly"), (3.0, "weakly"), (1.0, "hardly")])
def test_how_the_damping_of_each_dof_was_chosen(found, margin, strength):
    choices = (DofDamping("y", "viscous", "both", margin), DofDamping("theta", "hysteretic", "none", 50.0))
    assert found.with_(choices=choices).described().notes == (
        f"damping of y: viscous, {strength} preferred to both (difference of BIC {margin:.1f}) [damping-chosen]",
        "damping of theta: hysteretic, clearly preferred to none (difference of BIC 50.0) [damping-chosen]",
    )


def test_damping_chosen_by_the_data_is_told_by_dof(beams):
    joint = jf.Joint([6e5, 5e3], [20, 0], ["y", "theta"], structural_damping=[0, 400])
    fit = fit_of(beams.freq, jf.pollute(beams.gamma(joint), LEVEL, seed=3), ["y", "theta"], damping="auto")
    assert [note.split(",")[0] for note in fit.notes] == ["damping of y: viscous", "damping of theta: hysteretic"]
    assert list(fit.value) == ["k_y", "k_theta", "h_theta", "c_y"]


def test_a_level_from_the_residual_is_noted(found, chains):
    (note,) = found.of_noise(is_assumed=True).described().notes
    assert note.endswith("[noise-from-residual]")
    h = chains.gamma(chains.joint)
    assert fit_of(chains.freq, (h + h.swapaxes(1, 2)) / 2, ["x"], noise=None).notes == (note,)


def test_correlated_noise_is_noted_by_the_number_of_independent_lines(found, beams):
    assert not found.of_noise(inflation=1.1).described().notes
    assert found.of_noise(inflation=4.0).described().notes == (
        "the noise of neighbouring lines is correlated: 158 lines count as 40 independent ones [correlated-lines]",
    )
    e = np.random.default_rng(2).standard_normal((beams.freq.size + 3, 4, 4, 2)) @ [1, 1j]
    mean_of_four = (e[:-3] + e[1:-2] + e[2:-1] + e[3:]) / np.sqrt(8)
    fit = fit_of(beams.freq, beams.gamma(beams.joint) * (1 + LEVEL * mean_of_four), ["y", "theta"], noise=None)
    (note,) = fit.notes
    assert 30 < float(note.split("count as ")[1].split()[0]) < 60


def test_outlying_lines_are_listed(found, beams):
    start = "lines with far more noise than their neighbours get less weight: "
    (note,) = found.of_noise(outlying=np.arange(9)).described().notes
    assert note == start + "15, 20, 25, 30 and 5 more Hz [noisy-lines]"
    exact, hum = beams.gamma(beams.joint), [20, 90]
    h = jf.pollute(exact, LEVEL, seed=3)
    h[hum] = jf.pollute(exact[hum], 0.3, seed=9)
    assert fit_of(beams.freq, h, ["y", "theta"], noise=None).notes == (start + "115, 465 Hz [noisy-lines]",)


def test_damping_that_may_be_zero_is_noted_but_not_a_stiffness(found):
    described = found.of_intervals(c_y=(-1.0, 2.0)).described()
    assert described.notes == ("not significantly different from zero (95 %): c_y [damping-insignificant]",)
    assert not described.warnings


@pytest.mark.parametrize(
    ("limits", "text"),
    [
        ((2000.0, 8000.0), "k_theta is poorly determined: 95 % interval 2e+03 to 8e+03 N m/rad"),
        (
            (3210.0, np.inf),
            "k_theta cannot be distinguished from rigid: at least 3.21e+03 N m/rad (95 %)",
        ),
        ((0.0, np.inf), "the FRFs give no bound of k_theta, from free to rigid (95 %)"),
        ((0.0, 8000.0), "k_theta is not significantly different from zero, at most 8e+03 N m/rad (95 %)"),
    ],
)
def test_stiffnesses_that_the_data_do_not_determine(found, limits, text):
    (told_of_it,) = found.of_intervals(k_theta=limits).described().findings
    assert told_of_it.text.partition(", best estimate ")[0].partition(". ")[0] == text


def test_an_interval_as_wide_as_the_value_is_not_yet_poor(found):
    k = found.described().value["k_theta"]
    assert not found.of_intervals(k_theta=(0.51 * k, 1.49 * k)).described().warnings


def test_a_rigid_dof_is_told_with_a_bound_below_it(beams):
    k = beams.joint.dynamic_stiffness(beams.freq)
    k[:, 0, 0] = 1e13
    fit = fit_of(beams.freq, jf.pollute(between(beams, k), LEVEL, seed=3), ["y", "theta"])
    told_of_k = "k_y cannot be distinguished from rigid: at least "
    assert any(text.startswith(told_of_k) for text in fit.warnings)
    assert any(one.code == "damping-insignificant" and one.about == ("c_y",) for one in fit.findings)


def test_damping_of_the_other_time_convention_is_negative(beams):
    h = jf.pollute(beams.gamma(beams.joint), LEVEL, seed=4).conj()
    fit = fit_of(beams.freq, h, ["y", "theta"])
    for name in ("c_y", "c_theta"):
        assert any(text.startswith(f"{name} is significantly negative, -") for text in fit.warnings)
    assert fit.damping[0] == pytest.approx(-20, rel=0.03)


def test_a_residual_below_the_noise_is_told(beams):
    fit = fit_of(beams.freq, jf.pollute(beams.gamma(beams.joint), LEVEL, seed=3), ["y", "theta"], noise=2 * LEVEL)
    assert not fit.warnings
    (text,) = (note for note in fit.notes if "residual" in note)
    assert text == "the residual is 0.5 times the noise given: intervals are wider than necessary [residual-small]"


def test_a_residual_above_the_noise_is_told(beams):
    h = jf.pollute(beams.gamma(beams.joint), LEVEL, seed=3)
    (text,) = fit_of(beams.freq, h, ["y", "theta"], noise=LEVEL / 2).warnings
    assert text.startswith("the residual is 2.01 times the noise, 36 sigma above it")
    assert text.endswith("[residual-large]")


def test_no_residual_is_compared_with_a_level_that_it_gave(found):
    far = ResidualTest(2.0, 0.05)
    assert "2.00 times the noise" in found.with_(test=far).described().warnings[0]
    assert not found.with_(test=far).of_noise(is_assumed=True).described().warnings


def test_exact_frfs_made_reciprocal_show_no_noise(beams):
    """What a rational function leaves of them is its own error."""
    h = beams.gamma(beams.joint)
    fit = fit_of(beams.freq, (h + h.swapaxes(1, 2)) / 2, ["y", "theta"], noise=None)
    assert fit.warnings == ()
    assert fit.noise_level < 1e-9


def test_noise_said_of_a_mean_of_two(beams):
    h = jf.pollute(beams.gamma(beams.joint), LEVEL, seed=3)
    fit = fit_of(beams.freq, (h + h.swapaxes(1, 2)) / 2, ["y", "theta"])
    (text,) = (note for note in fit.notes if "residual" in note)
    assert "perhaps because h_pq and h_qp are means" in text


def test_noise_said_by_part(beams):
    h = jf.pollute(beams.gamma(beams.joint), 0.1, "complex-per-part", seed=3)
    (text,) = fit_of(beams.freq, h, ["y", "theta"], noise=0.1).warnings
    assert re.match(
        r"the residual is 1\.4\d times the noise, .* Give the noise of real and imaginary part together", text
    )


@pytest.mark.parametrize("seed", [1, 2])
def test_the_residual_of_large_noise_is_that_said(chains, seed):
    """Smooth FRFs by weights that noise has changed would be too small, and the residual too large for them."""
    fit = fit_of(chains.freq, jf.pollute(chains.gamma(chains.joint), 0.5, seed=seed), ["x"], noise=0.5)
    assert fit.residual_level == pytest.approx(0.5, rel=0.045)


def test_a_local_misfit_names_the_lines(found):
    local = ResidualTest(2.0, 0.05, local=((300.0, 350.0, 0.8), (100.0, 105.0, 0.2)))
    (text,) = found.with_(test=local).described().warnings
    assert "most of the excess at 300-350 Hz (80 %), 100-105 Hz (20 %)" in text


def test_a_trend_names_the_parameter_and_where_it_is_least_and_largest(found):
    trend = Trend("k_y", np.array([50.0, 200.0, 600.0]), np.array([6e5, 5e5, 7e5]), 1e-6)
    assert found.with_(test=ResidualTest(1.0, 0.05, trends=(trend,))).described().warnings == (
        "k_y changes over frequency: 5e+05 near 200 Hz, 7e+05 near 600 Hz. Fit a law of frequency (--law), or narrow "
        "the band [frequency-dependent]",
    )


def test_a_stiffness_that_drifts_over_the_band_is_told(beams):
    k = beams.joint.dynamic_stiffness(beams.freq)
    k[:, 1, 1] *= np.linspace(1, 1.2, beams.freq.size)
    texts = fit_of(beams.freq, jf.pollute(between(beams, k), LEVEL, seed=3), ["y", "theta"]).warnings
    assert any(text.startswith("k_theta changes over frequency: ") for text in texts)
    assert not any(text.startswith("k_y changes") for text in texts)


def coupled(beams, k_cross, seed):
    k = beams.joint.dynamic_stiffness(beams.freq)
    k[:, 0, 1] = k[:, 1, 0] = k_cross
    return jf.pollute(between(beams, k), LEVEL, seed=seed)


def test_coupled_dofs_are_told_instead_of_what_follows_from_them(beams):
    h = coupled(beams, 2e4, 3)
    text, *more = fit_of(beams.freq, h, ["y", "theta"]).warnings
    assert not any("residual" in one or "rejected" in one or "changes over" in one for one in more)
    assert "no joint without cross terms fits y, theta, so cross terms were ignored" in text
    assert not fit_of(beams.freq, h, ["y", "theta"], cross="fit").warnings


def test_cross_terms_ignored_cost_no_lines(beams):
    """What is unknown of the compliance moves with the fit on lines that do not fit yet."""
    fit = fit_of(beams.freq, coupled(beams, 2e3, 4), ["y", "theta"], cross="ignore")
    assert not fit.warnings
    # 1/C_dd, which is k less 0.1 %.
    np.testing.assert_allclose(fit.stiffness, [599207, 4997.3], rtol=0.01)


def test_lines_that_do_not_fit_are_counted_unless_cross_terms_explain_them(found):
    used = np.arange(158) >= 10
    out = found.of_groups(used=used)
    (one,) = out.described().findings
    assert (one.code, one.numbers["rejected"], one.numbers["total"]) == ("lines-rejected", 10, 158)
    assert not out.with_(cross_fits=True).described().warnings
    assert not found.of_groups(used=np.arange(158) >= 3).described().warnings


def test_random_phases_on_ten_lines_are_left_out(beams):
    h = jf.pollute(beams.gamma(beams.joint), LEVEL, seed=3)
    h[60:70] = abs(h[60:70]) * np.exp(2j * np.pi * np.random.default_rng(1).random((10, 4, 4)))
    fit = fit_of(beams.freq, h, ["y", "theta"])
    # A neighbour may go with them: smooth FRFs see across it.
    (text,) = fit.warnings
    words = (
        r"1[0-2] of 158 lines of y, theta do not fit the joint and are rejected; with them the residual is \S+ times"
    )
    assert re.match(words, text)
    # The verdict is on all lines of the band, the numbers are of those that fit.
    assert fit.test.ratio < 1.1
    assert fit.test.whole > 3
    assert not fit.residual_is_noise
    np.testing.assert_allclose(fit.stiffness, [6e5, 5e3], rtol=0.02)


def test_intervals_widened_by_scatter_are_told(found):
    known = found.fit.known
    spread = known.spread._replace(chance=np.array([0.5, 1e-6, 1e-3, 1e-5]))
    wide = found.with_(known=known._replace(spread=spread))
    assert wide.described().warnings == (
        "parts of the band scatter more than the noise explains; the intervals of k_theta, c_theta are widened. Look "
        "for flexible sides, local modes or a missing DOF [band-scatter]",
    )
    exact = wide.with_(problem=replace(wide.fit.problem, noise=replace(wide.fit.problem.noise, level=1e-12)))
    assert not exact.described().warnings


def two_chains(chains):
    """Two assemblies side by side that do not know each other: joint DOFs x and y."""
    gamma = chains.gamma(chains.joint)
    h = np.zeros((len(gamma), 4, 4), complex)
    h[:, ::2, ::2], h[:, 1::2, 1::2] = (jf.pollute(gamma, LEVEL, seed=seed) for seed in (1, 2))
    return h


def test_groups_are_named(chains):
    text = "the FRFs between (x) and (y) are zero: each group is fitted separately"
    assert fit_of(chains.freq, two_chains(chains), ["x", "y"]).notes == (f"{text} [separate-groups]",)
    coupled = fit_of(chains.freq, two_chains(chains), ["x", "y"], cross="fit")
    assert coupled.notes == (f"{text}, without cross terms between them [separate-groups]",)
    assert list(coupled.value) == ["k_x", "k_y", "c_x", "c_y"]


def test_lines_left_out_of_a_group_name_its_dofs(chains):
    h = two_chains(chains)
    h[40:50, ::2, ::2] *= np.exp(2j * np.pi * np.random.default_rng(1).random((10, 2, 2)))
    (text,) = fit_of(chains.freq, h, ["x", "y"]).warnings
    assert text.startswith("10 of 191 lines of x do not fit")
