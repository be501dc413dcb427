"""Study of the search for a wrong sign or two exchanged channels in fits with models.

    tests/accuracy/run channel-maps [--draws 200]

Each draw has its own channels, joint, noise (1 to 5 %) and error of Young's modulus (1 %, known to 1 %), and one fault
or none; the seed is its number. The test of seed 7 has one force and three responses, so that seven changes fit equally
well.
"""

from __future__ import annotations

import argparse
import warnings
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from typing import NamedTuple

import numpy as np

import jointfrf as jf
from jointfrf.identification.model.channel_map import find_channel_change
from jointfrf.identification.model.prepare import Channels, prepare_model_fit
from jointfrf.identification.noise import NoiseOptions

FREQ = np.linspace(20, 900, 100)
_SECTION = dict(density=2700.0, width=0.025, height=0.006, loss_factor=0.01)
_E = 70e9


class Draw(NamedTuple):
    """One set of FRFs without and with a fault, and what is known of the assembly."""

    h: np.ndarray
    channels: Channels
    assembly: jf.Assembly


def _parts(random: np.random.Generator | None) -> tuple[jf.Substructure, jf.Substructure]:
    found = []
    for length, elements, joint in ((0.3, 12, "13"), (0.225, 9, "1")):

        def model(youngs_modulus: float = _E, length: float = length, elements: int = elements) -> jf.Model:
            return jf.beam(length, elements, youngs_modulus=youngs_modulus, **_SECTION)

        true = _E * (1 + 0.01 * random.normal()) if random is not None else _E
        unknown = {} if random is not None else {"youngs_modulus": jf.Unknown(1.0, 0.01)}
        found.append(jf.Substructure(model(true), [f"{joint}:y", f"{joint}:theta"], unknown))
    return found[0], found[1]


def draw(seed: int) -> Draw:
    """FRFs of two beams at random points."""
    random = np.random.default_rng([seed, 7])
    points = [*(f"A/{node}:y" for node in range(1, 13)), *(f"B/{node}:y" for node in range(2, 11))]
    responses, forces = (sorted(random.choice(points, random.integers(*size), replace=False).tolist())
                         for size in ((3, 6), (1, 4)))  # fmt: skip
    k = np.exp(random.normal(np.log([6e5, 5e2]), 1.0))
    truth = jf.Assembly(*_parts(random), jf.Joint(k, dofs=["y", "theta"], structural_damping=0.03 * k))
    h = truth.receptance(FREQ, responses, forces)
    h = jf.pollute(h, random.uniform(0.01, 0.05), seed=seed)
    laws = {dof: jf.SpringLaw(value, h=0.01 * value) for dof, value in (("y", 1e6), ("theta", 1e3))}
    assembly = jf.Assembly(*_parts(None), jf.LawJoint(laws))
    return Draw(h, Channels(tuple(responses), tuple(forces)), assembly)


def fault(one: Draw, seed: int) -> tuple[np.ndarray, str]:
    """The FRFs with one fault, and its name as the search would say it."""
    random = np.random.default_rng([seed, 8])
    h, names = one.h.copy(), {"response": one.channels.responses, "force": one.channels.forces}
    side = str(random.choice(["response", "force"]))
    own, across = names[side], h if side == "response" else h.swapaxes(1, 2)
    if len(own) > 1 and random.random() < 0.5:
        i, j = sorted(random.choice(len(own), 2, replace=False).tolist())
        across[:, [i, j]] = across[:, [j, i]]
        return h, f"{side}s {own[i]} and {own[j]} exchanged"
    i = int(random.integers(len(own)))
    across[:, i] *= -1
    return h, f"{side} {own[i]} with the opposite sign"


def outcome(h: np.ndarray, one: Draw, true: str | None) -> str:
    """Say whether a search is right."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        problem = prepare_model_fit(FREQ, h, one.assembly, one.channels, NoiseOptions(None), ())
        found = find_channel_change(problem, one.channels)
    if found.change is not None:
        return "right" if str(found.change) == true else "false"
    if found.finding.severity == "warning":
        return "true one among several" if true is not None and true in found.finding.text else "false"
    if true is None:
        return "right"
    return "as good as given, said" if true in found.finding.text else "missed"


def both(seed: int) -> tuple[str, str]:
    """Return what is found with one fault, and with none."""
    one = draw(seed)
    h, true = fault(one, seed)
    return outcome(h, one, true), outcome(one.h, one, None)


def main() -> None:
    """Print how often the search is right."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=200)
    draws = parser.parse_args().draws
    with ProcessPoolExecutor() as pool:
        found = list(pool.map(both, range(draws)))
    kinds = ("right", "true one among several", "as good as given, said", "missed", "false")
    print(f"| FRFs with | draws | {' | '.join(kinds)} |\n|{'---|' * 7}")
    for name, own in zip(("one fault", "none"), zip(*found, strict=True), strict=True):
        counts = Counter(own)
        print(f"| {name} | {draws} | {' | '.join(str(counts[kind]) for kind in kinds)} |")
    print("not right:", [(seed, *pair) for seed, pair in enumerate(found) if pair != ("right", "right")])


if __name__ == "__main__":
    main()
