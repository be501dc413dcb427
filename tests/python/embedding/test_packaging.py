"""What is installed: the extension's symbols, metadata, data files; on demand (`-m wheel`) a wheel elsewhere."""

import ast
import importlib.metadata
import importlib.resources
import os
import pathlib
import re
import runpy
import shutil
import subprocess
import sys
import tarfile
import tomllib

import pytest
import yaml

import jointfrf
from jointfrf import _kernel

ROOT = pathlib.Path(__file__).resolve().parents[3]
PACKAGING = ROOT / "python" / "packaging"
CASES = sorted(path.parent.name for path in (ROOT / "cases").glob("*/case.toml"))


@pytest.mark.skipif(not sys.platform.startswith("linux") or shutil.which("nm") is None, reason="needs nm and ELF")
def test_extension_exports_nothing_but_its_entry_point():
    command = ["nm", "-D", "--defined-only", _kernel.__file__]
    listing = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert [line.split()[-1] for line in listing.splitlines()] == ["PyInit__kernel"]


def test_metadata():
    about = importlib.metadata.metadata("jointfrf")
    assert about["Version"] == jointfrf.__version__
    assert about["License-Expression"] == "BSD-3-Clause"
    needed = [text for text in about.get_all("Requires-Dist") if "extra ==" not in text]
    assert {text.split(">")[0] for text in needed} == {"msgspec", "numpy", "scipy", "scipy-openblas32", "threadpoolctl"}


def test_kernel_has_the_version_of_the_package():
    assert ".".join(str(int(number)) for number in _kernel.jf_version()) == importlib.metadata.version("jointfrf")


def test_recipes_ask_for_what_the_package_asks_for():
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    without = tomllib.loads(re.sub(r', "scipy-openblas32>=[0-9.]*"', "", text))
    assert len(re.findall("scipy-openblas32>", text)) == 2
    wanted = set(without["project"]["dependencies"])
    assert not any("openblas" in name for name in wanted | set(without["build-system"]["requires"]))
    recipe = yaml.safe_load((PACKAGING / "conda" / "recipe.yaml").read_text(encoding="utf-8"))
    assert recipe["context"]["version"] == jointfrf.__version__
    assert recipe["build"]["script"][0] == """sed -i.orig 's/, "scipy-openblas32>=[0-9.]*"//' pyproject.toml"""
    run = [line.replace(" ", "").replace("msgspec-python", "msgspec") for line in recipe["requirements"]["run"]]
    assert set(run) == wanted | {f"python{without['project']['requires-python']}"}
    spack = ast.parse((PACKAGING / "spack" / "package.py").read_text(encoding="utf-8"))
    calls = [node for node in ast.walk(spack) if isinstance(node, ast.Call) and ast.unparse(node.func) == "depends_on"]
    needed = {node.args[0].value.removeprefix("py-").removesuffix(":").replace("@", ">=") for node in calls}
    assert wanted | {"python>=3.11", "blas", "lapack", "c", "fortran"} <= needed


def test_continuous_integration_calls_programs_that_are_there():
    paths = (ROOT / ".github" / "workflows").glob("*.yml")
    jobs = [job for path in paths for job in yaml.safe_load(path.read_text(encoding="utf-8"))["jobs"].values()]
    lines = [step["run"] for job in jobs for step in job["steps"] if "run" in step]
    called = {word.removeprefix("./") for line in lines for word in re.findall(r"(?<![\w./])[.\w]*/[\w/.]+", line)}
    assert {"tests/run", "tests/portability/run"} <= called
    assert all((ROOT / name).is_file() for name in called), called


def test_wheels_of_every_system_leave_openblas_out_and_are_tested():
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["cibuildwheel"]
    libraries = {
        "linux": "libscipy_openblas.so",
        "macos": "libscipy_openblas.dylib",
        "windows": "libscipy_openblas.dll",
    }
    for system, library in libraries.items():
        assert f"--exclude {library} " in settings[system]["repair-wheel-command"]
    (script,) = re.findall(r"\{project\}/(\S+)", settings["test-command"])
    files = runpy.run_path(str(ROOT / script))["FILES"]
    assert all((ROOT / "tests" / "python" / name).is_file() for name in files)


@pytest.mark.parametrize("name", CASES)
def test_cases_travel_with_the_package(name):
    case = importlib.resources.files("jointfrf") / "data" / "cases" / name
    # What nothing is known about beforehand has no expected.toml.
    files = [path.name for path in (ROOT / "cases" / name).iterdir() if path.suffix in (".toml", ".md")]
    assert {"case.toml", "README.md"} <= set(files)
    assert all((case / file).is_file() for file in files)


