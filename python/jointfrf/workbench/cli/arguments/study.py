"""Arguments of `jointfrf study`."""

from functools import partial
from typing import Annotated, Literal

from jointfrf.choices import Arrangement
from jointfrf.workbench.cli.arguments.declaration import Arguments, Form, option, positional
from jointfrf.workbench.cli.arguments.words import Count, NewFolder, whole

__all__ = ["ComputingArguments", "StudyArguments"]

_Whole = Annotated[int, Form("N", partial(whole, least=0))]


class ComputingArguments(Arguments):
    """Options of the computation; merging uses none of them."""

    realisations: _Whole | None = option("number of realisations", otherwise="the number in the case")
    factor: list[str] = option(
        "values of noise, spacing, lines, stiffness, damping, or of a key of case.toml such as frequency.last or "
        "joint.stiffness; a * before = multiplies; may be repeated",
        "NAME=V,V,...",
        [],
    )
    arrangement: Arrangement = option(
        "full: every combination of values; one-at-a-time: one factor at a time", default="full"
    )
    estimator: list[str] = option(
        "method of identification; may be repeated", "WORD", [], otherwise="the methods in the case"
    )
    noise: list[str] = option("noise of the case; may be repeated", "NAME", [], otherwise="all in the case")
    first: _Whole | None = option("first realisation of a part of the study; needs --count")
    count: Count | None = option("number of realisations of a part; needs --first")
    jobs: Count | None = option("number of workers", otherwise="all cores")
    executor: Literal["processes", "threads", "loky", "mpi"] = option("kind of workers", default="processes")


class StudyArguments(ComputingArguments):
    """Arguments of the command."""

    description = (
        "Estimate the joint of a case from many realisations of the noise, over a design of factors. Finished "
        "realisations are kept in the folder: the same command continues an interrupted study. `jointfrf study merge "
        "PART... --out DIR` merges parts."
    )
    usage = "jointfrf study CASE [options]\n       jointfrf study merge PART [PART ...] --out DIR [options]"
    examples = ("jointfrf study 3.1 --realisations 20 --factor noise=0.01,0.03 --out study",)

    words: list[str] = positional(
        "name, number, or folder with a case.toml; or merge and the folders of parts", "CASE | merge PART..."
    )
    out: NewFolder | None = option("folder for the results", otherwise="studies/NAME of the case")
    values: list[Literal["parquet", "npz"]] = option("file of single realisations; may be repeated", default=[])
