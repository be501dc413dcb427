"""One drive point near one resonance of a beam whose joint softens: fits with all that is unknown by default."""

import warnings

import numpy as np
import pytest

import jointfrf as jf
from harmonic_balance import SECTION, Sliders, iwan_beam
from jointfrf.io import Channel, FrfSet, write_frfs
from jointfrf.workbench.cli.main import main

IWAN = (20.0, 1.2e5, -0.4, 0.8)
#: Force in N, and the frequency of the peak.
LEVELS = {
    0.2: 234.4, 0.5: 233.4, 1.0: 232.4, 3.0: 229.9, 8.0: 226.6, 15.0: 232.0, 25.0: 235.0, 40.0: 241.3,
}  # fmt: skip
ASSEMBLY = """
[A]
model = "beam"
length = 0.36
elements = 24
youngs_modulus = 210e9
density = 7850.0
width = 0.0254
height = 0.0254
loss_factor = 0.001
joint = ["25:y", "25:theta"]
[B]
model = "beam"
length = 0.36
elements = 24
youngs_modulus = 210e9
density = 7850.0
width = 0.0254
height = 0.0254
loss_factor = 0.001
joint = ["1:y", "1:theta"]
[[joint.law]]
dof = "y"
law = "rigid"
[[joint.law]]
dof = "theta_z"
law = "spring"
values = { k = 1e5, h = 1e3 }
[channels]
"11:+y" = "A/1:y"
"""


@pytest.fixture(scope="module")
def beam():
    return iwan_beam(Sliders.iwan(*IWAN), youngs_modulus=(1.004 * 210e9, 0.998 * 210e9), loss_factor=0.0012)


def measured(beam, force, noise, seed):
    """Lines, FRFs, and the stiffness of the joint at the smallest and the largest amplitude."""
    freq = np.linspace(0.99, 1.01, 41) * LEVELS[force]
    steady = beam.at_force(freq, force)
    k = beam.joint.first_harmonic(np.array([steady.joint.min(), steady.joint.max()])).real
    return freq, jf.pollute(steady.h[:, :1, None], noise, seed=seed), k


def nominal():
    halves = [
        jf.Substructure(jf.beam(0.36, 24, youngs_modulus=210e9, loss_factor=0.001, **SECTION), joint)
        for joint in (["25:y", "25:theta"], ["1:y", "1:theta"])
    ]
    return jf.Assembly(*halves, jf.LawJoint({"theta_z": jf.SpringLaw(1e5, h=1e3)}, ["y"], dofs=["y", "theta_z"]))


@pytest.mark.parametrize("force", [3.0, *(pytest.param(force, marks=pytest.mark.long) for force in (8.0, 25.0))])
def test_no_search_leaves_the_range_in_which_there_is_a_model(beam, force):
    """The residual is far above the noise, so that limits are sought where a density would be negative."""
    freq, h, k = measured(beam, force, 1e-3, 1)
    with warnings.catch_warnings(record=True) as issued:
        warnings.simplefilter("always")
        fit = jf.identify_model(freq, h, nominal(), ["A/1:y"], ["A/1:y"])
        limits = fit.confidence_interval()
        eta = fit.loss_factors["eta_theta_z"]
    assert {one.category.__name__ for one in issued} <= {"IdentificationWarning", "ConvergenceWarning"}
    assert "residual-large" in [one.code for one in fit.findings if one.severity == "warning"]
    for name, (low, high) in limits.items():
        assert 0 <= low < fit.value[name] < high, name
    assert limits["k_theta_z"][0] < k.max()
    assert limits["k_theta_z"][1] > k.min()
    # as wide as what makes it: a search that ends early left 1e-10 of it
    assert eta.low < 0.9 * eta.value
    assert eta.high > 1.1 * eta.value


@pytest.mark.long
def test_eight_levels_by_identify_and_levels(beam, tmp_path, capsys):
    (tmp_path / "assembly.toml").write_text(ASSEMBLY)
    files = []
    for i, force in enumerate(LEVELS):
        freq, h, _ = measured(beam, force, 1e-3, i)
        files.append(str(tmp_path / f"level_{i + 1}.npz"))
        write_frfs(files[-1], FrfSet(freq, (Channel(11, "+y"),), (Channel(11, "+y"),), h))
    model = ["--model", str(tmp_path / "assembly.toml")]
    assert main(["identify", *files, *model, "--each"]) == 0
    shown = capsys.readouterr()
    assert all(f"level_{i + 1}" in shown.out for i in range(8))
    assert "encountered" not in shown.err
    assert main(["levels", *files, *model, "--level", ",".join(map(str, LEVELS))]) in (0, 1)
    assert "k, N m/rad" in capsys.readouterr().out
