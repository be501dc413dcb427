"""Time and ratio over n, for every operation; lines differ by grey, dashes and marks."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from .operations import OPERATIONS
from .peers.client import PEER_NAMES
from .results import LOOP, NUMPY, OURS, REFERENCE, Record, Run

_COLUMNS = 4
_TICKS = (1, 2, 4, 8, 16, 32, 64)
#: candidate, threads, streaming, label, style
_CURVES: tuple[tuple[str, int, bool, str, dict[str, Any]], ...] = (
    (NUMPY, 1, False, "numpy", {"color": "#e08a1e", "ls": "-", "marker": "s", "lw": 1.1}),
    (REFERENCE, 1, False, "engine lapack", {"color": "#6b6b6b", "ls": "--", "marker": "^", "lw": 1.1}),
    (LOOP, 1, False, "bare LAPACK loop", {"color": "#6b6b6b", "ls": ":", "marker": "v", "lw": 1.1}),
    (OURS, 1, True, "jointfrf, streaming from memory", {"color": "#1b4f9c", "ls": "-.", "marker": "x", "lw": 1.1}),
    (OURS, 2, False, "jointfrf, 2 threads", {"color": "#1b4f9c", "ls": "--", "marker": "o", "mfc": "white", "lw": 1.1}),
    (OURS, 1, False, "jointfrf", {"color": "#0b2a57", "ls": "-", "marker": "o", "lw": 1.8}),
)
#: Curves of the figure of peers.
_PEER_CURVES: dict[str, tuple[str, dict[str, Any]]] = {
    NUMPY: ("numpy", {"color": "#e08a1e", "ls": "-", "marker": "s"}),
    LOOP: ("loop over OpenBLAS", {"color": "#6b6b6b", "ls": ":", "marker": "v"}),
    "Eigen": ("Eigen, fixed size", {"color": "#2a7f62", "ls": "-", "marker": "D"}),
    "MKL loop": ("loop over MKL", {"color": "#8c4a9e", "ls": "--", "marker": "^", "mfc": "white"}),
    "MKL compact": ("MKL compact", {"color": "#5a1f6b", "ls": "-", "marker": "^"}),
    "torch": ("torch", {"color": "#b5323e", "ls": "-.", "marker": "P"}),
    "JAX": ("JAX", {"color": "#3f78c4", "ls": "--", "marker": "x"}),
}
_FONTS = {"font.size": 8, "axes.titlesize": 9, "legend.fontsize": 8, "axes.grid": True, "grid.alpha": 0.3,
          "grid.linewidth": 0.5, "axes.axisbelow": True, "lines.markersize": 3.5}  # fmt: skip


def draw(run: Run, path: Path) -> None:
    """Draw ns a line with the limit, and below it the ratio to numpy and LAPACK, one column of axes an operation."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    names = list(dict.fromkeys(one.operation for one in run.records))
    columns = min(_COLUMNS, len(names))
    rows = -(-len(names) // columns)
    with matplotlib.rc_context(_FONTS):  # type: ignore[arg-type]
        figure = Figure(figsize=(0.9 + 3.0 * columns, 0.9 + 3.4 * rows), layout="constrained")
        FigureCanvasAgg(figure)
        grid = figure.add_gridspec(2 * rows, columns, height_ratios=[2.2, 1] * rows)
        limits = _ratio_limits(run)
        for i, name in enumerate(names):
            y, x = divmod(i, columns)
            upper = figure.add_subplot(grid[2 * y, x])
            lower = figure.add_subplot(grid[2 * y + 1, x], sharex=upper)
            _draw_operation(run, name, upper, lower, x == 0)
            lower.set_ylim(*limits)
        handles, labels = _legend(figure)
        figure.legend(handles, labels, loc="outside lower center", ncols=min(4, len(labels)), frameon=False)
        kind = "FRFs with noise" if any(one.data == "frf" for one in run.records) else "random matrices"
        figure.suptitle(f"{run.machine['processor']}, {kind}; engine {run.machine['engine']}", fontsize=9)
        figure.savefig(path, dpi=120, metadata={"Software": None})


def draw_peers(run: Run, path: Path) -> bool:
    """Draw how many times longer other libraries take, one axes an operation; return whether there are any."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    names = list(dict.fromkeys(one.operation for one in run.records if one.candidate in PEER_NAMES))
    if not names:
        return False
    columns = min(2, len(names))
    rows = -(-len(names) // columns)
    with matplotlib.rc_context({**_FONTS, "lines.markersize": 5}):  # type: ignore[arg-type]
        figure = Figure(figsize=(0.9 + 4.2 * columns, 1.3 + 3.0 * rows), layout="constrained")
        FigureCanvasAgg(figure)
        grid = figure.subplots(rows, columns, sharey=True, squeeze=False)
        for i, name in enumerate(names):
            ax = grid[i // columns, i % columns]
            _draw_peers_of(run, name, ax)
            if i % columns == 0:
                ax.set_ylabel("times longer than jointfrf")
        for ax in grid.flat[len(names) :]:
            ax.set_axis_off()
        handles, labels = _legend(figure)
        figure.legend(handles, labels, loc="outside lower center", ncols=4, frameon=False)
        figure.suptitle(f"{run.machine['processor']}, one thread; engine {run.machine['engine']}", fontsize=9)
        figure.savefig(path, dpi=120, metadata={"Software": None})
    return True


def _draw_peers_of(run: Run, name: str, ax: Any) -> None:
    from matplotlib.ticker import FixedLocator, NullFormatter

    cases = {one.case for one in run.records if one.operation == name and not one.streaming}
    kinds = {kind for _, kind, _, _ in cases}
    ours = [run.find(case, OURS) for case in sorted(cases) if case[1] == ("frf" if "frf" in kinds else "random")]
    found = [one for one in ours if one is not None]
    for candidate, (label, style) in _PEER_CURVES.items():
        known = [(one.n, ratio) for one in found if (ratio := run.least_ratio(one, candidate)) is not None]
        if known:
            ax.plot(*zip(*known, strict=True), label=label, lw=1.1, **style)
    ax.axhline(1, color="black", lw=1.8, label="jointfrf")
    orders = [one.n for one in found]
    ax.set(xscale="log", yscale="log", title=f"{name} (n: {OPERATIONS[name].counts})", xlabel="n")
    ax.set_xticks([tick for tick in _TICKS if orders[0] <= tick <= orders[-1]] if len(orders) > 1 else orders)
    ax.xaxis.set_major_formatter("{x:.0f}")
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.yaxis.set_major_locator(FixedLocator([0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200]))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_minor_formatter(NullFormatter())


def _ratio_limits(run: Run) -> tuple[float, float]:
    """Return the limits of all axes of ratios: the same, so that operations can be compared."""
    ours = [one for one in run.records if one.candidate == OURS and one.threads == 1 and not one.streaming]
    found = [run.ratio(one, candidate) for one in ours for candidate in (NUMPY, REFERENCE, LOOP)]
    known = [1.0, *(ratio for ratio in found if ratio is not None)]
    return min(known) / 1.4, max(known) * 1.4


def _legend(figure: Any) -> tuple[list[Any], list[str]]:
    found: dict[str, Any] = {}
    for ax in figure.axes:
        for handle, label in zip(*ax.get_legend_handles_labels(), strict=True):
            found.setdefault(label, handle)
    order = [label for *_, label, _ in reversed(_CURVES)]
    labels = [label for label in order if label in found] + [label for label in found if label not in order]
    return [found[label] for label in labels], labels


def _draw_operation(run: Run, name: str, upper: Any, lower: Any, outermost: bool) -> None:
    from matplotlib.ticker import LogFormatterSciNotation, NullFormatter

    kinds = {one.data for one in run.records if one.operation == name}
    kind = "frf" if "frf" in kinds else "random"

    def points(candidate: str, threads: int, streaming: bool) -> list[Record]:
        return sorted(
            (one for one in run.records
             if (one.operation, one.data, one.streaming) == (name, kind, streaming)
             and (one.candidate, one.threads) == (candidate, threads)),
            key=lambda one: one.n,
        )  # fmt: skip

    ours = points(OURS, 1, False)
    orders = [one.n for one in ours]
    for candidate, threads, streaming, label, style in _CURVES:
        some = points(candidate, threads, streaming)
        if some:
            upper.plot([one.n for one in some], [one.median for one in some], label=label, **style)
    upper.plot(orders, [one.limit for one in ours], color="black", lw=0.9, label="limit of the machine, 1 thread")
    bottom = min(one.limit for one in ours) / 2
    upper.fill_between(orders, bottom, [one.limit for one in ours], color="#d9d9d9", lw=0, zorder=0)
    upper.set(xscale="log", yscale="log", title=name.replace("_", " "))
    upper.set_ylim(bottom=bottom)
    _draw_ratios(run, ours, lower)
    lower.set(xlabel="n")
    for ax in (upper, lower):
        ax.set_xticks([tick for tick in _TICKS if orders[0] <= tick <= orders[-1]] if len(orders) > 1 else orders)
        ax.xaxis.set_major_formatter("{x:.0f}")
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.tick_params(axis="x", which="minor", bottom=False)
    upper.yaxis.set_major_formatter(LogFormatterSciNotation())
    upper.tick_params(labelbottom=False)
    if outermost:
        upper.set_ylabel("ns a line")
        lower.set_ylabel("times longer\nthan jointfrf")


def _draw_ratios(run: Run, ours: list[Record], ax: Any) -> None:
    """Draw how many times longer the others take on one thread."""
    from matplotlib.ticker import FixedLocator, NullFormatter

    ax.set(xscale="log", yscale="log")
    for candidate, threads, streaming, _, style in _CURVES:
        if candidate == OURS or streaming or threads != 1:
            continue
        some = [(one.n, run.ratio(one, candidate)) for one in ours]
        known = [(n, ratio) for n, ratio in some if ratio is not None]
        if known:
            ax.plot(*zip(*known, strict=True), **style)
    ax.axhline(1, color="black", lw=0.9)
    ax.yaxis.set_major_locator(FixedLocator([0.1, 0.3, 1, 3, 10, 30, 100, 300]))
    ax.yaxis.set_major_formatter("{x:g}")
    ax.yaxis.set_minor_formatter(NullFormatter())
