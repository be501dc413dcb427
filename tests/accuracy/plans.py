"""What plans promise: predicted errors beside those of fits, and proposed sets beside grids of equal spacing.

Structure number i is made from the seed i; draw number j of its noise has the seed [i, j], or [i, j, 2]. Grids have 1 %
noise and moduli known to 1 %. Fits have a floor of 0.02 m/(s^2 N) and 3 % noise, 1 % for FRFs between joint DOFs; they
estimate the noise, and those of models start up to a factor e away. With exact models only moduli are unknown, to 1 %.
"""

import argparse
import itertools
import warnings

import numpy as np

import jointfrf as jf

#: Noise of accelerances that does not depend on the FRF, m/(s^2 N).
_FLOOR = 0.02
_ALUMINIUM = {"youngs_modulus": 70e9, "density": 2700.0, "loss_factor": 0.005}


def structure(seed: int, *, exact: bool) -> tuple[jf.Assembly, list[str], np.ndarray]:
    """Two beams of random lengths and ends with a joint; candidates at all nodes that move; lines."""
    rng = np.random.default_rng(seed)
    sides, candidates = [], []
    for side, joint_node in (("A", None), ("B", 1)):
        n = int(rng.integers(9, 15))
        first = ("clamped", "free")[int(rng.integers(2))] if side == "A" else "free"
        size = {"width": 0.025, "height": float(rng.uniform(0.004, 0.01))}
        model = jf.beam(float(rng.uniform(0.2, 0.4)), n, ends=(first, "free"), **_ALUMINIUM, **size)
        node = joint_node or n + 1
        unknowns = {"youngs_modulus": jf.Unknown(1.0, 0.01)} if exact else {}
        sides.append(jf.Substructure(model, [f"{node}:y", f"{node}:theta"], unknowns, exact=exact))
        candidates += [f"{side}/{i}:y" for i in range(2 if first == "clamped" else 1, n + 2)]
    size = np.exp(rng.uniform(-1, 1, 2))
    joint = jf.Joint(np.array([1e6, 1e3]) * size, np.array([50.0, 0.05]) * size, dofs=["y", "theta"])
    return jf.Assembly(*sides, joint), candidates, np.arange(20.0, float(rng.uniform(800, 2000)), 5.0)


class Fits:
    """Fits of one test, beside what its plan predicts.

    Parameters
    ----------
    true, predicted : dict of str to float
        Values and predicted standard errors of the parameters.
    """

    def __init__(self, true: dict[str, float], predicted: dict[str, float]) -> None:
        self.true = true
        self.predicted = np.array([predicted[name] for name in true])
        self.away, self.stated, self.held, self.warned = [], [], [], 0

    def add(self, fit: jf.Fit) -> None:
        """Add the fit of a draw."""
        intervals = fit.confidence_interval(0.95)
        shown = [name in intervals for name in self.true]
        self.away.append([fit.value.get(name, np.nan) - value for name, value in self.true.items()])
        self.stated.append([fit.std_error.get(name, np.nan) for name in self.true])
        inside = [intervals[n][0] <= v <= intervals[n][1] if n in intervals else False for n, v in self.true.items()]
        self.held.append(inside)
        self.warned += any(one.severity != "note" for one in fit.findings) or not all(shown)

    def __str__(self) -> str:
        scatter = np.nanstd(self.away, axis=0, ddof=1) / self.predicted
        stated = np.nanmedian(self.stated, axis=0) / self.predicted
        columns = (", ".join(f"{one:.2f}" for one in each) for each in (scatter, stated))
        draws = len(self.held)
        return (
            f"{' | '.join(columns)} | {np.count_nonzero(self.held)} of {np.size(self.held)} | {self.warned} of {draws}"
        )


def polluted(exact: np.ndarray, variance: np.ndarray, seed: list[int]) -> np.ndarray:
    noise = np.random.default_rng(seed).standard_normal((2, *exact.shape)) * np.sqrt(variance / 2)
    return exact + noise[0] + 1j * noise[1]


_COLUMNS = "scatter / predicted | stated / predicted | intervals that hold | warned |"


