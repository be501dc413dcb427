"""Arguments of `jointfrf decouple`."""

import argparse
from pathlib import Path
from typing import Annotated, Any, Literal

from jointfrf.workbench.cli.arguments.declaration import Form, option, positional
from jointfrf.workbench.cli.arguments.structures import PairArguments
from jointfrf.workbench.cli.arguments.words import Band, Dofs, NewFile, NodeList, words

__all__ = ["DecoupleArguments"]


def _channels(text: str) -> list[Any]:
    from jointfrf.io import Channel  # only if a channel is named

    try:
        return [Channel.parse(word) for word in words(text)]
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


_Channels = Annotated[list[Any], Form("CHANNELS", _channels)]


class DecoupleArguments(PairArguments):
    """Arguments of the command."""

    description = (
        "Identify a joint by FRF decoupling, (2.53) to (2.56), from FRFs of the assembly at internal points r of A and "
        "s of B and from both substructures (files of FRFs, or TOML files of models). The result is exact without "
        "noise and very sensitive to noise; jointfrf identify, with FRFs at the joint, is far less sensitive."
    )
    ways = (("--j", "--k", "--dofs", "--s"), ("--j", "--k", "--dofs", "--r", "--equation"))
    examples = (
        "jointfrf decouple cases/two-beams/a.toml cases/two-beams/b.toml assembly.uff --j 11 --k 1 --dofs y,rz "
        "--s 11:y,11:rz --renumber-b 100 --band 100:300",
    )

    assembly: Path = positional("file of FRFs of the assembly", "ASSEMBLY")
    equation: Literal["rr", "rs", "sr", "ss"] = option(
        "responding and excited point: (2.53) rr, (2.54) rs, (2.55) sr, (2.56) ss", default="ss"
    )
    j: NodeList = option("node of A at the joint", "NODE")
    k: NodeList = option("node of B at the joint", "NODE")
    dofs: Dofs = option("joint DOFs, at both nodes: y,rz")
    r: _Channels | None = option("internal channels of A, one for each joint DOF: 7:y,7:rz")
    s: _Channels | None = option("internal channels of B, one for each joint DOF")
    renumber_b: int = option("number added to the nodes of B, --k and --s, as by jointfrf couple", "N", 0)
    band: list[Band] | None = option("sensitive band in Hz; may be repeated")
    save: NewFile | None = option("JSON file for the joint")
    output: NewFile | None = option("CSV file for K* of each line")
