"""The equations against each other and against models assembled without them."""

import numpy as np
import pytest

import jointfrf as jf


def relative(a, b):
    return abs(a - b).max() / abs(b).max()


def test_coupled_frfs_are_those_of_the_assembled_model(assembly):
    s = assembly
    whole = jf.assemble(s.a, s.b, s.joint, s.dofs_a[: s.n], s.dofs_b[: s.n])
    outputs = [*s.dofs_a, *(len(s.a.dofs) + d for d in s.dofs_b)]
    assert relative(s.coupled(s.joint), whole.receptance(s.freq, outputs)) < 1e-8


def test_ismm_is_the_short_form_where_alpha_was_assembled_through_k0(assembly):
    s = assembly
    exact = s.joint.dynamic_stiffness(s.freq)
    by_ismm = jf.ismm(s.gamma(s.first), s.gamma(s.joint), s.first.dynamic_stiffness(s.freq))
    short = jf.inverse_substructuring(s.gamma(s.joint))
    size = abs(exact).max(axis=(0, 2), keepdims=True)
    assert (abs(by_ismm - short) / size).max() < 1e-10
    assert (abs(by_ismm - exact) / size).max() < 1e-8


def test_ismm_with_another_alpha_is_not_the_short_form(chains):
    s = chains
    stiffer = jf.couple(2 * s.h_a, s.h_b, s.first.dynamic_stiffness(s.freq), [0], [0])[:, [0, 2]][:, :, [0, 2]]
    alpha = stiffer.copy()
    alpha[:, 0, 1] *= 1.1
    result = jf.ismm(alpha, s.gamma(s.joint), s.first.dynamic_stiffness(s.freq))
    general = s.first.dynamic_stiffness(s.freq) - (np.linalg.inv(s.gamma(s.joint)) - np.linalg.inv(alpha))[:, :1, 1:]
    assert relative(result, general) < 1e-9
    assert relative(result, jf.inverse_substructuring(s.gamma(s.joint))) > 1e-3


@pytest.mark.parametrize(
    ("equation", "output", "force"), [("rr", "r", "r"), ("rs", "r", "s"), ("sr", "s", "r"), ("ss", "s", "s")]
)
def test_each_decoupling_equation_returns_the_joint(assembly, equation, output, force):
    s = assembly
    place = {"r": s.inner, "s": [2 * s.n + i for i in s.inner]}
    measured = s.coupled(s.joint)[:, place[output]][:, :, place[force]]
    found = jf.decouple(equation, s.h_a, s.h_b, measured, s.at, s.at, s.inner, s.inner)
    exact = s.joint.dynamic_stiffness(s.freq)
    assert (abs(found - exact) / abs(exact).max(axis=(0, 2), keepdims=True)).max() < 1e-6


def test_joint_compliance_is_the_inverse_of_the_joint(assembly):
    s = assembly
    compliance = jf.joint_compliance(s.gamma(s.joint))
    exact = np.linalg.inv(s.joint.dynamic_stiffness(s.freq))
    assert (abs(compliance - exact) / abs(exact).max(axis=(0, 2), keepdims=True)).max() < 1e-8


def test_non_symmetric_frfs_catch_a_transpose(random_lines):
    """Coupling by eliminating the joint force from the equations of both sides, one line at a time."""
    h_a, h_b, k = random_lines(4, 3, seed=1), random_lines(4, 4, seed=2), random_lines(4, 2, seed=3)
    j, other = [2, 0], [1, 3]
    coupled = jf.couple(h_a, h_b, k, j, other)
    for i in range(4):
        stiffness = np.zeros((7, 7), complex)
        stiffness[:3, :3], stiffness[3:, 3:] = np.linalg.inv(h_a[i]), np.linalg.inv(h_b[i])
        select = np.zeros((2, 7))
        select[[0, 1], j] = 1
        select[[0, 1], [3 + d for d in other]] = -1
        np.testing.assert_allclose(
            coupled[i], np.linalg.inv(stiffness + select.T @ k[i] @ select), rtol=1e-9, atol=1e-12
        )
    gamma = coupled[:, [*j, *(3 + d for d in other)]][:, :, [*j, *(3 + d for d in other)]]
    np.testing.assert_allclose(jf.inverse_substructuring(gamma), k, rtol=1e-8)
    np.testing.assert_allclose(jf.invert(jf.joint_compliance(gamma)), k, rtol=1e-8)
    r, s = [0, 2], [0, 2]
    for equation, rows, columns in (("rr", r, r), ("rs", r, [3, 5]), ("sr", [3, 5], r), ("ss", [3, 5], [3, 5])):
        measured = coupled[:, rows][:, :, columns]
        np.testing.assert_allclose(jf.decouple(equation, h_a, h_b, measured, j, other, r, s), k, rtol=1e-6)


