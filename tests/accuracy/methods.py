"""All methods on the published cases, beside the Cramer-Rao bounds of what each of them knows.

    tests/accuracy/run methods                  cases 3.1, 3.2, 3.3 and 4.3.1, 30 draws each
    tests/accuracy/run methods 3.3 --draws 10

5 % complex noise of each FRF; lines, points and first bands of the cases. Draw number i has the seed i, its internal
FRFs 10 000 + i.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from concurrent.futures import ProcessPoolExecutor
from functools import cache, partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "python" / "support"))

from fits import _groups

import jointfrf as jf
from cramer_rao import cramer_rao
from jointfrf.identification.manifold.coordinates import joint_terms
from jointfrf.workbench.cases.catalogue import find_case, read_case
from jointfrf.workbench.cases.known_joint.exact import exact_frfs
from model_bound import model_bound

CASES = ("3.1", "3.2", "3.3", "4.3.1")
LEVEL = 0.05
METHODS = (
    "mean over bands",
    "median over bands",
    "inverse-variance mean",
    "compliance fit",
    "decoupling fit",
    "model fit",
)


@cache
def prepared(name):
    """The case and its FRFs without noise."""
    case = read_case(find_case(name))
    return case, exact_frfs(case)


def assembly(name):
    """Substructures by their FRFs, and the names of channels at the joint and inside."""
    _, exact = prepared(name)
    joint, inner = [f"joint {dof}" for dof in exact.dofs], [f"inner {dof}" for dof in exact.dofs]
    parts = [
        jf.Substructure.of_frfs(exact.freq_hz, h, [*joint, *inner], joint, noise=0.0) for h in (exact.h_a, exact.h_b)
    ]
    interface = [f"{side}/{dof}" for side in "AB" for dof in joint]
    internal = [f"{side}/{dof}" for side in "AB" for dof in inner]
    return parts, interface, internal


def lines_of_joint(gamma):
    """K* of each line, and the variance of its diagonal, roughly: noise of gamma_jj and gamma_kk through K*^2."""
    n = gamma.shape[1] // 2
    k = jf.inverse_substructuring(gamma)
    noise = (LEVEL * abs(np.einsum("laa->la", gamma))) ** 2
    return k, abs(np.einsum("laa->la", k)) ** 4 * (noise[:, :n] + noise[:, n:])


def of_bands(case, exact, gamma):
    """Parameters by mean, median and inverse-variance mean over the bands, shape (3, 2 n)."""
    k, variance = lines_of_joint(gamma)
    bands, found = case.band_sets[0], []
    found.append(bands.means(exact.freq_hz, k))
    median, weighted = np.empty((2, 2 * exact.n))
    for p, own in enumerate(bands.bands.values()):
        inside, d = jf.in_bands(exact.freq_hz, own), p % exact.n
        lines = k[inside, d, d]
        values = lines.real if p < exact.n else lines.imag / (2 * np.pi * exact.freq_hz[inside])
        weight = 1 / variance[inside, d] * (1 if p < exact.n else (2 * np.pi * exact.freq_hz[inside]) ** 2)
        median[p], weighted[p] = np.median(values), (weight * values).sum() / weight.sum()
    return [*found, median, weighted]


def values_of(fit, dofs):
    """Stiffness of all DOFs, then damping."""
    return np.array([fit.value[f"{kind}_{dof}"] for kind in "kc" for dof in dofs])


def one_draw(name, seed):
    """Parameters by every method, shape (6, 2 n)."""
    case, exact = prepared(name)
    parts, interface, internal = assembly(name)
    start = jf.Assembly(*parts, case.initial)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        gamma = jf.pollute(exact.interface(exact.h_c), LEVEL, seed=seed)
        found = of_bands(case, exact, gamma)
        found.append(values_of(jf.identify(exact.freq_hz, gamma, exact.dofs, damping="viscous"), exact.dofs))
        at = np.r_[exact.where("r"), exact.where("s")]
        inner = jf.pollute(np.ascontiguousarray(exact.h_c[:, at[:, None], at]), LEVEL, seed=10_000 + seed)
        for h, channels in ((inner, internal), (gamma, interface)):
            fit = jf.identify_model(exact.freq_hz, h, start, channels, channels)
            found.append(values_of(fit, exact.dofs))
    return np.array(found)


def bounds(name):
    """Standard deviations at the bounds: without models, of internal FRFs with models, of the interface with models."""
    case, exact = prepared(name)
    parts, interface, internal = assembly(name)
    whole = jf.Assembly(*parts, case.joint)
    gamma = exact.interface(exact.h_c)
    terms = joint_terms(2 * np.pi * exact.freq_hz, exact.dofs, "viscous", "zero")
    none = np.full(2 * exact.n, np.nan)
    for group in _groups(gamma):
        own, which = terms.of_dofs(group)
        at = np.concatenate([group, group + exact.n])
        k = case.joint.dynamic_stiffness(exact.freq_hz)[:, group[:, None], group]
        none[which] = LEVEL * np.sqrt(np.diag(cramer_rao(gamma[:, at[:, None], at], k, own)))
    found = [none]
    for channels in (internal, interface):
        bound = model_bound(whole, exact.freq_hz, channels, channels, LEVEL)
        found.append(np.array([bound[f"{kind}_{dof}"] for kind in "kc" for dof in exact.dofs]))
    return found


def main() -> None:
    """Print a table for each case asked for."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cases", nargs="*", help="out of 3.1, 3.2, 3.3, 4.3.1; all by default")
    parser.add_argument("--draws", type=int, default=30)
    parser.add_argument("--workers", type=int, default=None, help="processes; one a core by default")
    args = parser.parse_args()
    with ProcessPoolExecutor(args.workers) as pool:
        for name in args.cases or CASES:
            case, exact = prepared(name)
            true = np.concatenate([case.joint.stiffness.diagonal(), case.joint.damping.diagonal()])
            found = np.array(list(pool.map(partial(one_draw, name), range(args.draws))))
            rmse = 100 * np.sqrt(((found - true) ** 2).mean(axis=0)) / true
            bound = [100 * one / true for one in bounds(name)]
            heads = [f"{kind}_{dof}" for kind in "kc" for dof in exact.dofs]
            print(f"\nCase {name}, {args.draws} draws, RMSE in %\n\n| | {' | '.join(heads)} |")
            print("|" + "---|" * (len(heads) + 1))
            rows = [*zip(METHODS, rmse, strict=True)]
            rows.insert(4, ("*bound without models*", bound[0]))
            rows.insert(6, ("*bound of internal FRFs*", bound[1]))
            rows.append(("*bound with models*", bound[2]))
            for method, values in rows:
                print(f"| {method} | " + " | ".join(f"{value:.2g}" for value in values) + " |", flush=True)


if __name__ == "__main__":
    main()
