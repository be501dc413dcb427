"""Flexible sides: coverage and width of intervals of joints between simulated bodies, without and with models of them.

Blocks, plates, laps, beams and brackets have six-DOF joints, from soft to 20 times stiffer than the sides, channels
near and far, bands to twice the first elastic mode, and 1 % noise. Wrong models have normal errors with the standard
deviations that fits assume: E of each side 3 %, or E 3 % and density 2 %, or every eigenvalue 3 %.

run sides [FIRST LAST]: members of the family, 0 to 209 by default; each is a line of JSON in sides.jsonl of the folder
for temporary files, from which tables are printed. Those up to 104 gave the quantiles of the rule without models, the
others did not. Each member is fitted without models, and with models that are wrong in one of three ways. Member i has
the seed i, its models [i, 1]. A pair counts for the kinds of both bodies. Kinds of pairs and wrong models change in
step, so that no lap has a wrong E and no beam a wrong density. Processor time: about 3 s a member; members 24, 26 and
192, with blocks, take 5 to 17 s a fit, nine tenths of it for smoothing.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
import warnings
from pathlib import Path
from unittest import mock

import numpy as np
from bodies import Body, Pair, pair

import jointfrf as jf
from jointfrf.dofs import DIRECTIONS
from jointfrf.identification import identify

#: The first member that gave no quantiles.
FRESH = 105
MEMBERS = 210
#: What is wrong in the models, each side by itself.
WRONG = ("E", "E and density", "eigenvalues")


def wrong_body(body: Body, how: str, rng: np.random.Generator) -> Body:
    """Return a body as a model has it."""
    if how == "E":
        return body.changed(eigenvalues=np.exp(0.03 * rng.standard_normal()))
    if how == "E and density":
        youngs_modulus, density = np.exp((0.03, 0.02) * rng.standard_normal(2))
        return body.changed(eigenvalues=youngs_modulus, density=density)
    return body.changed(eigenvalues=np.exp(0.03 * rng.standard_normal(body.squared.size)))


def side_models(own: Pair, how: str, rng: np.random.Generator) -> tuple[jf.SideModel, ...]:
    """Return models of both sides that are wrong."""
    found = []
    for side in (0, 1):
        model, joint, responses, forces = own.model(side, wrong_body(own.bodies[side], how, rng))
        found.append(jf.SideModel(jf.Substructure(model, joint), responses, forces))
    return tuple(found)


def result(own: Pair, **more) -> dict:
    """Return estimates and intervals over the true compliance, and the time taken."""
    start = time.process_time()
    try:
        fit = jf.identify(own.freq_hz, own.noisy, DIRECTIONS, transform=own.transform, damping="hysteretic", **more)
    except (ValueError, np.linalg.LinAlgError) as error:
        return {"error": str(error)[:200]}
    limits = fit.confidence_interval(0.95)
    ends = np.array([limits[f"k_{dof}"] for dof in DIRECTIONS])
    with np.errstate(divide="ignore"):
        low, high = 1 / ends[:, 1] / own.compliance, 1 / ends[:, 0] / own.compliance
    return {
        "best": (1 / fit.stiffness / own.compliance).tolist(),
        "low": low.tolist(),
        "high": high.tolist(),
        "seconds": time.process_time() - start,
        "residual": fit.residual_level / fit.noise_level,
    }


def member(index: int) -> dict | None:
    """Return all fits of a member; None where a random layout is of no use."""
    try:
        own = pair(index, lines=100)
    except ValueError:
        return None
    rng = np.random.default_rng([index, 1])
    found = {"index": index, "kinds": own.kinds, "reach": own.reach, "band": own.band,
             "share": (abs(own.sides) / own.compliance).tolist(), "none": result(own)}  # fmt: skip
    how = WRONG[index // 2 % len(WRONG)]
    return found | {how: result(own, sides=side_models(own, how, rng))}


def rows(members: list[dict], how: str) -> dict[str, np.ndarray]:
    """Return the results of one way as arrays over members and DOFs."""
    good = [one for one in members if how in one and "error" not in one[how]]
    found = {key: np.array([one[how][key] for one in good]) for key in ("best", "low", "high")}
    return found | {"share": np.array([one["share"] for one in good]), "of": np.array([one["index"] for one in good]),
                    "kinds": np.array([one["kinds"] for one in good])}  # fmt: skip


def percent(share: float) -> str:
    return "-" if np.isnan(share) else f"{100 * share:.3g} %"


def tables(members: list[dict]) -> None:
    """Print coverage, and widths by how much the sides give way."""
    kinds = sorted({kind for one in members for kind in one["kinds"]})
    print(f"{len(members)} pairs of bodies, {sum(one['index'] >= FRESH for one in members)} that gave no quantiles\n")
    print("| models of the sides | failed | coverage | of those that gave no quantiles | " + " | ".join(kinds) + " |")
    print("|" + "---|" * (4 + len(kinds)))
    for how in ("none", *WRONG):
        own = rows(members, how)
        inside = (own["low"] <= 1) & (own["high"] >= 1)
        fresh = inside[own["of"] >= FRESH]
        by_kind = (percent(inside[(own["kinds"] == kind).any(axis=1)].mean()) for kind in kinds)
        failed = sum(how in one and "error" in one[how] for one in members)
        print(f"| {how} | {failed} | {percent(inside.mean())} | {percent(fresh.mean())} | {' | '.join(by_kind)} |")
    print("\n| C_sides/C_joint | n | models | half width | open | error of k, median | 90 % |\n|" + "---|" * 7)
    for low, high in ((0, 0.03), (0.03, 0.1), (0.1, 0.3), (0.3, 1), (1, 3), (3, np.inf)):
        for how in ("none", *WRONG):
            own = rows(members, how)
            some = (own["share"] >= low) & (own["share"] < high)
            if not some.any():
                continue
            width, error = (own["high"] - own["low"])[some] / 2, abs(1 / own["best"][some] - 1)
            print(f"| {low:g}-{high:g} | {some.sum()} | {how} | {percent(np.median(width))} | "
                  f"{percent((own['low'][some] <= 0).mean())} | {percent(np.median(error))} | "
                  f"{percent(np.quantile(error, 0.9))} |")  # fmt: skip
    print(
        "\n| models of the sides | fits | above 5 s | "
        + " | ".join(("all", *kinds))
        + " |\n|"
        + "---|" * (4 + len(kinds))
    )
    for how in ("none", *WRONG):
        timed = [(one[how]["seconds"], one["kinds"]) for one in members if "seconds" in one.get(how, {})]
        own = [[time for time, of in timed if kind is None or kind in of] for kind in (None, *kinds)]
        cells = (f"{np.median(some):.2f}, {max(some):.1f}" if some else "-" for some in own)
        print(f"| {how} | {len(timed)} | {sum(time > 5 for time, _ in timed)} | {' | '.join(cells)} |")


def main() -> None:
    """Compute members that are not in the file yet, and print the tables."""
    first, last = map(int, sys.argv[1:3]) if len(sys.argv) > 2 else (0, MEMBERS)
    path = Path(tempfile.gettempdir()) / "sides.jsonl"
    done = {one["index"]: one for one in map(json.loads, path.read_text().splitlines())} if path.exists() else {}
    warnings.simplefilter("ignore")
    # Members that gave quantiles and others in turn; errors of channels are not studied here.
    with mock.patch.object(identify, "_data_checks", return_value=[]):
        for index in sorted(range(first, last), key=lambda index: (index % FRESH, index)):
            if index not in done and (one := member(index)) is not None:
                done[index] = one
                with path.open("a") as file:
                    file.write(json.dumps(one) + "\n")
    tables([done[index] for index in sorted(done) if first <= index < last])


if __name__ == "__main__":
    main()
