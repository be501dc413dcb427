"""What `import jointfrf` and `jointfrf --help` do not import, and that every public name is found all the same."""

import ast
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import jointfrf
from command import run_command
from jointfrf.extras import check_extras, import_extra
from jointfrf.workbench.cli.parser import COMMANDS
from packages import package_of

#: Packages of single tasks; those in ALL come with the extra `all`.
ALL = ("h5py", "jinja2", "matplotlib", "shtab", "pyarrow")
EXTRAS = (*ALL, "loky", "mpi4py")
HEAVY = {"numpy", "scipy", "matplotlib", "jinja2", "h5py", "shtab", "importlib.metadata", "jointfrf._kernel"}
#: What may be imported before the arguments of a command are parsed.
LIGHT = {"choices", "directions", "extras", "laws", "messages", "spelling", "workbench", "workbench.cli"}
#: Help, completion and usage errors.
COMMANDS_PARSED = (
    *([name, "--help"] for name in COMMANDS),
    ["completion", "bash"],
    ["identfy"],
    ["identify"],
    ["identify", "test.uff", "--dof", "y"],
    ["identify", "test.uff", "--dofs", "q"],
    ["identify", "test.uff", "--j", "101:"],
    ["identify", "test.uff", "--law", "y=springy"],
    ["export", "joint.json", "abacus:1,2"],
)


def modules_after(code: str) -> set[str]:
    """Names of all modules that a new process has imported after some code and not before."""
    program = f"import sys\nbefore = set(sys.modules)\n{code}\nprint('\\n' + '\\n'.join(set(sys.modules) - before))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return set(done.stdout.split("\n"))


def test_the_package_imports_nothing_heavy():
    found = modules_after("import jointfrf")
    assert "jointfrf" in found
    assert not found & HEAVY


def test_help_imports_nothing_heavy():
    call = "from jointfrf.workbench.cli.main import main\ntry: main(['--help'])\nexcept SystemExit: pass"
    found = modules_after(call)
    assert "jointfrf.workbench.cli.main" in found
    assert not found & HEAVY


@pytest.mark.parametrize("words", COMMANDS_PARSED, ids=" ".join)
def test_arguments_are_parsed_before_anything_that_computes_is_imported(words):
    imports = "from contextlib import redirect_stdout, suppress\nfrom io import StringIO\n"
    imports += "from jointfrf.workbench.cli.main import main\n"
    found = modules_after(f"{imports}with suppress(SystemExit), redirect_stdout(StringIO()): main({words})")
    assert "jointfrf.workbench.cli.main" in found
    assert not found & (HEAVY - {"shtab", "importlib.metadata"})  # completion; laws of other packages
    assert {package_of(name) for name in found if name.startswith("jointfrf.")} <= LIGHT


def test_the_core_imports_no_workbench():
    found = modules_after("import jointfrf\njointfrf.identify, jointfrf.identify_model, jointfrf.io.FrfSet")
    assert "jointfrf.identification.model.fit" in found
    assert not [name for name in found if name.startswith("jointfrf.workbench")]


def test_a_name_imports_only_what_it_needs():
    found = modules_after("import jointfrf\njointfrf.invert, jointfrf.io.FrfSet, jointfrf.pollute")
    assert {"numpy", "jointfrf._kernel"} <= found
    assert not found & (HEAVY - {"numpy", "jointfrf._kernel"})


def test_methods_of_identification_import_no_statistics():
    found = modules_after("import jointfrf\njointfrf.identify")
    assert "jointfrf.identification.manifold.fit" in found
    assert not found & {"scipy.stats", "scipy.optimize", "scipy.interpolate", "scipy.io", "scipy.signal"}


def test_every_public_name_is_found():
    for name in jointfrf.__all__:
        assert getattr(jointfrf, name) is not None, name
    assert {*jointfrf.__all__, "io", "solids", "report", "__version__"} <= set(dir(jointfrf))
    with pytest.raises(AttributeError, match="no attribute 'identfy'"):
        _ = jointfrf.identfy
    with pytest.raises(ImportError, match="identfy"):
        exec("from jointfrf import identfy")


def test_the_stub_names_in_all_what_it_imports():
    stub = ast.parse(Path(jointfrf.__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
    (names,) = (ast.literal_eval(node.value) for node in stub.body if isinstance(node, ast.Assign))
    assert sorted(names) == jointfrf.__all__


@pytest.mark.parametrize("package", EXTRAS)
def test_a_missing_package_is_one_sentence(package, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    for ask in (import_extra, check_extras):
        with pytest.raises(jointfrf.MissingPackageError, match=rf"need the package {package}: pip install 'jointfrf\["):
            ask(package)


def test_a_fault_inside_a_package_is_not_called_missing(tmp_path, monkeypatch):
    (tmp_path / "jinja2").mkdir()
    (tmp_path / "jinja2" / "__init__.py").write_text("import no_such_module")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "jinja2", raising=False)
    with pytest.raises(ModuleNotFoundError, match="no_such_module"):
        import_extra("jinja2")


def test_extras_are_those_of_the_project():
    """What the sentence says to install exists and brings the package; `all` brings every one."""
    project = Path(__file__).resolve().parents[3] / "pyproject.toml"
    extras = tomllib.loads(project.read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    for package in EXTRAS:
        with pytest.MonkeyPatch.context() as patch:
            patch.setitem(sys.modules, package, None)
            with pytest.raises(jointfrf.MissingPackageError) as caught:
                import_extra(package)
        extra = str(caught.value).partition("[")[2].partition("]")[0]
        for bringing in (extras[extra], *([extras["all"]] if package in ALL else [])):
            assert any(each.startswith(package + ">=") for each in bringing)


def test_the_command_line_says_it_in_one_sentence(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "h5py", None)
    path = tmp_path / "bars.h5"
    path.write_bytes(b"\x89HDF\r\n\x1a\n")
    result = run_command("identify", path)
    assert result.returncode == 1
    missing = "HDF5 files (MATLAB 7.3 among them) need the package h5py: pip install 'jointfrf[hdf5]'"
    assert result.stderr == f"jointfrf: error: {missing}\n"
