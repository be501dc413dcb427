"""Coverage of intervals in the cases of several joints: cases/four-mounts and cases/four-floors.

    tests/accuracy/run assemblies [--only four-mounts] [--draws 100]

Draw number i has the noise of seed i, and mounts that no other draw has. Along z the FRFs of four-mounts contain only
sums of two mounts: each interval allows for a spread that was estimated from four joints, and is wide.
"""

from __future__ import annotations

import argparse
import runpy
import warnings
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import jointfrf as jf

_CASES = Path(__file__).resolve().parents[2] / "cases"


def _module(case: str) -> dict[str, Any]:
    return runpy.run_path(str(_CASES / case / "make.py"))


def truth_of(case: str, seed: int) -> dict[str, float]:
    """True values of all parameters of a draw."""
    own = _module(case)
    if case == "four-floors":
        k = own["STIFFNESS"]
        return {"f1c1.k_theta_z": k, "f1c1.h_theta_z": own["LOSS_FACTOR"] * k,
                "column1/youngs_modulus": own["YOUNGS_MODULUS"]}  # fmt: skip
    named = own["mounts"](seed) | {"mounts": own["STIFFNESS"]}
    found = {f"{name}.k_{d}": float(k) for name, ks in named.items() for d, k in zip("xyz", ks, strict=True)}
    found |= {name.replace(".k_", ".h_"): own["LOSS_FACTOR"] * k for name, k in found.items()}
    moduli = {f"{name}/youngs_modulus": modulus for name, modulus in own["YOUNGS_MODULUS"].items()}
    return found | moduli | {"machine/density": own["MASS"] / own["KEYS"]["parts"]["machine"]["mass"]}


def fitted(case: str, seed: int) -> jf.Fit:
    """Return the fit of one draw."""
    return jf.measured_assembly(_CASES / case / "assembly.toml", _module(case)["measured"](seed)).fit()


def one_draw(case: str, seed: int) -> dict[str, tuple[float, bool]]:
    """Error over standard error, and whether the interval holds the truth, of each parameter."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fit = fitted(case, seed)
    intervals, truth = fit.confidence_interval(0.95), truth_of(case, seed)
    if truth.keys() != fit.value.keys():
        raise ValueError(f"the fit has {', '.join(fit.value)}")
    return {
        name: ((fit.value[name] - true) / fit.std_error[name], intervals[name][0] <= true <= intervals[name][1])
        for name, true in truth.items()
    }


def kind_of(case: str, name: str) -> str:
    """To which row of the table a parameter belongs."""
    if "/" in name:
        return "models"
    if case == "four-floors":
        return "joints"
    return f"{'common means' if name.startswith('mounts.') else 'mounts'}, {name[-1]}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", choices=("four-mounts", "four-floors"))
    parser.add_argument("--draws", type=int, default=100)
    args = parser.parse_args()
    print("| case | parameters | draws | coverage of 95 %, lowest .. highest, mean | RMS error / standard error |")
    print("|---|---|---|---|---|")
    for case in (args.only,) if args.only else ("four-mounts", "four-floors"):
        found = list(map(partial(one_draw, case), range(args.draws)))
        rows: dict[str, list[str]] = {}
        for name in found[0]:
            rows.setdefault(kind_of(case, name), []).append(name)
        for kind, names in rows.items():
            inside = 100 * np.array([np.mean([draw[name][1] for draw in found]) for name in names])
            size = np.sqrt(np.mean([[draw[name][0] ** 2 for name in names] for draw in found]))
            print(
                f"| {case} | {kind}: {len(names)} | {args.draws} | {inside.min():.0f} .. {inside.max():.0f}, "
                f"{inside.mean():.1f} | {size:.2f} |", flush=True,
            )  # fmt: skip


if __name__ == "__main__":
    main()
