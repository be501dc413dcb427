"""Files of fits: saved joints, cards, pages, figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from jointfrf.files import write_file
from jointfrf.identification.record import fit_to_dict, write_record
from jointfrf.identification.result import Fit
from jointfrf.workbench.cli.arguments.identify import IdentifyArguments
from jointfrf.workbench.cli.export import CardRequest, page_nodes
from jointfrf.workbench.cli.usage import Output
from jointfrf.workbench.report.fit_page import write_report
from jointfrf.workbench.report.sketch import SketchedPart

__all__ = ["write_results"]


def write_results(
    args: IdentifyArguments, fits: Sequence[Fit], out: Output, request: CardRequest | None, places: Sequence[str],
    *, record: Mapping[str, Any] | None = None, figures: Sequence[Any] = (), parts: Sequence[SketchedPart] = (),
) -> str | None:  # fmt: skip
    """Write the files that the options name; return the cards of the joint, and print them if no option names a file.

    Parameters
    ----------
    args : IdentifyArguments
    fits : sequence of Fit
        One for each method that is finished.
    out : Output
    request : CardRequest or None
    places : sequence of str
        Positions of the nodes of the joint, for the cards.
    record : mapping, optional
        More content of the saved joint.
    figures : sequence
        More figures for the folder.
    parts : sequence of SketchedPart
        Sketches of the parts for the page.
    """
    if args.save is not None:
        about = {"source": args.source, **(record or {})}
        write_record(args.save, fit_to_dict(fits[0], lines=args.save_lines) | about)
        out.written.append(args.save)
    text = None if request is None else request.cards(fits[0], [f"from {args.source}", *places])
    if text is not None and args.output is None:
        out.say("", text.rstrip("\n"))
    elif text is not None and args.output is not None:
        write_file(args.output, text)
        out.written.append(args.output)
    fit = dict(zip(args.method, fits, strict=False)).get("compliance")
    if args.report is not None and fit is not None:
        args.report.parent.mkdir(parents=True, exist_ok=True)
        page = write_report(
            fit, args.report, source=args.source, command=args.typed, nodes=page_nodes(args), parts=parts
        )
        out.written.append(page)
    if args.out is not None:
        from jointfrf.workbench.report.fit import write_fit

        out.written += write_fit(fits, args.out, args.source, figures)
    return text
