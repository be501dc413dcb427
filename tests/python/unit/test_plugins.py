"""Other packages add formats and laws by entry points; they are loaded where a file or a law is none of ours."""

import contextlib
import io
import sys

import numpy as np
import pytest

import jointfrf as jf
import jointfrf.io
from jointfrf.workbench.cli.main import main
from new_kinds import FORMAT, LAW

OURS = "jointfrf.io.file_format import FileFormat, FrfArrays"
SET = jf.io.FrfSet(
    np.array([1.0, 2.0]), (jf.io.Channel(1, "x"),), (jf.io.Channel(1, "x"),), np.array([[[1e-3 + 0j]], [[2e-3]]])
)


@pytest.fixture
def package(tmp_path, monkeypatch):
    """Install a package that adds what its text defines."""
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    number = 0

    def install(text, **entries):
        nonlocal number
        number += 1
        name = f"added_{number}"
        (tmp_path / f"{name}.py").write_text(text)
        folder = tmp_path / f"{name}-1.0.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        groups = [f"[jointfrf.{group}]\n{entry.replace(':', f' = {name}:')}\n" for group, entry in entries.items()]
        (folder / "entry_points.txt").write_text("".join(groups))
        return name

    yield install
    for i in range(number):
        sys.modules.pop(f"added_{i + 1}", None)


def test_a_format_is_read_and_written(package):
    name = package(FORMAT.replace(OURS, OURS.replace("io.file_format", "io")), formats="pairs:PAIRS")
    jf.io.write_frfs("a.npz", SET)
    assert (jf.io.read_frfs("a.npz").h == SET.h).all()
    assert name not in sys.modules
    assert main(["convert", "a.npz", "b.pairs"]) == 0
    np.testing.assert_array_equal(jf.io.read_frfs("b.pairs").h, SET.h)


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("import missing_module", "fails: ModuleNotFoundError: No module named 'missing_module'"),
        ("raise SystemExit('out')", "fails: SystemExit: out"),
        ("PAIRS = 1", "is not a jointfrf.io.FileFormat"),
        (FORMAT.replace("head.startswith(", "head.stands("), "fails: AttributeError: 'bytes' object"),
        (FORMAT.replace("np.loadtxt(", "np.loads("), "fails: AttributeError: module 'numpy'"),
        (FORMAT.replace("return FrfArrays", "return np.array; FrfArrays"), "its reader returned a "),
    ],
)
def test_a_broken_format_is_one_sentence_and_stops_no_other(package, text, sentence):
    package(text, formats="broken:PAIRS")
    with open("a.dat", "w") as file:
        file.write("two columns\n1 2\n2 4\n")
    with pytest.raises(jf.FileContentError) as caught:
        jf.io.read_frfs("a.dat")
    assert "a.dat" in str(caught.value)
    assert sentence in str(caught.value)
    assert "\n" not in str(caught.value)
    if "is of an unknown format" in str(caught.value):  # else it says that the file is its own
        package(FORMAT, formats="pairs:PAIRS")
        assert jf.io.read_frfs("a.dat").h.shape == (2, 1, 1)
    jf.io.write_frfs("a.npz", SET)
    assert (jf.io.read_frfs("a.npz").h == SET.h).all()


def test_a_law_is_found_in_files_and_on_the_command_line(package):
    package(LAW, laws="inertial-spring:InertialSpring")
    text = '[[law]]\ndof = "x"\nlaw = "inertial-spring"\nvalues = { k = 2000.0, inertance = 0.1 }\n'
    with open("joint.toml", "w") as file:
        file.write(text)
    joint = jf.read_joint("joint.toml")
    assert jf.read_joint(jf.write_joint("again.toml", joint)) == joint
    freq = np.linspace(0.5, 10, 60)
    a = jf.chain([5], [2500], [3], ground="start").receptance(freq)
    b = jf.chain([4], [2000], [2], ground="end").receptance(freq)
    gamma = jf.pollute(jf.couple(a, b, joint, [0], [0], freq_hz=freq), 0.01, seed=1)
    points = (jf.io.Channel(1, "x"), jf.io.Channel(2, "x"))
    jf.io.write_frfs("test.npz", jf.io.FrfSet(freq, points, points, gamma))
    with contextlib.redirect_stdout(io.StringIO()) as shown:
        status = main(["identify", "test.npz", "--j", "1", "--k", "2", "--dofs", "x", "--law", "x=inertial-spring",
                       "--save", "fit.json"])  # fmt: skip
    assert status == 0, shown.getvalue()
    assert abs(jf.load("fit.json").laws.values / joint.values - 1).max() < 0.05


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("1 / 0", "the plugin 'inertial-spring' .* fails: ZeroDivisionError: division by zero"),
        ("InertialSpring = int", "fails: AttributeError: type object 'int' has no attribute 'parameters'"),
        (LAW.replace('"inertial-spring"', '"other"'), "is not a subclass of jointfrf.JointLaw whose word is"),
    ],
)
def test_a_broken_law_is_one_sentence(package, text, sentence):
    package(text, laws="inertial-spring:InertialSpring")
    with open("joint.toml", "w") as file:
        file.write('[[law]]\ndof = "x"\nlaw = "inertial-spring"\nvalues = { k = 2000.0, inertance = 0.1 }\n')
    with pytest.raises(jf.FileContentError, match=rf"^joint\.toml: .*{sentence}[^\n]*$"):
        jf.read_joint("joint.toml")
