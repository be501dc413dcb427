"""Arguments of `jointfrf run`."""

from pathlib import Path

from jointfrf.workbench.cli.arguments.declaration import Arguments, flag, option, positional
from jointfrf.workbench.cli.arguments.words import Count, NewFolder

__all__ = ["RunArguments", "RunOneArguments"]


class RunOneArguments(Arguments):
    """Keywords of `jointfrf.workbench.cases.catalogue.run_case`."""

    realisations: Count | None = option("number of realisations", otherwise="the number in the case")
    at_most: Count | None = option("largest number of realisations of a case")
    png: bool = flag("write figures as PNG files, too")


class RunArguments(RunOneArguments):
    """Arguments of the command."""

    description = "Run cases by name, number or folder; without any, all cases that come with jointfrf."
    examples = ("jointfrf run 3.1 --realisations 20 --out results",)

    cases: list[str] = positional("name, number, or folder with a case.toml", "CASE", optional=True)
    out: NewFolder = option("folder for the results", default=Path("results"))
    jobs: Count | None = option("number of processes", otherwise="all cores")
