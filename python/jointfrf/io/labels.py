"""Names of channels as programs and tables write them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from jointfrf.frf.frf_set import Channel
from jointfrf.kernel.arguments import one_line

__all__ = ["DIRECTION_CODES", "ChannelNamer", "channels_of"]

#: Directions by the codes of Universal Files, which sdynpy uses, too.
DIRECTION_CODES = {1: "+x", 2: "+y", 3: "+z", 4: "+rx", 5: "+ry", 6: "+rz"}
DIRECTION_CODES |= {-code: "-" + direction[1:] for code, direction in DIRECTION_CODES.items()}
#: ``102:+y``, ``bar:102:+Y``, ``Point102 -Z``, ``102RX``, sdynpy's ``102Y+``; ``Point102`` and ``102:S`` have no
#: direction.
_LABEL = re.compile(r"(?:.*\D)?(\d{1,18})[\s:._]*(?:([+-]?)(r?[xyz])([+-]?)|s)?", re.IGNORECASE)


class ChannelNamer:
    """Makes channels of names in files, with directions and components that a user states.

    Parameters
    ----------
    direction : str, optional
        Direction of places that have none.
    components : mapping of str to int, optional
        Number to add to the nodes of each component. Without it, components with equal node numbers are an error.
    """

    def __init__(self, direction: str | None = None, components: Mapping[str, int] | None = None) -> None:
        self.direction, self.components = direction, components
        self._component_of: dict[int, str] = {}

    def channels(self, what: str, labels: Any) -> tuple[Channel, ...]:
        """Return the channels of one side of a matrix; arguments and errors as in `channels_of`."""
        found = tuple(self.channel(what, label) for label in _listed(labels))
        twice = next((channel for channel, count in Counter(found).items() if count > 1), None)
        if twice is not None:
            raise ValueError(f"names {twice} twice in its {what}; leave one out")
        return found

    def channel(self, what: str, label: Any) -> Channel:
        """Return the channel of one label."""
        if isinstance(label, Channel):
            return label
        if isinstance(label, tuple) and len(label) == 2:
            node, code = label
            if not float(node).is_integer() or node < 1 or (code != 0 and code not in DIRECTION_CODES):
                raise ValueError(
                    f"has node {node} with direction code {code} in its {what}; use codes 1 to 6, -1 to -6"
                )
            return self.numbered("", int(node), DIRECTION_CODES.get(int(code), ""), what)
        text = str(label).strip()
        match = _LABEL.fullmatch(text)
        if match is None or int(match[1]) < 1:
            raise ValueError(f"has {one_line(text)} in its {what}; name a node and a direction, such as 102:+y")
        component = text[: match.start(1)].rpartition(":")[0]
        return self.numbered(component, int(match[1]), f"{match[2] or match[4] or ''}{match[3] or ''}", what)

    def numbered(self, component: str, node: int, direction: str, what: str) -> Channel:
        """Return the channel of a component, a node and a direction, which may be empty.

        Raises
        ------
        ValueError
            There is no direction, or another component has this node.
        """
        direction = direction or self.direction or ""
        if not direction:
            raise ValueError(f"has no direction of node {node} in its {what}; give mapping direction=z")
        own = component.strip()
        if self.components is not None and own and own not in self.components:
            raise ValueError(f"has a component {own!r}; add it to mapping components={_written(self.components)}")
        number = node + self._shift(own)
        other = self._component_of.setdefault(number, own) or own
        if own and other != own and (self.components is None or self._shift(other) != self._shift(own)):
            apart = {other: 0, own: 1000} if self.components is None else self.components
            raise ValueError(
                f"has node {number} in the components {other!r} and {own!r}; number them apart by mapping "
                f"components={_written(apart)}"
            )
        self._component_of[number] = other
        return Channel(number, direction)

    def _shift(self, component: str) -> int:
        return (self.components or {}).get(component, 0)


def _written(components: Mapping[str, int]) -> str:
    return ",".join(f"{name}:{number}" for name, number in components.items())


def channels_of(what: str, labels: Any) -> tuple[Channel, ...]:
    """Return channels by their labels.

    Parameters
    ----------
    what : str
        Kind of the labels in messages: ``responses``.
    labels : sequence
        Names with node and direction; pairs of node and direction code 1 to 6, negative against the axis; or a
        structured array with the fields ``node`` and ``direction``.

    Returns
    -------
    tuple of Channel
        Channels in the order of the labels.

    Raises
    ------
    ValueError
        A label names no channel, or two are the same.
    """
    return ChannelNamer().channels(what, labels)


def _listed(labels: Any) -> list[Any]:
    """Return labels one by one, nodes with their direction codes as pairs."""
    if isinstance(labels, str | Channel):
        return [labels]
    if not isinstance(labels, np.ndarray):
        return [label.item() if isinstance(label, np.ndarray) and label.size == 1 else label for label in labels]
    if labels.dtype.names and {"node", "direction"} <= set(labels.dtype.names):
        return [(row["node"], row["direction"]) for row in labels.ravel()]
    if labels.dtype.kind in "iuf" and labels.ndim == 2 and labels.shape[1] == 2:
        return [tuple(row) for row in labels]
    return list(labels.ravel())
