"""Which warnings fail a test: all of our own, and of others all but what they say of their own age."""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
AGE = ["DeprecationWarning", "PendingDeprecationWarning"]
OURS = ["jointfrf", "jointfrf.io.uff", "tests.python.test_frf", "test_frf", "benchmarks.machine"]
OTHERS = ["matplotlib.text", "numpy", "h5py._hl.files"]
TESTS = f"""
import builtins, pytest, warnings

@pytest.mark.parametrize("category", {[*AGE, "UserWarning", "FutureWarning"]})
@pytest.mark.parametrize("module", {OURS + OTHERS})
def test_it(module, category):
    warnings.warn_explicit("so", getattr(builtins, category), "x.py", 1, module)
"""


def test_warnings_that_fail_a_test(tmp_path):
    (tmp_path / "test_it.py").write_text(TESTS)
    command = [sys.executable, "-m", "pytest", "-c", ROOT / "pyproject.toml", "--rootdir", tmp_path, "-rA"]
    command += ["-p", "no:cacheprovider", "-p", "no:xdist", "-p", "no:cov", tmp_path / "test_it.py"]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    passed = set(re.findall(r"^PASSED test_it\.py::test_it\[(\S+)\]", done.stdout, re.MULTILINE))
    failed = set(re.findall(r"^FAILED test_it\.py::test_it\[(\S+)\]", done.stdout, re.MULTILINE))
    assert passed == {f"{module}-{category}" for module in OTHERS for category in AGE}, done.stdout + done.stderr
    assert len(failed) == 4 * len(OURS + OTHERS) - len(passed)
