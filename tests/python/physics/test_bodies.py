"""Many bodies and joints coupled at once: against one model of the whole, and two at a time."""

import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.linalg import null_space

import jointfrf as jf

FREQ = np.linspace(1.0, 40.0, 25)


def chains() -> list[jf.Model]:
    return [
        jf.chain([2.0, 3.0], [3e3, 2e3, 1e3], [1.0, 1.0, 2.0], ground="both"),
        jf.chain([1.0, 4.0, 2.0], [2e3, 5e3, 1e3, 1e3], [1.0, 2.0, 1.0, 1.0], ground="both"),
        jf.chain([5.0], [2e3, 1e3], [3.0, 1.0], ground="both"),
    ]


def whole(m: np.ndarray, k: np.ndarray, c: np.ndarray) -> np.ndarray:
    omega = 2 * np.pi * FREQ[:, None, None]
    return np.linalg.inv(k + 1j * omega * c - omega**2 * m)


@pytest.fixture
def bodies() -> dict[str, jf.FreeBody]:
    return {name: jf.FreeBody(part.receptance(FREQ), part.dofs) for name, part in zip("ABC", chains(), strict=True)}


def matrices() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M, K and C of the three bodies side by side."""
    found = np.zeros((3, 6, 6))
    first = 0
    for part in chains():
        own = slice(first, first + len(part.dofs))
        for target, matrix in zip(found, (part.mass, part.stiffness, part.damping), strict=True):
            target[own, own] = matrix.toarray() if hasattr(matrix, "toarray") else matrix
        first = own.stop
    return found[0], found[1], found[2]


def between(a: int, b: int | None) -> np.ndarray:
    row = np.zeros(6)
    row[a] = 1
    if b is not None:
        row[b] = -1
    return np.outer(row, row)


def test_a_ring_with_a_spring_to_the_ground_is_one_model(bodies):
    m, k, c = matrices()
    links = [
        jf.BodyLink(jf.Joint([4e3], [2.0], ["x"]), ["A/2:x"], ["B/1:x"]),
        jf.BodyLink(jf.Joint([1e3], [1.0], ["x"]), ["B/3:x"], ["C/1:x"]),
        jf.BodyLink(jf.Joint([2e3], [3.0], ["x"]), ["C/1:x"], ["A/1:x"]),
        jf.BodyLink(jf.Joint([5e2], [0.5], ["x"]), ["B/2:x"]),
        jf.BodyLink(jf.Joint([7e2], [0.1], ["x"]), ["B/1:x"], ["B/3:x"]),  # within a body
    ]
    for a, b, own_k, own_c in (
        (1, 2, 4e3, 2.0),
        (4, 5, 1e3, 1.0),
        (5, 0, 2e3, 3.0),
        (3, None, 5e2, 0.5),
        (2, 4, 7e2, 0.1),
    ):
        k, c = k + own_k * between(a, b), c + own_c * between(a, b)
    assert_allclose(jf.couple_bodies(FREQ, bodies, links), whole(m, k, c), rtol=1e-9, atol=1e-16)


def test_rigid_dofs_and_the_mass_of_a_joint(bodies):
    m, k, c = matrices()
    law = jf.LawJoint({"x": jf.SpringLaw(3e3, 1.0)}, mass={"x": 0.5})
    links = [
        jf.BodyLink(jf.LawJoint({}, rigid=["x"]), ["A/2:x"], ["B/1:x"]),
        jf.BodyLink(law, ["B/3:x"], ["C/1:x"]),
        jf.BodyLink(law, ["A/1:x"]),
    ]
    for a, b in ((4, 5), (0, None)):
        k, c = k + 3e3 * between(a, b), c + between(a, b)
    m[4, 4] += 0.25
    m[5, 5] += 0.25
    m[0, 0] += 0.25
    join = np.eye(6)[:, [0, 1, 3, 4, 5]]
    join[2, 1] = 1  # x of B/1 is that of A/2
    expected = join @ whole(*(join.T @ one @ join for one in (m, k, c))) @ join.T
    assert_allclose(jf.couple_bodies(FREQ, bodies, links), expected, rtol=1e-8, atol=1e-15)


def test_two_bodies_are_as_couple_says_and_one_after_the_other_as_at_once(bodies):
    first, second = jf.Joint([4e3], [2.0], ["x"]), jf.Joint([1e3], [1.0], ["x"])
    ab = jf.couple(bodies["A"].h, bodies["B"].h, first.dynamic_stiffness(FREQ), [1], [0])
    abc = jf.couple(ab, bodies["C"].h, second.dynamic_stiffness(FREQ), [4], [0])
    links = [jf.BodyLink(first, ["A/2:x"], ["B/1:x"]), jf.BodyLink(second, ["B/3:x"], ["C/1:x"])]
    found = jf.couple_bodies(FREQ, bodies, links)
    assert_allclose(found, abc, rtol=1e-10, atol=1e-16)
    names = ["C/1:x", "A/2:x", "B/2:x"]
    some = jf.couple_bodies(FREQ, bodies, links, names, ["B/1:x", "A/1:x"])
    assert_allclose(some, found[:, [5, 1, 3]][:, :, [2, 0]], rtol=1e-12)


def test_frfs_that_are_not_symmetric_and_a_body_that_is_free(bodies):
    rng = np.random.default_rng(2)
    h = {name: np.asarray(body.h) * (1 + 0.1 * rng.standard_normal(np.shape(body.h))) for name, body in bodies.items()}
    uneven = {name: jf.FreeBody(own, bodies[name].dofs) for name, own in h.items()}
    joint = jf.Joint([[4e3, 1e3], [2e3, 3e3]], dofs=["x", "y"])
    found = jf.couple_bodies(FREQ, uneven, [jf.BodyLink(joint, ["A/1:x", "A/2:x"], ["B/3:x", "B/1:x"])])
    expected = jf.couple(h["A"], h["B"], joint.dynamic_stiffness(FREQ), [0, 1], [2, 0])
    assert_allclose(found[:, :5, :5], expected, rtol=1e-10, atol=1e-16)
    assert_allclose(found[:, 5:, 5:], h["C"])
    assert not found[:, 5:, :5].any()


@pytest.mark.parametrize("count", [12, 24], ids=["72 forces, lines side by side", "144 forces, line by line"])
def test_a_ring_of_many_bodies_is_one_matrix(count):
    rng, n, f = np.random.default_rng(count), 12, FREQ[:5]
    dofs = [f"{d}" for d in range(n)]
    z = np.zeros((f.size, count * n, count * n), complex)
    bodies, links = {}, []
    for b in range(count):
        own, following = slice(b * n, b * n + n), (b + 1) % count
        root = rng.standard_normal((n, n))
        # Neither bodies nor joints are reciprocal.
        stiffness = (1 + 0.02j) * (1e5 * (root @ root.T + 0.1 * root) + 1e4 * np.eye(n))
        own_z = stiffness - (2 * np.pi * f[:, None, None]) ** 2 * np.eye(n)
        z[:, own, own] += own_z
        bodies[f"b{b}"] = jf.FreeBody(np.linalg.inv(own_z), dofs)
        joint = jf.Joint(1e5 * (3 * np.eye(6) + rng.uniform(-1, 1, (6, 6))), dofs=dofs[:6])
        links.append(jf.BodyLink(joint, [f"b{b}/{d}" for d in dofs[6:]], [f"b{following}/{d}" for d in dofs[:6]]))
        place = np.r_[b * n + 6 : b * n + n, following * n : following * n + 6]
        z[:, place[:, None], place] += np.kron([[1, -1], [-1, 1]], joint.dynamic_stiffness(f))
    expected = np.linalg.inv(z)
    limit = {"rtol": 0, "atol": 1e-10 * abs(expected).max()}
    assert_allclose(jf.couple_bodies(f, bodies, links), expected, **limit)
    forces = ["b1/0", "b7/3"]
    some = jf.couple_bodies(f, bodies, links, ["b0/1", "b8/11"], forces)
    assert_allclose(some, expected[:, [1, 8 * n + 11]][:, :, [n, 7 * n + 3]], **limit)
    # A line by itself is not computed side by side with others.
    one = {name: jf.FreeBody(body.h[:1], dofs) for name, body in bodies.items()}
    assert_allclose(jf.couple_bodies(f[:1], one, links), expected[:1], **limit)


RIGID = jf.LawJoint({}, rigid=["x"])


def test_a_ring_of_rigid_links_is_the_chain_that_it_closes(bodies):
    chain = [jf.BodyLink(RIGID, ["A/2:x"], ["B/1:x"]), jf.BodyLink(RIGID, ["B/1:x"], ["C/1:x"])]
    expected = jf.couple_bodies(FREQ, bodies, chain)
    for more in (["C/1:x", "A/2:x"], ["A/2:x", "C/1:x"], ["B/1:x", "A/2:x"]):
        ring = [*chain, jf.BodyLink(RIGID, more[:1], more[1:])]
        assert_allclose(jf.couple_bodies(FREQ, bodies, ring), expected, rtol=1e-12)
    parts = {name: jf.Substructure(part, exact=True) for name, part in zip("ABC", chains(), strict=True)}
    ends = [("A/2:x", "B/1:x"), ("B/1:x", "C/1:x"), ("C/1:x", "A/2:x")]
    joints = {f"joint{i}": jf.PlacedJoint(RIGID, [one], [other]) for i, (one, other) in enumerate(ends)}
    whole = jf.Assembly.of_parts(parts, joints)
    names = [f"{name}/{dof}" for name, body in bodies.items() for dof in body.dofs]
    assert_allclose(whole.receptance(FREQ, names, names), expected, rtol=1e-8, atol=1e-15)


@settings(derandomize=True, max_examples=60, deadline=None, database=None)
@given(
    ties=st.lists(st.tuples(st.integers(0, 5), st.integers(0, 6)).filter(lambda tie: tie[0] != tie[1]), max_size=9),
    springs=st.lists(st.tuples(st.integers(0, 5), st.integers(0, 6)).filter(lambda tie: tie[0] != tie[1]), max_size=3),
    seed=st.integers(0, 99),
)
def test_any_rigid_links_are_the_assembly_in_the_null_space_of_their_constraints(ties, springs, seed):
    """DOF 6 is the ground; the links come in random order."""
    m, k, c = matrices()
    names = [f"{name}/{dof}" for name, part in zip("ABC", chains(), strict=True) for dof in part.dofs]

    def link(joint: jf.Joint | jf.LawJoint, tie: tuple[int, int]) -> jf.BodyLink:
        return jf.BodyLink(joint, [names[tie[0]]], [names[tie[1]]] if tie[1] < 6 else [])

    spring = jf.Joint([2e3], [3.0], ["x"])
    links = [link(RIGID, tie) for tie in ties] + [link(spring, tie) for tie in springs]
    if not links:
        return
    random.Random(seed).shuffle(links)
    for one, other in springs:
        k, c = (own + value * between(one, other if other < 6 else None) for own, value in ((k, 2e3), (c, 3.0)))
    rows = np.zeros((len(ties), 7))
    for row, (one, other) in zip(rows, ties, strict=True):
        row[one], row[other] = 1, -1
    free = null_space(rows[:, :6]) if ties else np.eye(6)
    reduced = whole(*(free.T @ own @ free for own in (m, k, c))) if free.size else np.zeros((FREQ.size, 0, 0))
    expected = free @ reduced @ free.T
    parts = {name: jf.FreeBody(part.receptance(FREQ), part.dofs) for name, part in zip("ABC", chains(), strict=True)}
    found = jf.couple_bodies(FREQ, parts, links)
    assert_allclose(found, expected, rtol=0, atol=1e-9 * max(abs(part.h).max() for part in parts.values()))


def test_a_rigid_body_that_is_held_more_than_once_is_singular():
    body = jf.rigid_body(2.0, [0.1, 0.1, 0.2], {"p": [0.5, 0, 0], "q": [0, 0.5, 0], "r": [0, 0, 0.5]})
    names = [f"{point}:{direction}" for point in "pqr" for direction in "xyz"]
    held = {"A": jf.FreeBody(body.receptance(FREQ, names), names)}
    links = [jf.BodyLink(RIGID, [f"A/{name}"]) for name in names]
    with pytest.raises(jf.SingularLineError, match="couple_bodies: singular matrix"):
        jf.couple_bodies(FREQ, held, links)
    assert np.isnan(jf.couple_bodies(FREQ, held, links, on_singular="nan")).all()
    six = [0, 1, 2, 4, 5, 8]  # enough to hold it
    limit = 1e-9 * abs(np.asarray(held["A"].h)).max()
    assert abs(jf.couple_bodies(FREQ, held, [links[i] for i in six])).max() < limit


def test_a_rotation_by_another_name_is_suggested(bodies):
    turned = {"A": jf.FreeBody(np.ones((FREQ.size, 2, 2)), ["3:y", "3:theta_z"])}
    with pytest.raises(ValueError, match="no body has a DOF 'A/3:theta'; did you mean A/3:theta_z"):
        jf.couple_bodies(FREQ, turned, [jf.BodyLink(jf.Joint([1.0]), ["A/3:theta"])])
    with pytest.raises(ValueError, match="no DOF '2:theta_z'; did you mean 2:theta"):
        jf.beam(1.0, 2, youngs_modulus=2e11, density=7.8e3, width=0.02, height=0.01).index("2:theta_z")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"links": [jf.BodyLink(jf.Joint([1.0]), ["A/9:x"])]}, "links: no body has a DOF 'A/9:x'"),
        ({"links": [jf.BodyLink(jf.Joint([1.0]), ["A/1:x"], ["A/1:x"])]}, "A/1:x is connected with itself"),
        ({"responses": ["A/1:x", "A/1:x"]}, "responses must name each DOF once"),
        ({"bodies": {"A/": jf.FreeBody(np.ones((25, 1, 1)), ["x"])}}, "names without '/'"),
        ({"links": []}, "links must contain at least one BodyLink"),
        ({"freq_hz": [1.0]}, "body A must have 1 lines as freq_hz, not 25"),
    ],
)
def test_wrong_bodies_are_refused(bodies, change, message):
    links = [jf.BodyLink(jf.Joint([1.0]), ["A/1:x"])]
    with pytest.raises(ValueError, match=message):
        jf.couple_bodies(**({"freq_hz": FREQ, "bodies": bodies, "links": links} | change))


def test_wrong_parts_are_refused():
    with pytest.raises(ValueError, match="dofs must name the 2 DOFs of h"):
        jf.FreeBody(np.ones((1, 2, 2)), ["x"])
    with pytest.raises(ValueError, match="second must name 1 DOFs as the joint has, not 2"):
        jf.BodyLink(jf.Joint([1.0]), ["A/x"], ["B/x", "B/y"])
    h = np.ones((25, 1, 1), complex)
    h[3] = np.nan
    with pytest.raises(ValueError, match="line"):
        jf.couple_bodies(FREQ, {"A": jf.FreeBody(h, ["x"])}, [jf.BodyLink(jf.Joint([1.0]), ["A/x"])])
