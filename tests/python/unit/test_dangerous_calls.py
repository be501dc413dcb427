"""Every place of the package that starts a process, reads pickles, opens a socket or runs a text is known, with why."""

import ast
from functools import cache
from pathlib import Path

import jointfrf

PACKAGE = Path(jointfrf.__file__).parent

#: Modules that start processes, read pickles, connect to other machines, run texts, or call libraries by address.
MODULES = {
    "asyncio", "code", "codeop", "concurrent.futures", "ctypes", "cffi", "dbm", "dill", "cloudpickle", "distributed",
    "ftplib", "http", "imaplib", "joblib", "loky", "marshal", "mpi4py", "multiprocessing", "pickle", "poplib", "pty",
    "requests", "runpy", "shelve", "smtplib", "socket", "socketserver", "ssl", "subprocess", "telnetlib", "urllib",
    "webbrowser", "xmlrpc", "yaml",
}  # fmt: skip
#: Functions by their last name: what runs a text, reads a pickle, or loads what a text names.
NAMES = {
    "eval", "exec", "compile", "__import__", "import_module", "import_extra", "popen", "Popen", "fork", "forkpty",
    "startfile", "posix_spawn", "posix_spawnp", "spawnv", "spawnl", "execv", "execve", "execl", "execvp", "load_module",
    "exec_module", "read_pickle", "load_source", "genfromtxt", "loadtxt", "loadmat", "fromfile", "memmap", "load",
    "loads", "load_npz", "literal_eval", "CDLL", "load_library", "ProcessPoolExecutor", "ThreadPoolExecutor",
    "SpawnContext", "get_context", "Client", "get_reusable_executor", "MPIPoolExecutor", "Template", "from_string",
    "interpolate", "os.system", "os.spawn",
}  # fmt: skip
#: The same names of what reads or makes data only.
HARMLESS = {"re.compile", "json.loads", "json.load", "tomllib.loads", "load"}
#: Shown with an argument that forbids pickles.
SAFE = ("allow_pickle", False)

#: File and what stands there, with why that does no harm.
KNOWN = {
    ("__init__.py", "import_module"): "modules of the package by names that stand in it",
    ("extras.py", "import_module"): "packages out of a list, by their names",
    ("extras.py", "load"): "what installed packages declare as formats and laws",
    ("workbench/cli/parser.py", "import_module"): "subcommands out of a list",
    ("workbench/cli/main.py", "import_module"): "subcommands out of the same list, which `_run` checks first",
    ("laws/joint_toml.py", "import_module"): "modules of laws out of a table of the package",
    ("workbench/cases/catalogue.py", "import_module"): "kinds of cases out of a list",
    ("workbench/cli/completion.py", "import_extra"): "shtab",
    ("workbench/cli/study.py", "import_extra"): "executors that the command line names",
    ("io/formats.py", "import_module"): "modules of formats out of a list",
    ("io/hdf5_file.py", "import_extra"): "h5py",
    ("io/xlsx_file.py", "import_extra"): "openpyxl, after parts and entities of the file are checked",
    ("workbench/fe/ansys.py", "import_extra"): "ansys-mapdl-reader, which reads numbers of a binary file",
    ("workbench/fe/abaqus.py", "loadtxt"): "numpy: numbers of a text file",
    ("workbench/fe/market.py", "loadtxt"): "numpy: numbers of a text file",
    ("workbench/fe/nastran.py", "import_extra"): "pyYeti, which reads numbers of a file",
    ("workbench/fe/nastran.py", "load"): "pyYeti: numbers of a file",
    ("workbench/fe/npz.py", "load_npz"): "scipy: of a file whose arrays have been read without pickles before",
    ("models/factors.py", "import_extra"): "solvers: pypardiso, mumps; orders: pymetis",
    (
        "parallel/line_arrays.py",
        "import_extra",
    ): "h5py: arrays that a caller has opened, opened again by a worker",
    ("parallel/line_arrays.py", "memmap"): "numbers of a file that a caller has mapped, mapped again by a worker",
    ("workbench/studies/result.py", "import_extra"): "pyarrow, which writes",
    ("workbench/cli/study.py", "get_reusable_executor"): "processes of this machine, started in a safe environment",
    ("workbench/cli/study.py", "MPIPoolExecutor"): "processes that mpiexec has started",
    ("workbench/cli/study.py", "concurrent.futures"): "threads",
    ("workbench/cli/study.py", "ThreadPoolExecutor"): "threads",
    ("workbench/cases/workers.py", "concurrent.futures"): "the type of futures, and errors of processes",
    ("workbench/cli/run.py", "concurrent.futures"): "threads, one for each case under way",
    ("workbench/cli/run.py", "ThreadPoolExecutor"): "threads, one for each case under way",
    ("parallel/pool.py", "concurrent.futures"): "what executors are and raise; processes of this machine",
    ("parallel/pool.py", "multiprocessing"): "processes of this machine, started in a safe environment",
    ("parallel/pool.py", "SpawnContext"): "the only start of processes, of this Python only",
    ("workbench/report/document.py", "urllib"): "quotes characters of a drawing",
}


def found_in(tree: ast.AST) -> set[str]:
    """Return what a file imports and calls out of the lists above."""
    found: set[str] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            named = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            named = [f"{node.module}.{alias.name}" for alias in node.names]
        elif isinstance(node, ast.Call):
            whole = ast.unparse(node.func)
            is_safe = any((word.arg, getattr(word.value, "value", None)) == SAFE for word in node.keywords)
            if not is_safe and whole not in HARMLESS:
                found |= {whole, whole.rpartition(".")[2]} & NAMES
            continue
        else:
            continue
        found |= {module for module in MODULES for name in named if f"{name}.".startswith(f"{module}.")}
        found |= {name for name in named if name in NAMES}
    return found


@cache
def places() -> set[tuple[str, str]]:
    return {
        (file.relative_to(PACKAGE).as_posix(), what)
        for file in PACKAGE.rglob("*.py")
        for what in found_in(ast.parse(file.read_text(encoding="utf-8")))
    }


def test_every_dangerous_place_is_known():
    assert places() - set(KNOWN) == set()


def test_what_is_known_is_there():
    assert set(KNOWN) - places() == set()


def test_the_scan_sees_what_it_looks_for():
    lines = ["import subprocess as s", "from os import system", "import numpy as np", "os.system('x')", "eval('1')",
             "np.load(f)", "np.load(f, allow_pickle=False)", "from multiprocessing import Pool"]  # fmt: skip
    assert [sorted(found_in(ast.parse(line))) for line in lines] == [
        ["subprocess"], ["os.system"], [], ["os.system"], ["eval"], ["load"], [], ["multiprocessing"]
    ]  # fmt: skip
