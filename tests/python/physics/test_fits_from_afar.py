"""Fits of models that start from half the stiffness of the joint reach the one minimum that is the joint."""

import numpy as np
import pytest

import jointfrf as jf

DOFS = ("x", "y", "z", "theta_x", "theta_y", "theta_z")
FREQ = np.linspace(5, 900, 150)
TRUE = jf.Joint([6e5, 6e5, 4e6, 5e3, 5e3, 400], [20, 20, 60, 1.5, 1.5, 0.2], DOFS)
GUESS = jf.Joint([3e5, 3e5, 2e6, 3e3, 3e3, 200], [10, 10, 30, 1, 1, 0.1], DOFS)
OUTPUTS, FORCES = ["A/p4:x", "A/p4:y", "B/p5:x", "B/p5:y", "B/p5:z"], ["A/p3:x", "A/p3:y", "B/p5:x", "B/p5:z"]


@pytest.fixture(scope="module")
def bars() -> list[jf.Model]:
    """Two bars of bricks, the first clamped, the joint between their ends."""
    material = jf.Material(67e9, 0.33, 2700, 0.01)
    return [
        jf.brick_beam(
            length, 0.025, 0.006, material, divisions=(2, 1, 30), ends=(end, "free"), sections={"joint": joint},
            observed={f"p{i}": length * i / 5 for i in observed},
        )
        for length, end, joint, observed in ((0.3, "clamped", 0.3, (3, 4)), (0.2, "free", 0.0, (5,)))
    ]  # fmt: skip


def assembly(bars, joint, unknown):
    ports = [f"joint:{dof}" for dof in DOFS]
    return jf.Assembly(*(jf.Substructure(bar, ports, unknown, exact=True) for bar in bars), joint)


@pytest.mark.filterwarnings("ignore:.*theta_z")  # torsion moves no channel
@pytest.mark.parametrize("seed", [0, 1, 3])
def test_two_bars_of_bricks(bars, seed):
    """Steps of too great a length lock a DOF by its damper, and its neighbours are then stiffer than they are."""
    measured = jf.pollute(assembly(bars, TRUE, {}).receptance(FREQ, OUTPUTS, FORCES), 0.02, seed=seed)
    unknown = {"youngs_modulus": jf.Unknown(1.0, 0.02), "density": jf.Unknown(1.0, 0.01)}
    fit = jf.identify_model(FREQ, measured, assembly(bars, GUESS, unknown), OUTPUTS, FORCES)
    assert fit.residual_is_noise
    for dof, k in zip(DOFS[:5], TRUE.stiffness.diagonal(), strict=False):
        low, high = fit.intervals.of(f"k_{dof}", 0.999)
        assert low < k < high
        assert high < 2.5 * k
