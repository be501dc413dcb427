"""The page of the keys of `assembly.toml`, from their declaration.

python tests/python/support/assembly_keys.py docs/assembly-keys.md    writes it
"""

from __future__ import annotations

import sys
from pathlib import Path

from jointfrf.assembly_file.keys import AssemblyKeys
from jointfrf.toml.documents import key_reference

HEAD = """# Keys of assembly.toml

<!-- python tests/python/support/assembly_keys.py docs/assembly-keys.md -->

[Fits with models](model-fit.md) say what it is for. SI units. Files that a key names stand relative to the folder.
A key that is not in this list is an error that lists those that are.

"""


def assembly_page() -> str:
    """Return the page."""
    return HEAD + key_reference({"assembly.toml": AssemblyKeys})


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(assembly_page(), encoding="utf-8")
