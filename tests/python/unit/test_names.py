"""A name means one thing: a class is defined once in the package, and so is a public function or constant."""

import ast
from collections import defaultdict
from pathlib import Path

import jointfrf
import jointfrf.io

PACKAGE = Path(jointfrf.__file__).parent


def public_names():
    """Names that users import."""
    return {*jointfrf.__all__, *jointfrf.io.__all__}


def definitions():
    """Name to the modules that define it: all classes; functions and constants that users import."""
    found, public = defaultdict(set), public_names()
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            names = []
            if isinstance(node, ast.ClassDef):
                names = [node.name]
            elif isinstance(node, ast.FunctionDef):
                names = [node.name] if node.name in public else []
            elif isinstance(node, ast.Assign | ast.AnnAssign):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                names = [t.id for t in targets if isinstance(t, ast.Name) and t.id in public]
            for name in names:
                found[name].add(path.relative_to(PACKAGE).as_posix())
    return found


def test_a_name_stands_once():
    found = definitions()
    assert len(found) > 250
    twice = {name: sorted(modules) for name, modules in found.items() if len(modules) > 1}
    assert twice == {}
