"""`jointfrf study`: realisations of a case over a design of factors; `jointfrf study merge`: parts put together."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from jointfrf.extras import check_extras, import_extra
from jointfrf.files import OwnFolder
from jointfrf.parallel.pool import AnyExecutor, available_cores, check_processes, safe_environment
from jointfrf.workbench.cases.catalogue import UnknownCaseError
from jointfrf.workbench.cli.arguments.study import ComputingArguments, StudyArguments
from jointfrf.workbench.cli.progress import waiting
from jointfrf.workbench.cli.usage import Output, UsageError, listed, warn_of_ignored
from jointfrf.workbench.studies.design import StudyDesign, parse_factor
from jointfrf.workbench.studies.result import StudyResult
from jointfrf.workbench.studies.run import merge_studies, study

__all__ = ["run"]


def run(options: StudyArguments) -> int:
    """Carry out the command."""
    check_extras("matplotlib", "jinja2", *(["pyarrow"] if "parquet" in options.values else []))
    out = Output(options)
    is_merge = options.words[0] == "merge"
    is_part = not is_merge and (options.first is not None or options.count is not None)
    found = _merged(options) if is_merge else _studied(options, is_part)
    if is_part:
        own = _range(options)
        out.say(
            f"{found.folder}: realisations {own.start} to {own.stop - 1} (jointfrf study merge puts parts together)"
        )
        out.give({"folder": str(found.folder), "missing": found.missing})
        return 0
    page = found.report()
    files = {kind: found.save_values(kind) for kind in options.values}
    out.say(found, "", *(f"{kind}: {path}" for kind, path in files.items()), f"report: {page}")
    written = {str(kind): str(path) for kind, path in files.items()}
    out.give({**found.to_dict(), "folder": str(found.folder), "report": str(page), **written})
    return 0


def _merged(options: StudyArguments) -> StudyResult:
    if len(options.words) < 2 or options.out is None:
        raise UsageError("folders of parts or --out are missing; use jointfrf study merge PART... --out DIR")
    warn_of_ignored(options, ComputingArguments.names(), "merge computes nothing")
    return merge_studies(options.words[1:], options.out)


def _studied(options: StudyArguments, is_part: bool) -> StudyResult:
    if len(options.words) > 1:
        raise UsageError(f"several cases are given, {listed(options.words)}; name one")
    (case,) = options.words
    factors = _factors(options.factor)
    try:
        is_stated = factors or options.noise or options.estimator
        design = StudyDesign(factors, options.arrangement, options.noise, options.estimator) if is_stated else None
        name = Path(case).resolve().name if (Path(case) / "case.toml").is_file() else case
        with _started(options.executor, options.jobs) as executor, waiting(name) as count:
            return study(
                case,
                options.out or _usual_folder(name),
                options.realisations,
                design=design,
                part=_range(options) if is_part else None,
                executor=executor,
                jobs=options.jobs,
                progress=count,
            )
    except UnknownCaseError as error:
        raise UsageError(error) from error


def _usual_folder(name: str) -> Path:
    """Return the folder of a study that no option names, which must be no link: nobody has named what it leads to."""
    folder = OwnFolder(Path("studies")) / name
    folder.check()
    return folder.path


def _factors(words: list[str]) -> dict[str, Any]:
    factors = {}
    for word in words:
        try:
            name, values = parse_factor(word)
        except ValueError as error:
            raise UsageError(f"--factor: {error}") from error
        if name in factors:
            raise UsageError(f"--factor: {name} is given twice; give it once")
        factors[name] = values
    return factors


def _range(options: StudyArguments) -> range:
    if options.first is None or options.count is None:
        raise UsageError("only one of --first and --count is given; give both")
    return range(options.first, options.first + options.count)


@contextmanager
def _started(word: str, jobs: int | None) -> Iterator[AnyExecutor | None]:
    """Start the executor that a word names."""
    if word == "threads":
        from concurrent.futures import ThreadPoolExecutor

        with ThreadPoolExecutor(jobs or available_cores()) as pool:
            yield pool
    elif word == "loky":
        loky = import_extra("loky")
        check_processes()
        with safe_environment():  # it starts processes whenever one is missing
            yield lambda: loky.get_reusable_executor(max_workers=jobs or available_cores())
    elif word == "mpi":
        futures, rank = import_extra("mpi4py.futures"), import_extra("mpi4py.MPI").COMM_WORLD.Get_rank()
        if rank:
            raise UsageError(
                "--executor mpi needs a launcher; start mpiexec -n N python -m mpi4py.futures -m jointfrf study ..."
            )
        with futures.MPIPoolExecutor() as pool:
            yield pool
    else:
        yield None
