"""Keys of `case.toml` and `expected.toml` of a case of a bolted lap joint."""

from __future__ import annotations

from jointfrf.cases.common_keys import (
    COMMON_KEYS,
    DOF_BANDS,
    EXPECTED_FREQUENCIES,
    FIGURES,
    JOINT,
    MATERIAL_KEYS,
    NOISE,
    PRESET,
    one_of,
)
from jointfrf.solids.bolted_lap import PROOF_STRENGTH, STRESS_AREA
from jointfrf.toml.keys import Key, KeyTable

__all__ = ["BOLTED_LAP_KEYS", "EXPECTED_BOLTED_KEYS"]

_SIZE = "number, above 0"
_BEAMS = KeyTable(
    "[beams]",
    "Two beams of bricks of the same section that overlap.",
    (
        Key("length_a", _SIZE, "Length of A.", "m"),
        Key("length_b", _SIZE, "Length of B.", "m"),
        Key("transfer_length_b", _SIZE, "Length of another B, to which the identified joint is transferred.", "m"),
        Key("width", _SIZE, "Width.", "m"),
        Key("height", _SIZE, "Thickness of each.", "m"),
        Key("overlap", _SIZE, "Length of the overlap.", "m"),
        Key("hole_radius", _SIZE, "Radius of the hole, in the middle of the overlap.", "m"),
        PRESET,
        *MATERIAL_KEYS,
    ),
)
_BOLT = KeyTable(
    "[bolt]",
    "A bolt of solid elements, and its preload (4.3), (4.4).",
    (
        Key("size", one_of(STRESS_AREA), "Thread, for the stress area."),
        Key("strength_class", one_of(PROOF_STRENGTH), "For the proof strength."),
        Key("preload_share", "number, 0 to 1", "Preload as a share of the proof load."),
        Key("shank_radius", _SIZE, "Radius of the shank.", "m"),
        Key("head_radius", _SIZE, "Radius of the head.", "m"),
        Key("head_height", _SIZE, "Height of the head.", "m"),
        Key("nut_radius", _SIZE, "Radius of the nut.", "m"),
        Key("nut_height", _SIZE, "Height of the nut.", "m"),
        *MATERIAL_KEYS,
    ),
)
_CONTACT = KeyTable(
    "[contact]", "Between the beams.", (Key("friction", "number, at least 0", "Coefficient of friction."),)
)
_MEASUREMENT = KeyTable(
    "[measurement]",
    "Points around the reference point, for rotations by central differences.",
    (
        Key("spacing_x", _SIZE, "From the reference point to its neighbours along x.", "m"),
        Key("spacing_z", _SIZE, "The same along z.", "m"),
    ),
)
_BANDS = KeyTable("[bands]", "Sensitive bands over which K\\* is averaged.", DOF_BANDS)
BOLTED_LAP_KEYS = KeyTable(
    "case.toml of kind bolted-lap",
    "A lap joint with a preloaded bolt of solid elements, and what is measured on it.",
    (
        *COMMON_KEYS,
        Key("beams", "table", "The beams.", inner=_BEAMS),
        Key("bolt", "table", "The bolt.", inner=_BOLT),
        Key("contact", "table", "Contact between the beams.", inner=_CONTACT),
        Key("measurement", "table", "Measured points.", inner=_MEASUREMENT),
        Key("joint", "tables", "Known joint of the error analysis, in the order x, theta_y, y, theta_x, z, theta_z.",
            inner=JOINT),
        Key("bands", "table", "Sensitive bands.", inner=_BANDS),
        Key("noise", "tables", "Noise and methods.", inner=NOISE),
    ),
)  # fmt: skip
EXPECTED_BOLTED_KEYS = KeyTable(
    "expected.toml of kind bolted-lap",
    "What is known about a case beforehand; the file may be missing.",
    (
        Key("frequencies", "table", "Natural frequencies.", "", "none",
            KeyTable("[frequencies]", "Natural frequencies of the assembly.", EXPECTED_FREQUENCIES)),
        FIGURES,
    ),
)  # fmt: skip
