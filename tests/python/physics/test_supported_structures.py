"""Free, hinged, held and softly held structures at and near 0 Hz, by every method, against elimination in 80 bits.

A result that is not announced must be right within what rounding of the entries of K leaves of it: the condition of the
line times the machine's precision.
"""

import functools
import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from scipy import sparse

import jointfrf as jf
import supported_structures
from jointfrf.models import krylov
from jointfrf.models.modal import find_rigid_modes, no_rigid_modes
from supported_structures import EPS, FREE, HELD, calculated, exact, relative_error

METHODS = ["auto", "dense", "banded", "sparse", "modal", "krylov"]
LOSS_FACTOR = 0.01
#: A stiffness within this many roundings counts as none: what sums of modes may leave out.
NO_STIFFNESS = 32
#: What the reduced model may add to rounding: its tolerance.
TOLERANCE = 1e-8
#: The largest error by rounding that is not announced.
ANNOUNCED = EPS / 1e-12


@functools.cache
def made(name):
    return (FREE | HELD)[name]()


@functools.cache
def reference(name, share=0.0):
    """Structure, frequencies at and around 0 Hz, receptances and bounds of their rounding."""
    structure = made(name).on_springs(share) if share else made(name)
    elastic = made(name).first_elastic()
    freq = np.array([0.05, 0.4]) * elastic
    if not structure.n_rigid:
        suspension = np.sqrt(structure.lowest) / (2 * np.pi)
        freq = np.array([0.0, suspension / 2, 2 * suspension, 0.4 * elastic])
    return structure, freq, exact(structure, freq, LOSS_FACTOR), [structure.relative_rounding(f) for f in freq]


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", FREE)
def test_a_free_structure_is_singular_at_0_hz_and_right_above(name, method):
    structure, freq, h_exact, rounding = reference(name)
    h, announced = calculated(structure, [0.0, *freq], LOSS_FACTOR, method)
    assert announced
    assert h is None or method not in ("modal", "krylov")
    for f, known, bound in zip(freq, h_exact, rounding, strict=True):
        h, announced = calculated(structure, [f], LOSS_FACTOR, method)
        assert not announced
        assert relative_error(h[0], known) < TOLERANCE + bound


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", HELD)
def test_a_structure_that_is_held_has_no_singular_line(name, method):
    structure, freq, h_exact, rounding = reference(name)
    h, announced = calculated(structure, freq, LOSS_FACTOR, method)
    assert not announced
    for found, known, bound in zip(h, h_exact, rounding, strict=True):
        assert relative_error(found, known) < TOLERANCE + bound


@pytest.mark.parametrize(
    "share", [1e-3, 1e-8, 1e-10, *(pytest.param(share, marks=pytest.mark.long) for share in (1e-6, 1e-9, 1e-11, 1e-12))]
)
@pytest.mark.parametrize("name", ["flat beam", "rubber", "150 elements", "chain", "two beams and a hinge"])
def test_a_softly_held_structure_is_right_or_announced(name, share):
    """Springs that are a share of the largest stiffness of K hold what is otherwise free."""
    structure, freq, h_exact, rounding = reference(name, share)
    hidden = structure.lowest < NO_STIFFNESS * structure.rounding
    for method in METHODS:
        neglected = NO_STIFFNESS if hidden and method in ("modal", "krylov") else 1
        for f, known, bound in zip(freq, h_exact, rounding, strict=True):
            h, announced = calculated(structure, [f], LOSS_FACTOR, method)
            if announced:
                assert bound > ANNOUNCED
            else:
                assert relative_error(h[0], known) < TOLERANCE + min(neglected * bound, ANNOUNCED)


