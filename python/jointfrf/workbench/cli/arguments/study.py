"""Arguments of `jointfrf study`."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import get_args

from jointfrf.choices import Arrangement
from jointfrf.workbench.cli.parser import CommandParser
from jointfrf.workbench.cli.usage import positive

__all__ = ["add_arguments"]

#: What --executor takes.
_EXECUTORS = ("processes", "threads", "loky", "mpi")


def add_arguments(parser: CommandParser) -> None:
    """Describe the arguments of the command."""
    parser.description = (
        "Estimate the joint of a case from many realisations of the noise, over a design of factors. Finished "
        "realisations are kept in the folder: the same command continues an interrupted study. `jointfrf study merge "
        "PART... --out DIR` merges parts."
    )
    parser.usage = "jointfrf study CASE [options]\n       jointfrf study merge PART [PART ...] --out DIR [options]"
    parser.examples.append("jointfrf study 3.1 --realisations 20 --factor noise=0.01,0.03 --out study")
    parser.add_argument(
        "words",
        nargs="+",
        metavar="CASE | merge PART...",
        help="name, number, or folder with a case.toml; or merge and the folders of parts",
    )
    parser.option("--realisations N", "number of realisations", _whole, otherwise="the number in the case")
    parser.option(
        "--factor NAME=V,V,...",
        "values of noise, spacing, lines, stiffness, damping, or of a key of case.toml such as frequency.last or "
        "joint.stiffness; a * before = multiplies; may be repeated",
        default=[],
        repeated=True,
    )
    every = "full: every combination of values; one-at-a-time: one factor at a time"
    parser.option("--arrangement", every, get_args(Arrangement), "full")
    parser.option(
        "--estimator WORD", "method of identification; may be repeated", default=[], repeated=True,
        otherwise="the methods in the case",
    )  # fmt: skip
    parser.option(
        "--noise NAME", "noise of the case; may be repeated", default=[], repeated=True, otherwise="all in the case"
    )
    parser.option("--first N", "first realisation of a part of the study; needs --count", _whole)
    parser.option("--count N", "number of realisations of a part; needs --first", positive)
    parser.option("--jobs N", "number of workers", positive, otherwise="all cores")
    parser.option("--executor WORD", f"kind of workers: {', '.join(_EXECUTORS)}", _executor, "processes")
    parser.option("--out DIR", "folder for the results", Path, otherwise="studies/NAME of the case")
    parser.option(
        "--values FORMAT", "file of single realisations: parquet or npz; may be repeated", _format, [], repeated=True
    )


def _whole(word: str) -> int:
    return positive(word, 0)


def _executor(word: str) -> str:
    if word not in _EXECUTORS:
        raise argparse.ArgumentTypeError(f"unknown executor {word!r}; use one of {', '.join(_EXECUTORS)}")
    return word


def _format(word: str) -> str:
    if word not in ("parquet", "npz"):
        raise argparse.ArgumentTypeError(f"unknown format {word!r}; use parquet or npz")
    return word
