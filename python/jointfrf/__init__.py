"""Stiffness and damping of joints from frequency response functions.

Time convention exp(+i w t). Arrays over frequency have shape (n_freq, out, in), complex128, C order. SI units.
"""

from functools import cache
from importlib import import_module
from pathlib import Path

#: Packages that are attributes, as in ``jointfrf.io.read_uff``, and their modules.
_PACKAGES = {"io": "jointfrf.io", "report": "jointfrf.workbench.report", "solids": "jointfrf.workbench.solids"}


@cache
def _places() -> dict[str, str]:
    """Return public names and their modules, from the imports of ``__init__.pyi``, which type checkers also read."""
    import ast

    stub = Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")
    imports = [node for node in ast.parse(stub).body if isinstance(node, ast.ImportFrom)]
    return {one.name: node.module for node in imports if node.module for one in node.names if one.name not in _PACKAGES}


def __getattr__(name: str) -> object:
    """Import a public name on first use, because importing scipy is slow."""
    if name in _PACKAGES:
        return import_module(_PACKAGES[name])
    if name == "__version__":
        value: object = import_module("jointfrf.kernel.call").VERSION
    elif name == "__all__":
        value = sorted(_places())
    elif name in _places():
        value = getattr(import_module(_places()[name]), name)
    else:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}", name=name, obj=None)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_PACKAGES, *_places(), "__all__", "__version__"})