def of_draws(seeds: int, draws: int) -> None:
    """Print predicted standard errors beside fits as a user makes them: noise estimated, another joint at the start."""
    print(f"| structure | models | sensors x hits | {_COLUMNS}")
    print("|---|---|---|---|---|---|---|")
    for seed, exact_models in itertools.product(range(seeds), (False, True)):
        whole, candidates, freq = structure(seed, exact=exact_models)
        stated = jf.StatedNoise(0.03, accelerance=_FLOOR)
        found = jf.plan(whole, freq, candidates, candidates, noise=stated, budget=4)
        test = found.proposed
        exact = whole.receptance(freq, test.sensors, test.hits)
        fits = Fits({name: found.value[name] for name in found.targets}, test.std_error)
        for draw in range(draws):
            size = np.exp(np.random.default_rng([seed, draw, 1]).uniform(-1, 1, 2))
            guess = jf.Joint(np.array([1e6, 1e3]) * size, np.array([50.0, 0.05]) / size, dofs=["y", "theta"])
            h = polluted(exact, stated.variance(freq, exact), [seed, draw])
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # counted by the findings
                fits.add(
                    jf.identify_model(freq, h, jf.Assembly(whole.a, whole.b, guess), test.sensors, test.hits)
                )  # fmt: skip
        models = "exact" if exact_models else "default"
        print(f"| {seed} | {models} | {len(test.sensors)} x {len(test.hits)} | {fits} |", flush=True)


def of_joint_frfs(seeds: int, draws: int) -> None:
    """Print the same for FRFs between all joint DOFs."""
    print(f"| structure | {_COLUMNS}")
    print("|---|---|---|---|---|")
    for seed in range(seeds):
        whole, _, freq = structure(seed, exact=True)
        names = [*(f"A/{dof}" for dof in whole.a.joint), *(f"B/{dof}" for dof in whole.b.joint)]
        exact = whole.receptance(freq, names, names)
        size = dict(zip(whole.joint.names, (one.value for one in whole.joint.quantities), strict=True))
        joint = jf.Joint([size["k_y"], size["k_theta"]], [size["c_y"], size["c_theta"]], ["y", "theta"])
        stated = jf.StatedNoise(0.01, accelerance=_FLOOR)
        found = jf.plan_joint_frfs(freq, exact, joint, noise=stated)
        fits = Fits(found.value, found.std_error)
        for draw in range(draws):
            h = polluted(exact, stated.variance(freq, exact), [seed, draw, 2])
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                fits.add(jf.identify(freq, h, joint.dofs))
        print(f"| {seed} | {fits} |", flush=True)


def of_grids(seeds: int) -> None:
    """Print what a proposed set needs beside a grid of equal spacing with the same error."""
    print("| structure | candidates | sensors + hits | FRFs | error, % | grid: sensors + hits | FRFs | of its FRFs |")
    print("|---|---|---|---|---|---|---|---|")
    for seed in range(seeds):
        whole, candidates, freq = structure(seed, exact=True)
        found = jf.plan(whole, freq, candidates, candidates, noise=0.01, budget=6)
        test = found.proposed
        numbers = np.arange(len(candidates))
        best = None
        for n, m in sorted(itertools.product(numbers[1:], numbers[1:]), key=sum):
            if best is not None and n + m >= best[0] + best[1]:
                break
            sensors, hits = (
                [candidates[i] for i in np.unique(np.round(np.linspace(0, len(candidates) - 1, k)).astype(int))]
                for k in (n, m)
            )
            even = jf.plan(whole, freq, sensors, hits, noise=0.01, sensors=sensors, hits=hits).proposed
            if even.error <= test.error:
                best = n, m
        needed = (len(test.sensors), len(test.hits))
        count = needed[0] * needed[1]
        shown, frfs, ratio = "none", "", ""
        if best is not None:
            on_grid = best[0] * best[1]
            shown, frfs, ratio = f"{best[0]} + {best[1]}", str(on_grid), f"{count / on_grid:.2f}"
        print(
            f"| {seed} | {len(candidates)} | {needed[0]} + {needed[1]} | {count} | {100 * test.error:.2g} | {shown} | "
            f"{frfs} | {ratio} |", flush=True,
        )  # fmt: skip


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=40)
    parser.add_argument("--structures", type=int, default=10)
    args = parser.parse_args()
    of_grids(args.structures)
    print()
    of_draws(min(args.structures, 4), args.draws)
    print()
    of_joint_frfs(min(args.structures, 4), args.draws)


if __name__ == "__main__":
    main()
