"""A plane-frame program in FORTRAN 77 by itself, and with the patch that makes it use the library."""

import shutil
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

import jointfrf as jf
from installed_library import InstalledLibrary, run

pytestmark = pytest.mark.builds

F77 = Path(__file__).resolve().parents[2] / "f77"
PATCH = F77 / "frame-joint.patch"
JOINT_NODES = (5, 6)
JOINT = jf.Joint([4e6, 2e6, 3e3], [30.0, 20.0, 1.5], ["x", "y", "theta"])


@dataclass
class Deck:
    """The cards of a deck, and models from them by another route: jf.beam, turned and assembled with numpy."""

    nodes: dict[int, np.ndarray] = field(default_factory=dict)
    sections: dict[int, list[float]] = field(default_factory=dict)
    members: list[list[int]] = field(default_factory=list)
    held: set[tuple[int, int]] = field(default_factory=set)
    loads: list[tuple[int, int, float]] = field(default_factory=list)
    responses: list[tuple[int, int]] = field(default_factory=list)
    loss_factor: float = 0.0
    freq_hz: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def read(cls, path: Path) -> "Deck":
        deck = cls()
        for card in path.read_text().splitlines()[1:]:
            i = [int(card[at : at + 8].strip() or 0) for at in (8, 16, 24)]
            r = [float(card[at : at + 12].strip() or 0) for at in (32, 44, 56, 68)]
            match card[:8].strip():
                case "NODE":
                    deck.nodes[i[0]] = np.array(r[:2])
                case "SECTION":
                    deck.sections[i[0]] = r
                case "MEMBER":
                    deck.members.append(i)
                case "SUPPORT":
                    deck.held |= {(i[0], d) for d in ((i[1],) if i[1] else (1, 2, 3))}
                case "LOAD":
                    deck.loads.append((i[0], i[1], r[0]))
                case "RESPONSE":
                    deck.responses.append((i[0], i[1]))
                case "DAMPING":
                    deck.loss_factor = r[0]
                case "FREQ":
                    deck.freq_hz = r[0] + r[1] * np.arange(i[0])
        return deck

    def model(self, first: int, last: int) -> jf.Model:
        """Return the frame of nodes first to last; DOFs ``node:direction``."""
        n = 3 * (last - first + 1)
        k, m = np.zeros((n, n)), np.zeros((n, n))
        for i, j, section in self.members:
            if first <= i <= last:
                at = [3 * (node - first) + d for node in (i, j) for d in range(3)]
                element_k, element_m = self.member(i, j, section)
                k[np.ix_(at, at)] += element_k
                m[np.ix_(at, at)] += element_m
        names = [(node, d) for node in range(first, last + 1) for d in (1, 2, 3)]
        free = [at for at, name in enumerate(names) if name not in self.held]
        dofs = tuple(f"{names[at][0]}:{names[at][1]}" for at in free)
        return jf.Model(k[np.ix_(free, free)], m[np.ix_(free, free)], dofs=dofs, loss_factor=self.loss_factor)

    def member(self, i: int, j: int, section: int) -> tuple[np.ndarray, np.ndarray]:
        modulus, area, inertia, density = self.sections[section]
        along = self.nodes[j] - self.nodes[i]
        length = float(np.hypot(*along))
        height = float(np.sqrt(12 * inertia / area))
        material = dict(youngs_modulus=modulus, density=density, width=area / height, height=height)
        beam = jf.beam(length, 1, axial=True, **material)
        (c, s) = along / length
        turn = np.kron(np.eye(2), [[c, s, 0], [-s, c, 0], [0, 0, 1]])
        return turn.T @ beam.stiffness.toarray() @ turn, turn.T @ beam.mass.toarray() @ turn


def receptances(model: jf.Model, deck: Deck, to: list[str], into: list[str]) -> np.ndarray:
    """FRFs by numpy alone; zero at DOFs that are held."""
    z = (1 + 1j * model.loss_factor) * np.asarray(model.stiffness)
    z = z - (2 * np.pi * deck.freq_hz[:, None, None]) ** 2 * np.asarray(model.mass)
    inverse = np.pad(np.linalg.inv(z), ((0, 0), (0, 1), (0, 1)))
    at, by = ([model.dofs.index(dof) if dof in model.dofs else -1 for dof in dofs] for dofs in (to, into))
    return inverse[:, at][:, :, by]


