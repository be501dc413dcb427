"""The table of methods that give K*(w): names, what each needs, and that each calls the function it names."""

from typing import get_args

import numpy as np
import pytest

import jointfrf as jf
from jointfrf.identification.monte_carlo import MonteCarloMethod
from jointfrf.substructuring.methods import STIFFNESS_METHODS, JointFrfs, StiffnessMethod, joint_stiffness


def known(s, equation="rr", joint=None):
    """All that any method needs, noise-free; h_c between the points of a decoupling equation."""
    place = {"r": s.inner, "s": [2 * s.n + i for i in s.inner]}
    joint = joint or s.joint
    return JointFrfs(
        gamma=s.gamma(joint),
        alpha=s.gamma(s.first),
        k_initial=s.first.dynamic_stiffness(s.freq),
        h_a=s.h_a,
        h_b=s.h_b,
        h_c=s.coupled(joint)[:, place[equation[0]]][:, :, place[equation[1]]],
        dofs_j=s.at,
        dofs_k=s.at,
        dofs_r=s.inner,
        dofs_s=s.inner,
    )


def test_every_name_stands_in_the_table_and_is_spelt_with_hyphens():
    assert tuple(STIFFNESS_METHODS) == get_args(StiffnessMethod)
    assert set(get_args(MonteCarloMethod)) <= {"compliance", *STIFFNESS_METHODS}
    assert not any("_" in name for name in STIFFNESS_METHODS)


@pytest.mark.parametrize("method", STIFFNESS_METHODS)
def test_every_method_is_the_function_it_names(beams, method):
    s = beams
    frfs = known(s, method[-2:] if method.startswith("decoupling") else "rr")
    found = joint_stiffness(method, frfs, freq_hz=s.freq)
    exact = s.joint.dynamic_stiffness(s.freq)
    assert (abs(found - exact) / abs(exact).max(axis=(0, 2), keepdims=True)).max() < 1e-5
    if method == "ismm":
        direct = jf.ismm(frfs.alpha, frfs.gamma, frfs.k_initial)
    elif method == "ismm-kj":
        direct = jf.ismm(frfs.alpha, frfs.gamma, frfs.k_initial, block="kj")
    elif method == "inverse-substructuring":
        direct = jf.inverse_substructuring(frfs.gamma)
    else:
        more = dict(dofs_r=s.inner, dofs_s=s.inner)
        direct = jf.decouple(method[-2:], s.h_a, s.h_b, frfs.h_c, s.at, s.at, **more)
    np.testing.assert_array_equal(found, direct)


@pytest.mark.parametrize("method", STIFFNESS_METHODS)
def test_a_method_takes_only_what_it_needs(chains, method):
    whole = known(chains, method[-2:] if method.startswith("decoupling") else "rr")
    own = STIFFNESS_METHODS[method]
    needed = (own.measured, *own.model)
    least = JointFrfs(**{name: getattr(whole, name) for name in needed})
    np.testing.assert_array_equal(joint_stiffness(method, least), joint_stiffness(method, whole))
    for name in needed:
        without = JointFrfs(**{other: getattr(whole, other) for other in needed if other != name})
        with pytest.raises(ValueError, match=f"method '{method}' needs .*{name}|method '{method}' needs {name}"):
            joint_stiffness(method, without)


@pytest.mark.parametrize(
    ("method", "message"),
    [
        ("ismm", "method 'ismm' needs alpha and k_initial$"),
        ("decoupling-rs", "method 'decoupling-rs' needs h_a, h_b, dofs_j, dofs_k, dofs_r and dofs_s$"),
        ("inverse_substructuring", "method must be one of ismm, ismm-kj, inverse-substructuring, decoupling-rr, "),
        ("compliance", "method must be one of ismm"),
    ],
)
def test_what_is_missing_is_named(chains, method, message):
    frfs = known(chains)
    with pytest.raises(ValueError, match=message):
        joint_stiffness(method, JointFrfs(gamma=frfs.gamma, h_c=frfs.h_c))


def test_nothing_given_names_the_measured_frfs():
    with pytest.raises(ValueError, match=r"method 'inverse-substructuring' needs gamma$"):
        joint_stiffness("inverse-substructuring", JointFrfs())


def test_singular_lines_are_named_or_become_nan(chains):
    gamma = chains.gamma(chains.joint)
    gamma[3] = 0
    with pytest.raises(jf.SingularLineError, match=f"{chains.freq[3]:g} Hz"):
        joint_stiffness("inverse-substructuring", JointFrfs(gamma=gamma), freq_hz=chains.freq)
    found = joint_stiffness("inverse-substructuring", JointFrfs(gamma=gamma), on_singular="nan")
    assert np.flatnonzero(np.isnan(found).any(axis=(1, 2))).tolist() == [3]


def test_either_block_of_the_modification(random_lines):
    """(2.48) written out: K0 - D_jk and K0 - D_kj from the whole of D, for FRFs that are not symmetric."""
    n, alpha, gamma, first = 3, random_lines(5, 6), random_lines(5, 6), random_lines(5, 3)
    d = np.linalg.inv(gamma) - np.linalg.inv(alpha)
    for block, part in (("jk", d[:, :n, n:]), ("kj", d[:, n:, :n])):
        np.testing.assert_allclose(jf.ismm(alpha, gamma, first, block=block), first - part, rtol=1e-9)
        short = jf.inverse_substructuring(gamma, block=block)
        rows, columns = (slice(0, n), slice(n, 2 * n)) if block == "jk" else (slice(n, 2 * n), slice(0, n))
        np.testing.assert_allclose(short, -np.linalg.inv(gamma)[:, rows, columns], rtol=1e-9)
    with pytest.raises(ValueError, match="block must be one of jk, kj, not 'kk'"):
        jf.ismm(alpha, gamma, first, block="kk")


def test_both_blocks_agree_where_gamma_is_symmetric_and_not_where_noise_is_not(chains):
    frfs = known(chains)
    noisy = jf.pollute(frfs.gamma, 0.01, seed=1)
    symmetric = (noisy + np.swapaxes(noisy, 1, 2)) / 2
    for gamma, same in ((symmetric, True), (noisy, False)):
        jk, kj = (jf.ismm(frfs.alpha, gamma, frfs.k_initial, block=block) for block in ("jk", "kj"))
        assert np.allclose(jk, np.swapaxes(kj, 1, 2), rtol=1e-9, atol=0) == same


def test_singular_lines_of_either_block_are_the_same(chains):
    gamma = chains.gamma(chains.joint)
    gamma[3] = 0
    with pytest.raises(jf.SingularLineError, match=f"{chains.freq[3]:g} Hz"):
        jf.inverse_substructuring(gamma, block="kj", freq_hz=chains.freq)
