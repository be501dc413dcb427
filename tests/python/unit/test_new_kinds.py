"""A new law, or kind of noise, is one place in the package: it is found in files, their reference, fits and cards."""

import shutil
import subprocess
import sys
from pathlib import Path

import jointfrf
from jointfrf import _kernel
from new_kinds import LAW

PACKAGE = Path(jointfrf.__file__).parent

#: Runs a program with the package of a copied tree, and the compiled kernel of this one.
RUN = """
import importlib.util, sys
sys.meta_path[:] = [finder for finder in sys.meta_path if "editable" not in type(finder).__module__]
sys.path.insert(0, sys.argv[1])
spec = importlib.util.spec_from_file_location("jointfrf._kernel", sys.argv[2])
sys.modules["jointfrf._kernel"] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(sys.modules["jointfrf._kernel"])
import jointfrf as jf
assert jf.__file__.startswith(sys.argv[1])
"""

USES_LAW = """
import io, contextlib, pathlib
import numpy as np
from jointfrf.workbench.cli.main import main
folder = pathlib.Path(sys.argv[3])
text = '[[law]]\\ndof = "x"\\nlaw = "inertial-spring"\\nvalues = { k = 2000.0, inertance = 0.1 }\\n'
(folder / "joint.toml").write_text(text)
joint = jf.read_joint(folder / "joint.toml")
assert jf.read_joint(jf.write_joint(folder / "again.toml", joint)) == joint
with contextlib.redirect_stdout(io.StringIO()) as shown:
    main(["cases", "--keys"])
assert "`inertial-spring` `k`, `inertance`" in shown.getvalue()
assert "`inertance` force per relative acceleration (number, 0 to 10)" in shown.getvalue()
freq = np.linspace(0.5, 10, 200)
a = jf.chain([5], [2500], [3], ground="start").receptance(freq)
b = jf.chain([4], [2000], [2], ground="end").receptance(freq)
gamma = jf.pollute(jf.couple(a, b, joint, [0], [0], freq_hz=freq), 0.01, seed=1)
fit = jf.identify(freq, gamma, joint=joint.with_values([1500.0, 0.05]))
assert abs(fit.joint.values / [2000.0, 0.1] - 1).max() < 0.02, fit
assert "inertance_x" in str(fit)
assert "InertialSpring of x at 5 Hz" in joint.export("abaqus", (1, 2), freq_hz=5.0)
"""

USES_NOISE = """
import io, contextlib
import numpy as np
from jointfrf.workbench.cli.main import main
h = np.ones((2000, 1, 1), complex)
assert abs(np.mean(abs(jf.pollute(h, 0.1, "twice") - h) ** 2) / 0.02 - 1) < 0.1
with contextlib.redirect_stdout(io.StringIO()) as shown:
    main(["cases", "--keys"])
assert "`twice`" in shown.getvalue()
"""


def test_a_new_law_is_one_file_and_one_line(tmp_path):
    tree = copied(tmp_path)
    (tree / "laws" / "inertial_spring.py").write_text(LAW)
    line = '    "spring": ("springs", "SpringLaw"),\n'
    put(tree / "laws" / "words.py", line, f'{line}    "inertial-spring": ("inertial_spring", "InertialSpring"),\n')
    run(tmp_path, USES_LAW)


def test_a_new_kind_of_noise_is_one_word_and_one_line(tmp_path):
    tree = copied(tmp_path)
    put(tree / "frf" / "noise.py", 'NoiseKind = Literal["complex",', 'NoiseKind = Literal["complex", "twice",')
    line = '    "complex": NoiseNumbers("C", 1.0, True),\n'
    put(tree / "frf" / "noise.py", line, line + '    "twice": NoiseNumbers("P", 2.0, True),\n')
    run(tmp_path, USES_NOISE)


def test_every_kind_of_noise_is_described():
    from jointfrf.frf.noise import NOISE_KINDS

    for kind in NOISE_KINDS:
        assert f'- "{kind}":' in jointfrf.pollute.__doc__


def copied(folder: Path) -> Path:
    """Copy the package, and return where it is."""
    tree = folder / "tree" / "jointfrf"
    shutil.copytree(PACKAGE, tree, ignore=shutil.ignore_patterns("__pycache__"))
    return tree


def put(path: Path, old: str, new: str) -> None:
    text = path.read_text(encoding="utf-8")
    assert text.count(old) == 1
    path.write_text(text.replace(old, new), encoding="utf-8")


def run(folder: Path, program: str) -> None:
    arguments = [sys.executable, "-c", RUN + program, str(folder / "tree"), _kernel.__file__, str(folder)]
    done = subprocess.run(arguments, capture_output=True, text=True, cwd=folder)
    assert done.returncode == 0, done.stderr