def test_a_joint_dof_without_stiffness_stays_uncoupled(random_lines):
    h_a, h_b = random_lines(3, 2, seed=4), random_lines(3, 2, seed=5)
    coupled = jf.couple(h_a, h_b, np.zeros((2, 2)), [0, 1], [0, 1])
    np.testing.assert_allclose(coupled[:, :2, :2], h_a)
    np.testing.assert_allclose(coupled[:, 2:, 2:], h_b)
    assert not coupled[:, :2, 2:].any()


def test_modification_and_its_inverse(random_lines):
    alpha, d = random_lines(5, 4, seed=6), random_lines(5, 2, seed=7)
    gamma = jf.modify(alpha, d, [3, 1])
    whole = np.zeros((5, 4, 4), complex)
    whole[np.ix_(range(5), [3, 1], [3, 1])] = d
    np.testing.assert_allclose(gamma, np.linalg.inv(np.linalg.inv(alpha) + whole), rtol=1e-9)
    np.testing.assert_allclose(jf.find_modification(alpha, gamma), whole, rtol=1e-7, atol=1e-9)


def test_a_weak_modification_keeps_its_digits(random_lines):
    alpha = random_lines(5, 3, seed=8)
    d = 1e-9 * random_lines(5, 3, seed=9)
    gamma = jf.modify(alpha, d, [0, 1, 2])
    error = abs(jf.find_modification(alpha, gamma) - d).max() / 1e-9
    by_difference = abs(np.linalg.inv(gamma) - np.linalg.inv(alpha) - d).max() / 1e-9
    assert error < 1e-6
    assert error < 2 * by_difference  # gamma itself carries the round-off of 1e-16/1e-9


def test_reciprocity_is_kept(beams):
    coupled = beams.coupled(beams.joint)
    np.testing.assert_allclose(coupled, coupled.swapaxes(1, 2), rtol=1e-6, atol=1e-9 * abs(coupled).max())


def test_natural_frequencies_of_the_chain():
    a = jf.chain([5, 3], [2500, 3500], ground="start")
    b = jf.chain([4, 2], [2000, 2500], ground="end")
    found = [jf.assemble(a, b, jf.Joint([k]), [1], [0]).natural_frequencies() for k in (1000.0, 2000.0)]
    np.testing.assert_allclose(found, [[2.596, 3.936, 7.574, 8.049], [2.598, 4.682, 7.770, 8.374]], atol=6e-4)


@pytest.mark.parametrize(
    ("element", "per_metre", "expected"),
    [
        # Cubic elements of 1 mm have so stiff a matrix that its round-off shows in the first frequency (17.49 Hz by a
        # dense solver); meshes of 25, 10 and 5 mm agree on 17.4765 Hz.
        ("euler-bernoulli", 200, [17.4765, 108.5, 301.3, 585.6, 963.6]),
        ("shear-flexible", 1000, [17.47, 108.4, 300.8, 583.8, 959.2]),
    ],
)
def test_natural_frequencies_of_the_beams(element, per_metre, expected):
    section = dict(youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006, element=element, axial=True)
    n_a, n_b = round(0.3 * per_metre), round(0.225 * per_metre)
    a = jf.beam(0.3, n_a, ends=("clamped", "free"), **section)
    b = jf.beam(0.225, n_b, **section)
    joint = jf.Joint([6e5, 5e3], dofs=["y", "theta"])
    tip = a.index(f"{n_a + 1}:y", f"{n_a + 1}:theta")
    found = jf.assemble(a, b, joint, tip, b.index("1:y", "1:theta")).natural_frequencies(6)
    assert found[0] < 0.1  # B is free along its axis
    np.testing.assert_allclose(found[1:], expected, rtol=6e-4)