CHECK = """
import importlib.resources, sys
import numpy as np
import jointfrf
a = np.arange(1.0, 6.0)[:, None, None] * np.eye(3) + 0.1j
assert abs(jointfrf.invert(a) @ a - np.eye(3)).max() < 1e-12
cases = importlib.resources.files("jointfrf") / "data" / "cases"
assert sorted(case.name for case in cases.iterdir() if (case / 'case.toml').is_file()) == sys.argv[1:]
"""
FORTRAN = ("libgfortran", "libgomp", "libquadmath", "openblas", "lapack", "blas")
#: Where the libraries of Fortran and LAPACK come from; its environment must be their place.
PLACES = """
import pathlib
maps = [line.split(maxsplit=5)[-1].strip() for line in open("/proc/self/maps")]
fortran = {m for m in maps if any(name in m for name in ("libgfortran", "libgomp", "libquadmath", "openblas"))}
assert fortran
assert all(pathlib.Path(m).is_relative_to(sys.prefix) for m in fortran), fortran
"""
#: What a fit and a command need beyond that.
FIT = """
import shutil
from jointfrf.workbench.cli.main import main
assert not any(map(shutil.which, ("cc", "gcc", "gfortran", "sh"))), "the root is not clean"
freq = np.linspace(0.5, 10, 200)
a = jointfrf.chain([5], [2500], [3], ground="start").receptance(freq)
gamma = jointfrf.couple(a, a, [[2000 + 3j]], [0], [0])
print(jointfrf.identify(freq, jointfrf.pollute(gamma, 0.01, seed=1), ["x"]))
assert main(["cases"]) == 0
"""


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    """The source archive and the wheel that is made from it."""
    folder = tmp_path_factory.mktemp("packages")
    subprocess.run([ROOT / "python" / "build_wheel.sh", folder], check=True)
    (archive,), (wheel,) = folder.glob("*.tar.gz"), folder.glob("*.whl")
    return archive, wheel


@pytest.mark.builds
@pytest.mark.wheel
@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the wheel script is for Linux")
def test_wheel_brings_its_own_fortran_library(packages, tmp_path):
    _, wheel = packages
    subprocess.run([sys.executable, "-m", "venv", tmp_path / "venv"], check=True)
    python = tmp_path / "venv" / "bin" / "python"
    subprocess.run([python, "-m", "pip", "install", "-q", wheel], check=True)
    clean = {key: value for key, value in os.environ.items() if key not in ("LD_LIBRARY_PATH", "PYTHONPATH")}
    subprocess.run([python, "-c", CHECK + PLACES, *CASES], check=True, cwd=tmp_path, env=clean)


@pytest.mark.builds
@pytest.mark.wheel
@pytest.mark.skipif(not shutil.which("unshare"), reason="needs unshare")
def test_wheel_works_in_a_root_with_nothing_but_python(packages, tmp_path):
    if subprocess.run(["unshare", "-r", "true"], check=False, capture_output=True).returncode:
        pytest.skip("no namespaces of users here")
    _, wheel = packages
    root = tmp_path / "root"
    base = pathlib.Path(sys.base_prefix).resolve()
    version = f"python{sys.version_info[0]}.{sys.version_info[1]}"
    left_out = shutil.ignore_patterns(
        "test", "tests", "__pycache__", "site-packages", "dist-packages", "config-*", "*.a"
    )
    shutil.copytree(base / "lib" / version, root / "python" / "lib" / version, ignore=left_out)
    python = root / "python" / "bin" / version
    python.parent.mkdir()
    shutil.copy2(base / "bin" / version, python)
    installed = root / "python" / "lib" / version / "site-packages"
    command = [sys.executable, "-m", "pip", "install", "-q", "-c", ROOT / "python" / "constraints.txt"]
    subprocess.run([*command, "--target", installed, wheel], check=True)
    # What manylinux wheels may take from the system: libc, libstdc++ and the like, but nothing of Fortran.
    for binary in (python, *root.rglob("*.so*")):
        needed = subprocess.run(["ldd", binary], capture_output=True, text=True, check=False).stdout.split()
        for library in (word for word in needed if word.startswith("/") and not word.startswith(str(root))):
            place = root / library[1:]
            if not place.exists() and not any(name in place.name for name in FORTRAN):
                place.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(library, place)
    clean = {"PATH": "/python/bin", "HOME": "/", "LD_LIBRARY_PATH": str(base / "lib")}
    enter = [shutil.which("unshare"), "-r", shutil.which("chroot"), root]
    inside = [*enter, f"/python/bin/{version}", "-c", CHECK + FIT, *CASES]
    done = subprocess.run(inside, capture_output=True, text=True, check=False, env=os.environ | clean)
    assert done.returncode == 0, done.stderr
    assert "k_x" in done.stdout


@pytest.mark.builds
@pytest.mark.wheel
def test_the_source_archive_holds_what_is_checked_in(packages):
    archive, _ = packages
    with tarfile.open(archive) as held:
        names = {name.partition("/")[2] for name in held.getnames()}
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert set(listed.split()) <= names