def table(text: str, word: str) -> np.ndarray:
    """Return the numbers of all lines that begin with a word."""
    return np.array([line[8:].split() for line in text.splitlines() if line[:8].strip() == word], float)


def compiled(folder: Path, *libraries: str) -> Path:
    flags = ["-std=legacy", "-Wall", "-Werror", "-O1", "-fcheck=all"]
    run(["gfortran", *flags, "frame.f", "-o", "frame", *libraries], cwd=folder)
    return folder / "frame"


@pytest.fixture(scope="module")
def deck() -> Deck:
    return Deck.read(F77 / "frame.deck")


@pytest.fixture(scope="module")
def frame(tmp_path_factory) -> Path:
    """Build the program as it is, without the library."""
    if shutil.which("gfortran") is None:
        pytest.skip("gfortran not found")
    folder = tmp_path_factory.mktemp("frame")
    for name in ("frame.f", "frame.inc"):
        shutil.copy(F77 / name, folder)
    return compiled(folder)


@pytest.fixture(scope="module")
def patched(installed_library: InstalledLibrary, tmp_path_factory) -> Path:
    if shutil.which("patch") is None:
        pytest.skip("patch not found")
    folder = tmp_path_factory.mktemp("patched")
    for name in ("frame.f", "frame.inc"):
        shutil.copy(F77 / name, folder)
    run(["patch", "-p1", "-i", PATCH], cwd=folder)
    (lib_dir,) = installed_library.pkg_config("--variable=libdir")
    return compiled(folder, *installed_library.pkg_config("--libs"), f"-Wl,-rpath,{lib_dir}")


@pytest.fixture(scope="module")
def with_joint() -> str:
    """Return the deck with the cards of the joint that the documentation shows."""
    cards = [line for line in (F77 / "README.md").read_text().splitlines() if line.startswith("JOINT ")]
    return (F77 / "frame.deck").read_text().replace("END\n", "\n".join([*cards, "END\n"]))


def test_responses_to_loads(frame, deck):
    found = table(run([frame], input=(F77 / "frame.deck").read_text()), "RESPONSE")
    to = [f"{node}:{d}" for node, d in deck.responses]
    into = [f"{node}:{d}" for node, d, _ in deck.loads]
    forces = np.array([force for *_, force in deck.loads])
    whole = np.zeros((deck.freq_hz.size, len(to)), complex)
    for nodes in ((1, 5), (6, 9)):
        whole += receptances(deck.model(*nodes), deck, to, into) @ forces
    own = (found[:, 4] + 1j * found[:, 5]).reshape(whole.shape)
    np.testing.assert_allclose(own, whole, rtol=1e-9, atol=1e-12 * abs(whole).max())
    assert (own[:, deck.responses.index((9, 1))] == 0).all()
    np.testing.assert_allclose(found[:, 3].reshape(whole.shape), np.tile(deck.freq_hz, (len(to), 1)).T)


@pytest.mark.parametrize(("node", "nodes"), [(5, (1, 5)), (9, (6, 9))])
def test_point_receptances(frame, deck, node, nodes):
    found = table(run([frame], input=(F77 / "frame.deck").read_text()), "POINT")
    found = found[found[:, 0] == node]
    dofs = [f"{node}:{d}" for d in (1, 2, 3)]
    exact = receptances(deck.model(*nodes), deck, dofs, dofs)
    own = (found[:, 5] + 1j * found[:, 6]).reshape(exact.shape)
    np.testing.assert_allclose(own, exact, rtol=1e-9, atol=1e-9 * abs(exact).max())


