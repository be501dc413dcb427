"""The Cramer-Rao bound of a joint between modelled structures, by differences of assembled FRFs."""

from dataclasses import replace

import numpy as np

import jointfrf as jf


def moved(whole, values):
    """The assembly with other values of joint parameters and of unknowns "A/name", "B/name", all by name."""
    joint = whole.joint.with_values(
        [values.get(n, v) for n, v in zip(whole.joint.names, whole.joint.values, strict=True)]
    )
    sides = []
    for name, part in (("A", whole.a), ("B", whole.b)):
        own = {key: values[f"{name}/{key}"] for key in part.unknowns if f"{name}/{key}" in values}
        sides.append(replace(part, source=part.model(own), unknowns={}) if own else part)
    return jf.Assembly(sides[0], sides[1], joint, whole.attachments)


def model_bound(whole, freq, responses, forces, level, truth=None):
    """Standard deviations by name that no unbiased estimate undercuts; circular noise relative to each FRF.

    Parameters are those of the joint and the unknowns of both sides, whose priors count; `truth` has values that are
    not those believed.
    """
    values = dict(zip(whole.joint.names, whole.joint.values.tolist(), strict=True))
    priors = dict.fromkeys(values, np.inf)
    for name, part in (("A", whole.a), ("B", whole.b)):
        for key, unknown in part.unknowns.items():
            values[f"{name}/{key}"] = unknown.value
            priors[f"{name}/{key}"] = unknown.std or np.inf
    values |= truth or {}
    h = moved(whole, values).receptance(freq, responses, forces)
    size = np.sqrt((abs(h) ** 2).mean(axis=0))
    shown = size > 1e-8 * np.sqrt(np.outer(size.max(axis=1), size.max(axis=0)))  # without zeros of symmetry
    slopes = []
    for name, value in values.items():
        step = 1e-4 * value
        ends = [
            moved(whole, {**values, name: value + sign * step}).receptance(freq, responses, forces) for sign in (-1, 1)
        ]
        slopes.append(((ends[1] - ends[0]) / (2 * step) / (level * abs(h)))[:, shown].ravel())
    slopes = np.array(slopes)
    size = np.array(list(values.values()))
    scaled = slopes * size[:, None]
    information = 2 * (scaled @ scaled.conj().T).real + np.diag((size / np.array(list(priors.values()))) ** 2)
    return dict(zip(values, (size * np.sqrt(np.diag(np.linalg.inv(information)))).tolist(), strict=True))
