"""Arguments of the laws of a joint."""

from __future__ import annotations

import argparse
from pathlib import Path

from jointfrf.laws.words import LAW_WORDS
from jointfrf.spelling import did_you_mean
from jointfrf.workbench.cli.parser import CommandParser

__all__ = ["add_law_arguments"]


def _law(text: str) -> tuple[str, str]:
    dof, equals, word = text.partition("=")
    if not (dof.strip() and equals):
        raise argparse.ArgumentTypeError(f"{text!r} is no DOF with a law; use the form y=standard-linear-solid")
    word = word.strip()
    if word not in LAW_WORDS:
        hint = did_you_mean(word, LAW_WORDS)
        raise argparse.ArgumentTypeError(f"unknown law {word!r}; use one of {', '.join(LAW_WORDS)}{hint}")
    return dof.strip(), word


def add_law_arguments(parser: CommandParser) -> None:
    """Describe the options for the laws of the joint."""
    parser.option(
        "--law DOF=LAW",
        f"law of a joint DOF, once for each DOF: y=standard-linear-solid, theta=rigid; one of {', '.join(LAW_WORDS)}; "
        "a spring takes the damping of --damping (auto: viscous)",
        _law,
        repeated=True,
    )
    parser.option("--joint FILE", "TOML file of a joint of laws, with initial values", Path)
