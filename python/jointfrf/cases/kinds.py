"""The kinds of cases, by the word that `kind` in `case.toml` says."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jointfrf.cases.bolted_lap.kind import BOLTED_LAP
from jointfrf.cases.kind import CaseKind
from jointfrf.cases.known_joint.kind import KNOWN_JOINT
from jointfrf.cases.modelled_joint.kind import MODELLED_JOINT

__all__ = ["KINDS"]

#: The first is that of a case that names none.
KINDS: Mapping[str, CaseKind[Any, Any]] = {
    kind.name: kind
    for kind in (
        KNOWN_JOINT,
        BOLTED_LAP,
        MODELLED_JOINT,
    )
}
