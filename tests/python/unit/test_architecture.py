"""Which package may import which, the core without the workbench, and one way into the compiled kernel."""

import ast
import re
from functools import cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

import jointfrf
from jointfrf.choices import CASE_KINDS
from packages import package_of

PACKAGE = Path(jointfrf.__file__).parent

#: From the ground up: a package imports only packages of lower floors, none of its own floor.
FLOORS = (
    {"spelling", "choices"},
    {"errors", "directions"},
    {"files"},
    {"extras", "kernel", "messages", "toml"},
    {"dofs", "parallel"},
    {"frf"},
    {"channels", "io"},
    {"joint"},
    {"laws"},
    {"substructuring", "models"},
    {"identification"},
    {"workbench.fe", "workbench.solids", "workbench.pooling", "workbench.planning", "workbench.amplitude"},
    {"workbench.structures", "workbench.report"},
    {"workbench.cases", "workbench.assembly_file"},
    {"workbench.studies"},
    {"workbench.cli"},
    {"__main__"},
)
FLOOR = {package: floor for floor, packages in enumerate(FLOORS) for package in packages}


@cache
def imported_modules(file: Path) -> set[str]:
    """Modules of the package that a file imports, anywhere in it."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{file}: a relative import"
            if node.module == "jointfrf":
                found |= {f"jointfrf.{alias.name}" for alias in node.names}
            elif node.module and node.module.startswith("jointfrf."):
                found.add(node.module)
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names if alias.name.startswith("jointfrf.")}
    return found


def module_name(file: Path) -> str:
    parts = file.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def files() -> dict[Path, str]:
    """Every file of jointfrf except its front door, and the package that it lies in."""
    found = {}
    for file in PACKAGE.rglob("*.py"):
        if file.relative_to(PACKAGE).as_posix() not in ("__init__.py", "workbench/__init__.py"):
            found[file] = package_of(module_name(file))
    return found


def test_every_package_has_its_floor():
    assert set(files().values()) == set(FLOOR)


def test_a_package_imports_only_packages_below_it():
    wrong = [
        f"{file.relative_to(PACKAGE)} imports {module}"
        for file, package in files().items()
        for module in imported_modules(file) - {"jointfrf._kernel"}
        if package_of(module) != package and FLOOR[package_of(module)] >= FLOOR[package]
    ]
    assert not wrong


def test_the_core_does_not_import_the_workbench():
    of_core = {file: package for file, package in files().items() if not package.startswith(("workbench", "__main__"))}
    assert len(of_core) > 100
    assert not [file for file in of_core if any(one.startswith("jointfrf.workbench") for one in imported_modules(file))]


def test_only_a_kind_of_case_imports_its_own_modules():
    kinds = [f"jointfrf.workbench.cases.{name.replace('-', '_')}" for name in CASE_KINDS]
    others = [f"{module_name(file)} imports {module}" for file in files() for module in imported_modules(file)
              for kind in kinds if module.startswith(kind) and not module_name(file).startswith(kind)]  # fmt: skip
    # `jointfrf plan` takes the exact FRFs of a case.
    assert {one.split()[0] for one in others} <= {"jointfrf.workbench.cli.plan"}
    assert not [one for one in others if "bolted_lap" in one]


def test_no_modules_import_each_other_in_a_circle():
    graph = {module_name(file): imported_modules(file) for file in files()}
    assert len(list(TopologicalSorter(graph).static_order())) >= len(graph)
    with pytest.raises(CycleError):
        TopologicalSorter(graph | {"jointfrf.errors": {"jointfrf.files"}}).prepare()


def test_a_list_of_modules_names_what_a_package_has():
    listed = 0
    for front in PACKAGE.rglob("__init__.py"):
        named = set(re.findall(r"^(\w+)/? {2,}\S", ast.get_docstring(ast.parse(front.read_text("utf-8"))) or "", re.M))
        there = {one.stem for one in front.parent.iterdir() if one.suffix == ".py" or any(one.glob("*.py"))}
        there -= {"__init__", "__pycache__"}
        assert not named or named == there, front
        listed += len(named)
    assert listed > 60


def test_compiled_modules_of_a_checkout_are_not_installed():
    build = PACKAGE.parent / "meson.build"
    if not build.exists():
        pytest.skip("the package is installed, not in a checkout")
    (listed,) = re.findall(r"foreach package : \[(.*?)\]", build.read_text("utf-8"), re.S)
    packages = {front.parent.relative_to(PACKAGE).as_posix() for front in PACKAGE.rglob("__init__.py")} - {"."}
    assert set(re.findall(r"'([^']+)'", listed)) == packages


def test_only_the_package_kernel_imports_the_compiled_kernel():
    importers = {package for file, package in files().items() if "jointfrf._kernel" in imported_modules(file)}
    assert importers == {"kernel"}


def test_no_public_function_hides_a_module():
    modules = {file.relative_to(PACKAGE).parts[0].removesuffix(".py") for file in PACKAGE.rglob("*.py")}
    assert not modules & set(jointfrf.__all__)
