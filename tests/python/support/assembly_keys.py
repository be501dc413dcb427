"""The page of the keys of `assembly.toml`, of joints and of tables of channels, from their declaration.

python tests/python/support/assembly_keys.py docs/assembly-keys.md    writes it
"""

from __future__ import annotations

import sys
from pathlib import Path

from jointfrf.io.channel_table import ChannelTableKeys
from jointfrf.laws.joint_toml import ConstantsKeys, LawJointKeys
from jointfrf.toml.documents import key_reference
from jointfrf.workbench.assembly_file.keys import AlikeKeys, AssemblyKeys, PartsKeys, PlacedJointKeys

HEAD = """# Keys of assembly.toml, joint.toml and tables of channels

<!-- python tests/python/support/assembly_keys.py docs/assembly-keys.md -->

[Fits with models](model-fit.md) use these files. SI units. Files that a key names are relative to the folder. A key
that is not in this list causes an error that lists the valid keys.

"""


TOPS = {
    "assembly.toml": AssemblyKeys, "assembly.toml of several parts": PartsKeys, "[joints.NAME]": PlacedJointKeys,
    "[alike.NAME]": AlikeKeys, "joint.toml of constants": ConstantsKeys, "joint.toml of laws": LawJointKeys,
    "Tables of channels": ChannelTableKeys,
}  # fmt: skip


def assembly_page() -> str:
    """Return the page."""
    return HEAD + key_reference(TOPS)


if __name__ == "__main__":
    Path(sys.argv[1]).write_text(assembly_page(), encoding="utf-8")
