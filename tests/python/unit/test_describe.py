"""What a reader is told of a fit: each sentence for its cause, and none without."""

from dataclasses import replace

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.identification.describe import describe_band_mean, describe_compliance
from jointfrf.identification.fit import DampingChoice, fit_band_mean, fit_compliance
from jointfrf.identification.prepare import (
    ComplianceOptions,
    as_measured,
    prepare_band_mean,
    prepare_compliance,
)
from jointfrf.substructuring.methods import JointFrfs


@pytest.fixture(scope="module")
def found(beams):
    """A fit of which there is nothing to tell."""
    gamma = as_measured(beams.freq, jf.pollute(beams.gamma(beams.joint), 0.0005, seed=3))
    options = ComplianceOptions("viscous", "zero", True)
    return fit_compliance(prepare_compliance(gamma, ["y", "theta"], None, None, None, options))


def changed(found, **change):
    """The same with other numbers: of the fit, or of the estimate behind it."""
    of_joint = {name: change.pop(name) for name in ("parameters", "covariance", "residual_level") if name in change}
    of_found = {name: change.pop(name) for name in ("choice", "level_from_residual") if name in change}
    joint = replace(found.joint, **of_joint)
    return found._replace(joint=joint, estimate=found.estimate._replace(**change), **of_found)


def lost(found, count):
    lines = np.zeros((found.joint.freq_hz.size, 2), bool)
    lines[:count] = True
    return lines


def test_nothing_to_tell(found):
    described = describe_compliance(found, "zero")
    assert described.fit.notes == described.fit.warnings == described.warnings == ()
    assert described.fit.parameters == found.joint.parameters


def test_a_fit_that_did_not_converge_warns_of_its_own_kind(found):
    described = describe_compliance(changed(found, converged=np.array([False])), "zero")
    assert [type(warning) for warning in described.warnings] == [jf.ConvergenceWarning]
    assert described.fit.warnings == tuple(map(str, described.warnings))
    assert "did not converge in" in described.fit.warnings[0]


@pytest.mark.parametrize(
    ("margin", "indistinguishable", "notes"),
    [
        (11, False, ["damping viscous: clearly preferred to both (difference of BIC 11.0)"]),
        (3, False, ["damping viscous: weakly preferred to both (difference of BIC 3.0)"]),
        (
            1,
            True,
            [
                "viscous and hysteretic damping cannot be distinguished: only one of them is fitted",
                "damping viscous: hardly preferred to both (difference of BIC 1.0)",
            ],
        ),
    ],
)
def test_how_the_damping_was_chosen(found, margin, indistinguishable, notes):
    choice = DampingChoice("viscous", "both", float(margin), indistinguishable)
    assert list(describe_compliance(changed(found, choice=choice), "zero").fit.notes) == notes


def test_a_level_from_the_residual_is_noted(found):
    (note,) = describe_compliance(changed(found, level_from_residual=True), "zero").fit.notes
    assert note.startswith("the noise level is taken from the residual")


def test_damping_that_may_be_zero_is_noted_but_not_a_stiffness(found):
    fit = found.joint
    wide = np.diag([0.0, 0.0, *(np.array([fit.parameters["c_y"], 0]) ** 2)])
    described = describe_compliance(changed(found, covariance=wide), "zero")
    assert described.fit.notes == ("c_y: not significantly different from zero (95 % interval)",)
    assert not described.warnings


def test_poorly_determined_and_practically_rigid_stiffnesses(found):
    k = found.joint.parameters["k_theta"]
    poor, open_ = (np.diag([0.0, (share * k) ** 2, 0.0, 0.0]) for share in (0.501, 0.6))
    (text,) = describe_compliance(changed(found, covariance=poor), "zero").fit.warnings
    assert text.startswith("k_theta: poorly determined by the data, 95 % interval ")
    assert text.endswith(" N m/rad")
    (text,) = describe_compliance(changed(found, covariance=open_), "zero").fit.warnings
    assert text.startswith("k_theta: this DOF cannot be distinguished from a rigid one; at least ")
    assert text.endswith(" N m/rad (95 %)")


def test_a_misfit_is_told_and_whether_cross_terms_may_be_its_cause(found):
    level = found.joint.noise_level
    for ratio, cross, off_diagonal, count in (
        (1.2, "zero", 9, 0),
        (2, "zero", 9, 2),
        (2, "zero", 1, 1),
        (2, "fit", 9, 1),
    ):
        other = changed(found, residual_level=ratio * level, off_diagonal=np.array([off_diagonal * level]))
        texts = describe_compliance(other, cross).fit.warnings
        assert len(texts) == count
        assert not texts or texts[0].startswith(f"the residual is {ratio:.1f} times the noise: the model of the joint")
        assert count < 2 or "cross terms (cross)" in texts[1]


def test_few_lines_left_out_are_a_note_and_many_a_warning(found):
    total = found.joint.freq_hz.size
    few, many = lost(found, 10), lost(found, total - 5)
    described = describe_compliance(changed(found, lost=few, left_out=few[None]), "zero")
    assert described.fit.notes == (f"10 of {total} lines are left out: their noise hides the joint",)
    described = describe_compliance(changed(found, lost=many, left_out=many[None]), "zero")
    assert described.fit.notes == ()
    assert f"on {total - 5} of {total} lines the noise is as large" in described.fit.warnings[0]
    assert "only the other 5 are used" in described.fit.warnings[0]
    kept = describe_compliance(changed(found, lost=many, left_out=0 * many[None]), "zero")
    assert "expect bias beyond the intervals" in kept.fit.warnings[0]


def test_groups_are_named(found):
    two = changed(found, groups=(np.array([0]), np.array([1])))
    told = "the FRFs between (y) and (theta) are zero: each group is fitted separately"
    assert describe_compliance(two, "zero").fit.notes == (told,)
    assert describe_compliance(two, "fit").fit.notes == (told + ", and cross terms between them cannot be identified",)


def test_the_note_of_a_band_mean(beams):
    gamma = as_measured(beams.freq, beams.gamma(beams.joint))
    problem = prepare_band_mean("inverse-substructuring", gamma, JointFrfs(), ["y", "theta"], (200, 800), None)
    described = describe_band_mean(fit_band_mean(problem))
    assert "its bias by noise is not included" in described.fit.notes[0]
    assert not described.warnings
    assert list(described.fit.parameters) == ["k_y", "k_theta", "c_y", "c_theta"]
