"""Keys of `case.toml` of a case of a modelled joint."""

from __future__ import annotations

from jointfrf.cases.common_keys import COMMON_KEYS, FIGURES, one_of
from jointfrf.cases.known_joint.keys import SUBSTRUCTURE
from jointfrf.laws.joint_toml import LAW_VALUES, LAW_WORDS, takes_in_words
from jointfrf.toml.keys import Key, KeyTable

__all__ = ["MODELLED_EXPECTED_KEYS", "MODELLED_JOINT_KEYS"]

_POINTS = KeyTable(
    "[points], of a modelled joint",
    "DOFs of the joint on both substructures, in the order of the tables `[[law]]`.",
    (
        Key("j", "list of texts, as many as joint DOFs", "Joint DOFs of A."),
        Key("k", "list of texts, as many as joint DOFs", "Joint DOFs of B."),
    ),
)
_VALUES = KeyTable(
    "actual, start, in [[law]]",
    f"Parameters of the law, those that it takes: {takes_in_words()}.",
    LAW_VALUES,
)
_LAW = KeyTable(
    "[[law]]",
    "One table for each joint DOF: its law, the actual parameters, and those from which the fit starts.",
    (
        Key("dof", "text", "Name of the DOF: `y`, `theta_z`, ..."),
        Key("law", one_of(LAW_WORDS), "The law; `rigid`: both sides move alike."),
        Key("actual", "table", "Actual parameters.", "", "required but for `rigid`", _VALUES),
        Key("start", "table", "Where the fit starts.", "", "required but for `rigid`", _VALUES),
        Key("mass", "number, at least 0", "Mass of the joint in this direction, half of it on either side; fitted.",
            "kg, kg m^2", "0"),
    ),
)  # fmt: skip
_MEASURED = KeyTable(
    "[measured]",
    "What is measured: receptances between these DOFs, named `A/...` and `B/...`, with complex noise of each entry.",
    (
        Key("responses", "list of texts", "Where the motion is measured."),
        Key("forces", "list of texts", "Where forces act."),
        Key("noise", "number, above 0", "Level of the noise: 0.02 for 2 %."),
    ),
)
_UNKNOWN = KeyTable(
    "[[unknown]]",
    "A number of a model that is not exactly known: it is fitted with the joint, under a normal prior.",
    (
        Key("substructure", one_of(("A", "B")), "Whose."),
        Key("name", one_of(("youngs_modulus", "density", "loss_factor")), "Which number."),
        Key("value", "number, above 0", "What is believed.", "N/m^2, kg/m^3"),
        Key("std_percent", "number, above 0", "Standard deviation of that belief.", "%"),
        Key("error_percent", "number", "By how much the actual value differs.", "%"),
    ),
)
_ADDED = KeyTable(
    "[[added_mass]]",
    "A mass of a sensor or shaker that the models do not have.",
    (
        Key("dof", "text", "Where, `A/...` or `B/...`."),
        Key("mass", "number, above 0", "Actual mass.", "kg"),
        Key("believed", "number, at least 0", "What is believed.", "kg"),
        Key("std", "number, above 0", "Standard deviation of that belief.", "kg"),
    ),
)
MODELLED_JOINT_KEYS = KeyTable(
    "case.toml of kind modelled-joint",
    "A joint of any laws, identified from simulated FRFs at any points, given the substructures as models.",
    (
        *COMMON_KEYS,
        Key("substructure_a", "table", "Side j of the joint.", inner=SUBSTRUCTURE),
        Key("substructure_b", "table", "Side k of the joint.", inner=SUBSTRUCTURE),
        Key("points", "table", "DOFs of the joint.", inner=_POINTS),
        Key("law", "tables", "The joint.", inner=_LAW),
        Key("measured", "table", "What is measured.", inner=_MEASURED),
        Key("unknown", "tables", "What is not known of the models.", "", "nothing", _UNKNOWN),
        Key("added_mass", "tables", "Masses of sensors and shakers.", "", "none", _ADDED),
        Key("show_hz", "list of numbers", "Frequencies at which stiffness and loss factor are tabulated.", "Hz"),
    ),
)
MODELLED_EXPECTED_KEYS = KeyTable(
    "expected.toml of kind modelled-joint", "Numbers of figures in a source; the file may be missing.", (FIGURES,)
)