@pytest.mark.parametrize("name", FREE)
def test_rigid_body_modes_do_not_strain(name):
    structure = made(name)
    k, m = (sparse.csc_array(a) for a in (structure.stiffness, structure.mass))
    rigid = find_rigid_modes(k, m)
    assert len(rigid) == structure.n_rigid
    np.testing.assert_allclose(rigid.shapes.T @ rigid.momenta, np.eye(len(rigid)), atol=1e-10)
    strained = abs(k @ rigid.shapes) / (abs(k) @ abs(rigid.shapes)).max(axis=0)
    assert strained.max() < 1e3 * EPS


@pytest.mark.parametrize("share", [0.0, 1e-10, 1e-3])
@pytest.mark.parametrize("name", FREE)
def test_rigid_body_modes_of_arrays_are_those_of_sparse_matrices(name, share):
    structure = made(name)
    spring = sparse.coo_array(([share * abs(structure.stiffness).max()], ([0], [0])), structure.stiffness.shape)
    k, m = (sparse.csc_array(a) for a in (structure.stiffness + spring, structure.mass))
    by_entries, full = find_rigid_modes(k, m), find_rigid_modes(k.toarray(), m.toarray())
    assert len(full) == len(by_entries)
    np.testing.assert_array_equal(full.stiffness > 0, by_entries.stiffness > 0)
    resolved = full.uncertainty + by_entries.uncertainty + 1e3 * EPS * full.stiffness
    assert (abs(full.stiffness - by_entries.stiffness) <= 64 * resolved).all()
    np.testing.assert_allclose(
        full.shapes @ full.momenta.T, by_entries.shapes @ by_entries.momenta.T, atol=1e-6 * np.sqrt(m.shape[0])
    )


def test_a_structure_held_by_structural_damping_alone_is_not_singular():
    structure = made("two masses")
    damper = np.diag([0.0, 3e3])
    exact_h = np.linalg.inv(structure.stiffness.toarray() + 1j * damper)
    for method in ("auto", "dense", "banded", "sparse"):
        h = jf.receptance([0.0], structure.stiffness, structure.mass, None, 0.0, damper, method=method)
        np.testing.assert_allclose(h[0], exact_h, rtol=1e-12)
    mass = structure.mass.toarray()  # r^T H r of H = M holds the rigid-body mode
    h = jf.receptance([0.0], structure.stiffness, mass, None, 0.0, 1e3 * mass, method="modal")
    np.testing.assert_allclose(h[0], np.linalg.inv(structure.stiffness.toarray() + 1e3j * mass), rtol=1e-10)


def test_rounding_excuses_no_error_beyond_what_is_announced(monkeypatch):
    """Rigid-body modes that are not found leave a reduced model that has no digit at 0 Hz."""
    monkeypatch.setattr(krylov, "find_rigid_modes", lambda k, m, solver: no_rigid_modes(k.shape[0]))
    structure = made("flat beam")
    lines = np.linspace(0, structure.first_elastic(), 41)
    given = dict(outputs=structure.at, inputs=structure.at, method="krylov", full_output=True)
    with pytest.warns() as caught:
        h, info = jf.receptance(lines, structure.stiffness, structure.mass, **given, on_singular="nan")
    assert info.method != "krylov"
    assert "reduced model" in info.reason
    assert jf.ConvergenceWarning in {t.category for t in caught}
    assert np.isnan(h[0]).all()
    assert np.isfinite(h[1:-1]).all()  # the last line is a resonance without damping
    with pytest.raises(jf.SingularLineError, match=r"line 0 \(0 Hz\)"):
        jf.receptance(lines, structure.stiffness, structure.mass, **given)


@pytest.mark.long
@pytest.mark.parametrize("kernel", ["Prescott", "Haswell", "SkylakeX"])
def test_random_free_beams_are_recognised_with_other_kernels_of_openblas(kernel):
    environment = os.environ | {"OPENBLAS_CORETYPE": kernel, "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, supported_structures.__file__, "9"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    if hasattr(signal, "SIGILL") and done.returncode == -signal.SIGILL:
        pytest.skip(f"this processor has not the instructions of {kernel}")
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