def test_straight_inclined_cantilever_is_a_beam(frame):
    """In its own axes a member that leans over is jf.beam with axial motion."""
    n, length, c, s = 6, 0.6, 0.8, 0.6
    cards = ["CANTILEVER", f"{'SECTION':8}{1:8d}{'':16}{'67.0E9':>12}{'1.5E-4':>12}{'4.5E-10':>12}{'2700.0':>12}"]
    for i in range(n + 1):
        x, y = length * i / n * np.array([c, s])
        cards.append(f"{'NODE':8}{i + 1:8d}{'':16}{x:12.9f}{y:12.9f}")
    cards += [f"{'MEMBER':8}{i:8d}{i + 1:8d}{1:8d}" for i in range(1, n + 1)]
    cards += [f"{'SUPPORT':8}{1:8d}", f"{'DAMPING':32}{0.02:12.4f}", f"{'POINT':8}{n + 1:8d}"]
    cards += [f"{'FREQ':8}{30:8d}{'':16}{7.0:12.3f}{31.0:12.3f}", "END", ""]
    found = table(run([frame], input="\n".join(cards)), "POINT")
    section = dict(youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006)
    beam = jf.beam(length, n, ends=("clamped", "free"), axial=True, loss_factor=0.02, **section)
    h = beam.receptance(7 + 31.0 * np.arange(30), beam.index(*(f"{n + 1}:{d}" for d in ("x", "y", "theta"))))
    turn = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    exact = turn @ h @ turn.T
    own = (found[:, 5] + 1j * found[:, 6]).reshape(exact.shape)
    np.testing.assert_allclose(own, exact, rtol=1e-9, atol=1e-9 * abs(exact).max())


@pytest.mark.parametrize(
    ("card", "message"),
    [
        ("SHELL          1", "CARD NOT KNOWN"),
        ("LOAD         999       1", "NUMBER ON A CARD"),
        ("NODE  one", "CARD CANNOT"),
    ],
)
def test_bad_cards_end_the_program(frame, card, message):
    deck = (F77 / "frame.deck").read_text().replace("END\n", f"{card}\nEND\n")
    done = subprocess.run([frame], input=deck, capture_output=True, text=True, timeout=900)
    assert done.returncode == 1
    assert message in done.stdout


def test_patch_is_short():
    changed = [line for line in PATCH.read_text().splitlines() if line[:1] in "+-" and line[:3] not in ("+++", "---")]
    assert 0 < len(changed) <= 30


def test_documentation_shows_the_patch():
    patch = PATCH.read_text()
    assert f"```diff\n{patch[patch.index('--- a/') :]}```" in (F77 / "README.md").read_text()


def test_patch_changes_nothing_without_a_joint(frame, patched):
    deck = (F77 / "frame.deck").read_text()
    assert run([patched], input=deck) == run([frame], input=deck)


def test_without_the_patch_there_is_no_joint(frame, with_joint):
    done = subprocess.run([frame], input=with_joint, capture_output=True, text=True, timeout=900)
    assert done.returncode == 1
    assert "CARD NOT KNOWN: JOINT" in done.stdout


def test_coupled_receptances(patched, deck, with_joint):
    found = table(run([patched], input=with_joint), "COUPLED")
    a, b = deck.model(1, 5), deck.model(6, 9)
    at, by = (
        [model.dofs.index(f"{node}:{d}") for d in (1, 2, 3)] for model, node in zip((a, b), JOINT_NODES, strict=True)
    )
    whole = jf.assemble(a, b, JOINT, at, by)
    exact = whole.receptance(deck.freq_hz, [*at, *(len(a.dofs) + i for i in by)])
    own = (found[:, 5] + 1j * found[:, 6]).reshape(exact.shape)
    scale = abs(exact).max(axis=(1, 2), keepdims=True)
    assert (abs(own - exact) / scale).max() < 1e-8


def test_identified_joint(patched, deck, with_joint):
    found = table(run([patched], input=with_joint), "JOINT")
    assert found.shape == (deck.freq_hz.size, 7)
    np.testing.assert_allclose(found[:, 1::2], np.tile(np.diag(JOINT.stiffness), (deck.freq_hz.size, 1)), rtol=1e-6)
    np.testing.assert_allclose(found[:, 2::2], np.tile(np.diag(JOINT.damping), (deck.freq_hz.size, 1)), rtol=1e-6)


def test_joint_at_a_node_that_is_not_there(patched, with_joint):
    deck = with_joint.replace(f"{'JOINT':8}{5:8d}{6:8d}", f"{'JOINT':8}{5:8d}{99:8d}")
    done = subprocess.run([patched], input=deck, capture_output=True, text=True, timeout=900)
    assert done.returncode == 1
    assert "NUMBER ON A CARD" in done.stdout