def test_free_free_and_clamped_beams_against_the_analytic_result():
    section = dict(youngs_modulus=70e9, density=2700.0, width=0.02, height=0.004)
    ei_over_m = 70e9 * 0.004**2 / 12 / 2700
    for ends, roots, rigid in (
        (("free", "free"), [4.73004074, 7.85320462], 2),
        (("clamped", "free"), [1.87510407, 4.69409113], 0),
    ):
        exact = np.square(roots) / (2 * np.pi) * np.sqrt(ei_over_m) / 0.5**2
        model = jf.beam(0.5, 40, ends=ends, **section)
        np.testing.assert_allclose(model.natural_frequencies(rigid + 2)[rigid:], exact, rtol=1e-5)
    thin = jf.beam(0.5, 400, ends=("clamped", "free"), element="shear-flexible", **section)
    np.testing.assert_allclose(thin.natural_frequencies(1), exact[:1], rtol=1e-3)


def test_viscous_damping_of_a_beam_is_proportional():
    model = jf.beam(0.3, 3, youngs_modulus=1e9, density=1e3, width=0.01, height=0.01, viscous=(2.0, 3e-6))
    np.testing.assert_allclose(
        model.damping.toarray(), 2.0 * model.mass.toarray() + 3e-6 * model.stiffness.toarray(), rtol=1e-12
    )


def test_central_difference_of_a_bending_shape():
    """On a parabola the three-point formula is exact, equal spacing or not."""
    for offset in ([-0.01, 0.0, 0.01], [-0.01, 0.0, 0.02]):
        x = np.array(offset)
        t = jf.difference_weights(x)
        np.testing.assert_allclose(t @ (2 + 3 * x + 5 * x**2), [2, 3], rtol=1e-12)
    h = np.einsum("p,q->pq", 1 + 2 * x, 3 - x)[None]
    np.testing.assert_allclose(jf.central_difference(h, x)[0], np.outer([1, 2], [3, -1]), atol=1e-10)
    np.testing.assert_allclose(jf.central_difference(h, x, sign=-1)[0], np.outer([1, -2], [3, 1]), atol=1e-10)


def test_rotational_receptance_of_a_beam_by_differences(beams):
    """Close points come close to the rotational receptances of the model."""
    model = jf.beam(
        0.3,
        300,
        ends=("clamped", "free"),
        youngs_modulus=67e9,
        density=2700.0,
        width=0.025,
        height=0.006,
        loss_factor=0.01,
    )
    freq = [20.0, 150.0, 400.0]
    points = model.index("275:y", "276:y", "277:y")
    exact = model.receptance(freq, model.index("276:y", "276:theta"))
    np.testing.assert_allclose(jf.central_difference(model.receptance(freq, points), 0.001), exact, rtol=5e-3)


def test_differences_add_the_compliance_that_the_estimate_says():
    """Low-frequency compliance of a rotational joint between beams, points at +-dx of it."""
    section = dict(youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006, loss_factor=0.01)
    a = jf.beam(0.3, 150, ends=("clamped", "free"), **section)
    b = jf.beam(0.225, 150, **section)
    freq = np.arange(20.0, 60.0, 5.0)
    node_a, node_b, steps, spacing = 138, 18, 5, 0.01
    h_a = a.receptance(freq, a.index(*[f"{node_a + d}:y" for d in (-steps, 0, steps)], f"{node_a}:theta"))
    wide = round(spacing / (0.225 / 150))
    h_b = b.receptance(freq, b.index(*[f"{node_b + d}:y" for d in (-wide, 0, wide)], f"{node_b}:theta"))
    h = jf.couple(h_a, h_b, jf.Joint([6e5, 5e3]).dynamic_stiffness(freq), [1, 3], [1, 3])
    measured = [0, 1, 2, 4, 5, 6]
    t_a = jf.difference_weights(steps * 0.002)
    t_b = jf.difference_weights(wide * 0.0015)
    t = np.block([[t_a, np.zeros((2, 3))], [np.zeros((2, 3)), t_b]])
    found = jf.joint_compliance(jf.transform(h[:, measured][:, :, measured], t, t))[:, 1, 1].real.mean() - 1 / 5e3
    assert found == pytest.approx(jf.difference_error(spacing, 67e9 * 0.025 * 0.006**3 / 12, 5e3).compliance, rel=0.05)
