"""Random arguments: every public function answers with a result or with one sentence, never otherwise."""

import warnings

import numpy as np
import pytest

import jointfrf as jf

ALUMINIUM = jf.Material(70e9, 0.33, 2700.0)
BLOCK = jf.brick_beam(1.0, 1.0, 1.0, ALUMINIUM, divisions=(1, 1, 2)).mesh


def one(function, name, **others):
    """Return a function of one argument; the others are good."""

    def call(value):
        function(**others, **{name: value})

    call.__name__ = f"{function.__name__} {name}"
    return call


def model_with_patch(point, nodes):
    return jf.solid_model(BLOCK, ALUMINIUM, patches={"p": jf.Patch(point, nodes)})


BEAM = dict(length=1.0, width=1.0, height=1.0, material=ALUMINIUM)
ONE_BAD = [one(jf.brick_beam, name, **BEAM) for name in ("divisions", "ends", "origin", "sections", "hole", "preset")]
ONE_BAD += [one(jf.solid_model, name, mesh=BLOCK, materials=ALUMINIUM) for name in ("clamped", "patches", "mass")]
ONE_BAD += [one(model_with_patch, "nodes", point=[0, 0, 0]), one(model_with_patch, "point", nodes=[0, 1, 2, 3])]
ONE_BAD += [one(BLOCK.near, "point")]

FUNCTIONS = {
    jf.invert: 1, jf.solve: 2, jf.reciprocal_condition: 1, jf.couple: 5, jf.modify: 3, jf.find_modification: 2,
    jf.ismm: 3, jf.inverse_substructuring: 1, jf.decouple: 6, jf.joint_compliance: 1, jf.compliance_factors: 2,
    jf.compliance_covariance: 3, jf.central_difference: 2, jf.difference_weights: 1, jf.transform: 3, jf.pollute: 2,
    jf.receptance: 8, jf.band_mean: 3, jf.in_bands: 2, jf.sensitivity: 7, jf.propose_bands: 2, jf.peak: 3,
    jf.identify: 3, jf.chain: 3, jf.Joint: 2, jf.Material: 4, jf.element_matrices: 3, jf.assemble_bricks: 4,
    jf.smooth_frfs: 3, jf.estimate_noise: 2,
    jf.brick_quality: 2, jf.Hole: 4, jf.brick_beam: 4, jf.solid_model: 2, jf.virtual_point: 5,
    **dict.fromkeys(ONE_BAD, 1),
}  # fmt: skip


def array(rng):
    shape = tuple(rng.integers(0, 5, rng.integers(0, 5)))
    values = rng.standard_normal(shape) * 10.0 ** rng.choice([0, 0, 0, -300, 300])
    if rng.random() < 0.5:
        values = values + 1j * rng.standard_normal(shape)
    if rng.random() < 0.2 and np.size(values):
        values = np.array(values)
        values.flat[0] = rng.choice([np.nan, np.inf])
    return rng.choice([np.asfortranarray, lambda a: np.asarray(a).astype(object), lambda a: a, lambda a: 0 * a])(values)


def sweep(rng):
    n = rng.integers(0, 5)
    return rng.standard_normal((3, n, n)) + 1j * rng.standard_normal((3, n, n))


def dofs(rng):
    return rng.integers(-1, 4, rng.integers(0, 4)).tolist()


def oddity(rng):
    return [None, "x", {}, -1.5, [1.0, 2.0, 3.0], [(1, 2)], "rr"][rng.integers(7)]


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda f: f.__name__)
def test_a_result_or_one_sentence(function):
    rng = np.random.default_rng(len(function.__name__))
    makers = [array, sweep, sweep, dofs, oddity]
    refused = 0
    for _ in range(150):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            arguments = [makers[rng.integers(len(makers))](rng) for _ in range(FUNCTIONS[function])]
            try:
                function(*arguments)
            except (ValueError, TypeError, np.linalg.LinAlgError, OverflowError) as error:
                message = str(error)
                refused += 1
                assert message, arguments
                assert "\n" not in message, arguments
                assert len(message) < 300, arguments
                assert "ufunc" not in message, arguments
                assert "ambiguous" not in message, arguments
    assert refused > 0
