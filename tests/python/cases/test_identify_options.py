"""`jointfrf identify` with every two of its options together: it works, or one sentence says what to change."""

import itertools

import numpy as np
import pytest

import jointfrf as jf
from command import run_command
from jointfrf.io import Channel, FrfSet, write_frfs

FREQ_HZ = np.linspace(5.0, 45.0, 60)
PART = """
model = "chain"
masses = [{masses}]
stiffness = [{stiffness}]
damping = [{damping}]
ground = "none"
joint = ["{joint}"]
"""
ASSEMBLY = """
[A]
{a}
[B]
{b}
[joint]
dofs = ["x"]
stiffness = [1e4]
damping = [10.0]
[channels]
"1:+x" = "A/2:x"
"2:+x" = "B/1:x"
"""
A = dict(masses="5.0, 3.0", stiffness="2e5", damping="30.0", joint="2:x")
B = dict(masses="4.0, 2.0", stiffness="1.5e5", damping="20.0", joint="1:x")
#: Options that stand in every call, unless another way to the joint is one of the two.
JOINT = ("--j", "1", "--k", "2", "--dofs", "x")
OPTIONS = {
    "at": ("--at", "0,0,0"),
    "at-k": ("--at-k", "0,0,0.1"),
    "channels": ("--channels", "{dir}/channels.csv"),
    "line": ("--spacing", "0.02", "--axis", "y"),
    "band": ("--band", "5:40"),
    "quantity": ("--quantity", "accelerance"),
    "force-quantity": ("--quantity", "accelerance", "--force-quantity"),
    "map": ("--map", "h=measured"),
    "points": ("--points", "bolt"),
    "same": ("--same", "bolt,nut"),
    "model": ("--model", "{dir}/assembly.toml"),
    "each": ("--each",),
    "find-wrong-channels": ("--find-wrong-channels",),
    "method": ("--method", "inverse-substructuring"),
    "methods": ("--method", "compliance,inverse-substructuring"),
    **{f"damping-{word}": ("--damping", word) for word in ("none", "viscous", "hysteretic", "both")},
    **{f"cross-{word}": ("--cross", word) for word in ("ignore", "points", "fit")},
    "sides": ("--side-j", "{dir}/a.toml", "--side-k", "{dir}/b.toml"),
    "side": ("--side-j", "{dir}/a.toml"),
    "law": ("--law", "x=spring"),
    "joint": ("--joint", "{dir}/joint.toml"),
    "noise": ("--noise", "0.002"),
    "setup-gain": ("--setup-gain", "0.01"),
    "common-gain": ("--common-gain", "0.01"),
    "accept": ("--accept", "quantity"),
    "window-decay": ("--window-decay", "2"),
    "no-window": ("--window-decay", "0"),
    "negative-window": ("--window-decay", "-2"),
    "mass-j": ("--mass-j", "8"),
    "mass-k": ("--mass-k", "600"),
    "mass": ("--mass", "-14"),
    "bending-stiffness": ("--bending-stiffness", "100"),
    "report": ("--report", "{dir}/out.html"),
    "save": ("--save", "{dir}/out.json"),
    "save-lines": ("--save-lines",),
    "export": ("--export", "nastran:9001,9002"),
    "output": ("--output", "{dir}/out.bdf"),
    "nodes-at": ("--nodes-at", "0,0,0,0,0,0"),
    "units": ("--units", "mm-t-s"),
    "faces": ("--faces", "1,2:3,4"),
    "full-matrix": ("--full-matrix",),
    "connector": ("--connector",),
    "all-damping": ("--all-damping",),
    "bounds": ("--bounds",),
    "no-damping": ("--no-damping",),
    "json": ("--json",),
    "quiet": ("--quiet",),
}
#: Pairs in which other ways to the joint, or to what is fitted, meet; all others are tried with `long`.
CHOSEN = ("at", "points", "model", "sides", "law", "methods", "cross-ignore", "window-decay", "save", "json")
PAIRS = [
    pytest.param(one, other, marks=() if {one, other} <= {*CHOSEN} else pytest.mark.long, id=f"{one}+{other}")
    for one, other in itertools.combinations(OPTIONS, 2)
]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Two chains and a spring: their FRFs at the joint, and what the options name."""
    folder = tmp_path_factory.mktemp("options")
    a = jf.chain([5.0, 3.0], [2e5], [30.0], ground="none").receptance(FREQ_HZ)
    b = jf.chain([4.0, 2.0], [1.5e5], [20.0], ground="none").receptance(FREQ_HZ)
    h = jf.couple(a, b, jf.Joint([2e4], [25.0]).dynamic_stiffness(FREQ_HZ), [1], [0])[:, 1:3, 1:3]
    h = jf.pollute(h * (2j * np.pi * FREQ_HZ[:, None, None]) ** 2, 0.002, seed=1)
    ends = (Channel(1, "+x"), Channel(2, "+x"))
    places = {1: np.array([0.01, 0.0, 0.0]), 2: np.array([-0.01, 0.0, 0.0])}
    write_frfs(folder / "test.npz", FrfSet(FREQ_HZ, ends, ends, h, "accelerance", places))
    np.savez(
        folder / "arrays.npz", measured=h, freq_hz=FREQ_HZ, responses=["1:+x", "2:+x"], excitations=["1:+x", "2:+x"],
        quantity="accelerance", unit="(m/s^2)/N",
    )  # fmt: skip
    parts = PART.format(**A), PART.format(**B)
    for name, text in zip("ab", parts, strict=True):
        (folder / f"{name}.toml").write_text(text)
    (folder / "assembly.toml").write_text(ASSEMBLY.format(a=parts[0], b=parts[1]))
    (folder / "joint.toml").write_text('[[law]]\ndof = "x"\nlaw = "spring"\nvalues = { k = 1e4, c = 10.0 }\n')
    (folder / "channels.csv").write_text("channel,side,x,y,z\n1:+x,j,0,0,0\n2:+x,k,0,0,0\n")
    return folder


def outcome(folder, *names):
    words = [word.format(dir=folder) for name in names for word in OPTIONS[name]]
    joint = () if "model" in names else JOINT
    file = "arrays.npz" if "map" in names else "test.npz"  # a file of the package takes no mapping
    return words, run_command("identify", folder / file, *joint, *words)


def check(words, result):
    assert "Traceback" not in result.stderr, words
    assert "encountered" not in result.stderr, (words, result.stderr)
    without_coordinates = result.returncode == 1 and "has no coordinates in" in result.stderr and "--map" in words
    assert result.returncode in (0, 2) or without_coordinates, (words, result.stderr)
    errors = [line for line in result.stderr.splitlines() if line.startswith("jointfrf: error:")]
    assert len(errors) == (result.returncode != 0), (words, result.stderr)


@pytest.mark.parametrize("name", OPTIONS)
def test_one_option(folder, name):
    check(*outcome(folder, name))


def test_none_finds_the_joint(folder):
    words, result = outcome(folder)
    check(words, result)
    assert result.returncode == 0
    assert "k_x" in result.stdout


@pytest.mark.parametrize(("one", "other"), PAIRS)
def test_two_options(folder, one, other):
    check(*outcome(folder, one, other))
