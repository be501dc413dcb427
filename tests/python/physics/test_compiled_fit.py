"""The kernel fits a joint as the loop in Python does, which fits all other joints: they share their constants."""

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.identification.manifold import group_fit

FREQ = np.linspace(20, 400, 60)


def body(rng, n):
    """Receptances of a free body between n DOFs, reciprocal: a rigid motion of each, and modes."""
    omega = 2 * np.pi * FREQ[:, None, None]
    shapes = rng.standard_normal((4, n)) / np.sqrt(2.0)
    own = (2 * np.pi * rng.uniform(60, 500, 4))[:, None, None, None]
    modal = 1 / (own**2 - omega**2 + 0.02j * own * omega)
    rigid = np.diag(rng.uniform(0.3, 0.8, n)) / -(omega**2)
    return rigid + np.einsum("rliq,ra,rb->lab", modal, shapes, shapes)


def assembly(seed, n, stiffness, damping, noise):
    """FRFs of two bodies and a joint without cross terms, by the flexibility across the joint; with relative noise."""
    rng = np.random.default_rng(seed)
    a, b = body(rng, n), body(rng, n)
    k = stiffness * rng.uniform(0.5, 2, n) + 2j * np.pi * FREQ[:, None] * damping
    across = a + b + np.eye(n) / k[:, None]
    one = np.concatenate([a, -b], axis=1)
    zero = np.zeros_like(a)
    gamma = np.block([[a, zero], [zero, b]]) - one @ np.linalg.solve(across, one.swapaxes(1, 2))
    e = rng.standard_normal((2, *gamma.shape))
    return gamma * (1 + noise * (e[0] + 1j * e[1]) / np.sqrt(2))


PROBLEMS = {
    "one DOF": (1, 2e4, 5.0, 0.01, {}),
    "two DOFs": (2, 2e4, 5.0, 0.05, {}),
    "not reciprocal": (2, 2e4, 5.0, 0.02, {"reciprocal": False}),
    "stiff": (2, 3e6, 100.0, 0.01, {}),
    "soft": (3, 2e2, 0.1, 0.02, {}),
    "viscous": (2, 2e4, 5.0, 0.02, {"damping": "viscous"}),
}


@pytest.mark.filterwarnings("ignore::jointfrf.errors.IdentificationWarning")
@pytest.mark.parametrize("name", PROBLEMS)
def test_the_kernel_and_the_loop_in_python_find_the_same(name, monkeypatch):
    n, stiffness, damping, noise, options = PROBLEMS[name]
    gamma = assembly(7, n, stiffness, damping, noise)
    dofs = ("x", "y", "z")[:n]
    compiled = jf.identify(FREQ, gamma, dofs=dofs, **options)
    with monkeypatch.context() as patch:
        patch.setattr(group_fit._KernelFit, "of", lambda problem: None)
        in_python = jf.identify(FREQ, gamma, dofs=dofs, **options)
    assert compiled.value.keys() == in_python.value.keys()
    for parameter, value in in_python.value.items():
        error = in_python.std_error[parameter]
        assert compiled.value[parameter] == pytest.approx(value, abs=0.02 * error), parameter
        assert compiled.std_error[parameter] == pytest.approx(error, rel=0.01), parameter
    assert [one.code for one in compiled.findings] == [one.code for one in in_python.findings]


@pytest.mark.filterwarnings("ignore::jointfrf.errors.IdentificationWarning")
def test_lines_of_one_dof_are_not_left_out_by_chance():
    """Each line has one equation, which noise takes beyond three squares on one of twenty."""
    warned = [
        "lines-rejected" in {one.code for one in jf.identify(FREQ, assembly(seed, 1, 2e4, 5.0, 0.01), ("x",)).findings}
        for seed in range(20)
    ]
    assert sum(warned) <= 2
