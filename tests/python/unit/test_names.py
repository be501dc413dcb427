"""A name means one thing: classes, choices of words, public functions and constants stand once in the package."""

import ast
from collections import defaultdict
from pathlib import Path

import jointfrf

PACKAGE = Path(jointfrf.__file__).parent


def definitions():
    """Name to the modules that define it; private functions and constants do not count.

    Nor do functions of the command line, where each subcommand has the same ones.
    """
    found = defaultdict(set)
    for path in sorted(PACKAGE.rglob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            names = []
            if isinstance(node, ast.ClassDef):
                names = [node.name]
            elif isinstance(node, ast.FunctionDef):
                names = [] if node.name.startswith("_") or path.parent.name == "cli" else [node.name]
            elif isinstance(node, ast.Assign | ast.AnnAssign):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                names = [t.id for t in targets if isinstance(t, ast.Name) and not t.id.startswith("_")]
            for name in names:
                found[name].add(path.relative_to(PACKAGE).as_posix())
    return found


def test_a_name_stands_once():
    found = definitions()
    assert len(found) > 150
    twice = {name: sorted(modules) for name, modules in found.items() if len(modules) > 1}
    assert twice == {}
