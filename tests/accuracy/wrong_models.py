"""Study of the model fit with wrong models: coverage of 95 % intervals, warnings, widths.

    tests/accuracy/run wrong-models                       all pairs, 40 draws each, 10 of them without errors believed
    tests/accuracy/run wrong-models "one drive" --draws 20

Draw number i of every pair has the seed i. Models are wrong in ways that are not among their unknowns, except E of A,
which has a prior of 3 %. Held or warned: inside the interval, or a warning of the residual, the models or a prior.
Width: over the width of a fit of right models that are `exact`.
"""

from __future__ import annotations

import argparse
import warnings
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
from scipy import sparse

import jointfrf as jf

FREQ = np.arange(15.0, 801.0, 4.0)
LENGTHS, MODULUS, ELEMENTS = (0.3, 0.225), 67e9, (12, 9)
SECTION = {"density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01}
TRUE = {"k_y": 6e5, "c_y": 20.0, "k_theta": 5e3, "c_theta": 1.5}
_REMOTE = (("A", 6), ("A", 9), ("B", 6), ("B", 9))
#: Responses and forces by side and distance from the first node, in 25 mm; noise.
POINTS = {
    "16 FRFs at remote points, 2 %": (_REMOTE, _REMOTE, 0.02),
    "one drive point, 5 %": (_REMOTE[3:], _REMOTE[3:], 0.05),
    "4 responses, one force, 1 %": (_REMOTE, _REMOTE[3:], 0.01),
}
#: What is wrong with the believed models, and by what word.
WRONG = (
    "nothing", "E of A -0.1 %", "E of A +0.3 %", "E of A -1 %", "E of A +3 %", "length of A 0.3 %", "1 g missing on A",
    "1 g missing at the end of B", "clamp of A that turns", "rotary inertia missing", "4 + 3 elements, not 12 + 9",
    "linear elements", "all forces +3 %", "last force +3 %", "first response +3 %",
)  # fmt: skip


def beam(side: int, *, elements: int | None = None, clamped: bool = True, **changes: float | str) -> jf.Model:
    """Beam A or B of case 3.3."""
    options = {"youngs_modulus": MODULUS, "length": LENGTHS[side]} | SECTION | changes
    ends = ("clamped" if side == 0 and clamped else "free", "free")
    return jf.beam(options.pop("length"), elements or ELEMENTS[side], ends=ends, **options)


def with_rotary_inertia(model: jf.Model, side: int) -> jf.Model:
    """The beam whose sections have the inertia rho I (Przemieniecki 1968, 11.35)."""
    n = ELEMENTS[side]
    a, inertia = LENGTHS[side] / n, SECTION["density"] * SECTION["width"] * SECTION["height"] ** 3 / 12
    own = np.array([[36, 3 * a, -36, 3 * a], [3 * a, 4 * a**2, -3 * a, -(a**2)],
                    [-36, -3 * a, 36, -3 * a], [3 * a, -(a**2), -3 * a, 4 * a**2]])  # fmt: skip
    added = np.zeros((2 * n + 2, 2 * n + 2))
    for e in range(n):
        added[2 * e : 2 * e + 4, 2 * e : 2 * e + 4] += inertia / (30 * a) * own
    held = len(added) - len(model.dofs)
    return replace(model, mass=sparse.csr_array(model.mass) + sparse.csr_array(added[held:, held:]))


@dataclass(frozen=True)
class Pair:
    """Points, noise, and what is wrong with the models."""

    points: str
    wrong: str

    @property
    def coarse(self) -> int:
        """How many elements of the true beam one of the believed beam is."""
        return 3 if "not 12" in self.wrong else 1

    def channels(self, coarse: int = 1) -> tuple[tuple[str, ...], tuple[str, ...]]:
        """Responses and forces in the numbers of nodes."""
        named = [tuple(f"{side}/{at // coarse + 1}:y" for side, at in one) for one in POINTS[self.points][:2]]
        return named[0], named[1]

    def gains(self) -> np.ndarray:
        """Measured over true FRFs, shape (n_o, n_i)."""
        found = np.ones([len(one) for one in POINTS[self.points][:2]])
        changed = {"all": ..., "last": (..., -1), "first": 0}.get(self.wrong.split()[0])
        if changed is not None:
            found[changed] += 0.03
        return found

    def truth(self) -> jf.Assembly:
        """The assembly that is measured."""
        a, b, attached = beam(0), beam(1), ()
        if self.wrong.startswith("E of A"):
            a = beam(0, youngs_modulus=MODULUS * (1 + float(self.wrong.split()[3]) / 100))
        if self.wrong.startswith("length"):
            a = beam(0, length=1.003 * LENGTHS[0])
        if self.wrong.startswith("1 g"):
            attached = (jf.AddedMass("A/7:y" if self.wrong.endswith("A") else "B/10:y", 0.001),)
        if self.wrong.startswith("clamp"):
            a = beam(0, clamped=False)
            attached = (jf.GroundSpring("A/1:y", 1e9), jf.GroundSpring("A/1:theta", 2e4))
        if self.wrong.startswith("rotary"):
            a, b = with_rotary_inertia(a, 0), with_rotary_inertia(b, 1)
        joint = jf.Joint([TRUE["k_y"], TRUE["k_theta"]], [TRUE["c_y"], TRUE["c_theta"]], ["y", "theta"])
        return jf.Assembly(
            jf.Substructure(a, ["13:y", "13:theta"]), jf.Substructure(b, ["1:y", "1:theta"]), joint, attached
        )

    def believed(self, model_error: float | None, *, exact: bool = False) -> jf.Assembly:
        """The assembly that is fitted."""
        element = "shear-flexible" if self.wrong.startswith("linear") else "euler-bernoulli"
        models = [beam(side, elements=ELEMENTS[side] // self.coarse, element=element) for side in (0, 1)]
        dofs = [f"{ELEMENTS[0] // self.coarse + 1}:y", f"{ELEMENTS[0] // self.coarse + 1}:theta"], ["1:y", "1:theta"]
        parts = [
            jf.Substructure(model, own, exact=exact, model_error=model_error)
            for model, own in zip(models, dofs, strict=True)
        ]
        return jf.Assembly(parts[0], parts[1], jf.Joint([1e5, 1e3], [5, 0.5], ["y", "theta"]))


@cache
def exact_frfs(pair: Pair) -> np.ndarray:
    """FRFs of the true assembly without noise."""
    return pair.truth().receptance(FREQ, *pair.channels()) * pair.gains()


def fitted(pair: Pair, model_error: float | None, seed: int, *, exact: bool = False) -> jf.Fit:
    """Return the fit of one draw."""
    h = jf.pollute(exact_frfs(pair), POINTS[pair.points][2], seed=seed)
    return jf.identify_model(FREQ, h, pair.believed(model_error, exact=exact), *pair.channels(pair.coarse))


def one_draw(pair: Pair, model_error: float | None, seed: int, *, exact: bool = False) -> tuple:
    """Which intervals hold, half their width over the value, and whether a warning says that the models do not fit."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        fit = fitted(pair, model_error, seed, exact=exact)
        low, high = np.array([fit.intervals.of(name, 0.95) for name in TRUE]).T
    true = np.array(list(TRUE.values()))
    codes = {one.code for one in fit.findings if one.severity == "warning"}
    said = not codes.isdisjoint(("residual-large", "model-error", "model-gain", "prior-contradicted"))
    return (low <= true) & (true <= high), (high - low) / (2 * true), said


def cells(draws: list, clean: np.ndarray) -> str:
    """Coverage, lowest parameter and mean; draws with a warning; intervals that hold or were warned of; widths."""
    held, width = np.array([draw[0] for draw in draws]), np.array([draw[1] for draw in draws])
    said = np.array([draw[2] for draw in draws])
    fine = held | said[:, None]
    return (
        f"{100 * held.mean(axis=0).min():.0f} / {100 * held.mean():.0f} | {100 * said.mean():.0f} | "
        f"{100 * fine.mean(axis=0).min():.0f} | {np.median(np.median(width, axis=0) / clean):.3g}"
    )


HEAD = (
    "| wrong | default: coverage, lowest / mean, % | warned, % | held or warned, % | width | "
    "`model_error=0`: coverage | warned | held or warned | width |\n" + "|---" * 9 + "|"
)
#: Errors believed, and the part of the draws that each has.
WAYS: dict[float | None, int] = {None: 1, 0.0: 4}


def main() -> None:
    """Run the pairs asked for and print their tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("words", nargs="*", help="pairs whose points or error hold one of these; all by default")
    parser.add_argument("--draws", type=int, default=40)
    parser.add_argument("--workers", type=int, default=1, help="processes")
    args = parser.parse_args()
    with ProcessPoolExecutor(args.workers) as pool:
        for points in POINTS:
            chosen = [Pair(points, w) for w in WRONG if not args.words or any(x in points + w for x in args.words)]
            if not chosen:
                continue
            print(f"\n{points}\n\n{HEAD}", flush=True)
            clean = [one_draw(Pair(points, "nothing"), None, seed, exact=True)[1] for seed in range(10)]
            for pair in chosen:
                row = []
                for way, share in WAYS.items():
                    draws = list(pool.map(partial(one_draw, pair, way), range(-(-args.draws // share))))
                    row.append(cells(draws, np.median(clean, axis=0)))
                print(f"| {pair.wrong} | {' | '.join(row)} |", flush=True)


if __name__ == "__main__":
    main()
