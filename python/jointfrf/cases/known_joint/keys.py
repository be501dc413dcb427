"""Keys of `case.toml` and `expected.toml` of a case of a known joint."""

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
from jointfrf.cases.fitting import METHODS
from jointfrf.frf.frf_set import POWER_OF_I_OMEGA
from jointfrf.models.beam import BeamElement, End
from jointfrf.models.model import Ground
from jointfrf.solids.brick_beam import Face
from jointfrf.toml.keys import Key, KeyTable

__all__ = ["EXPECTED_KEYS", "KNOWN_JOINT_KEYS", "SUBSTRUCTURE"]


def _of(model: str, about: str, *keys: Key) -> KeyTable:
    choice = "`chain`, `beam`, `brick-beam`, `matrices` or `receptances`"
    return KeyTable(
        f'[substructure_a], [substructure_b] with model = "{model}"', about, (Key("model", choice, "Which."), *keys)
    )


_LOSS_FACTOR = MATERIAL_KEYS[-1]
_ENDS = Key("ends", f"two, each {one_of(End)}", "How the ends are held.")
_CHAIN = _of(
    "chain",
    'Lumped masses in a line; DOFs `"1:x"`, `"2:x"`, ...',
    Key("masses", "list of numbers", "Masses, from one end to the other.", "kg"),
    Key("stiffness", "list of numbers", "Springs in their order, that to the ground included.", "N/m"),
    Key("damping", "list of numbers", "Dashpots beside the springs.", "N s/m"),
    Key("ground", one_of(Ground), "Which ends are held by a spring."),
    _LOSS_FACTOR,
)
_BEAM = _of(
    "beam",
    'Beam elements in a line, bending in one plane; DOFs `"1:y"`, `"1:theta"`, ... without those that are held.',
    Key("length", "number, above 0", "Length.", "m"),
    Key("elements", "whole number, at least 1", "Number of elements."),
    Key("element", one_of(BeamElement), "Theory of the elements."),
    Key("axial", "true or false", "Whether nodes move along the beam, too (`x`)."),
    _ENDS,
    Key("youngs_modulus", "number, above 0", "Young's modulus.", "N/m^2"),
    Key("density", "number, above 0", "Density.", "kg/m^3"),
    Key("width", "number, above 0", "Width of the section.", "m"),
    Key("height", "number, above 0", "Height of the section, in the plane of bending.", "m"),
    Key("poisson", "number", "Poisson's ratio; only of `shear-flexible` elements.", "", "required for these"),
    _LOSS_FACTOR,
)
_HOLE = KeyTable(
    "hole, in a brick-beam",
    "A bolt hole whose ring follows a reference point with six DOFs, `hole:x` to `hole:theta_z`.",
    (
        Key("position", "number, at least 0", "Distance from the first end.", "m"),
        Key("radius", "number, at least 0", "Radius of the hole.", "m"),
        Key("patch_radius", "number, at least 0", "Outer radius of the ring.", "m"),
        Key("face", one_of(Face), "Side of the beam where the ring lies."),
    ),
)
_BRICK_BEAM = _of(
    "brick-beam",
    'A beam of brick elements along z; DOFs `"hole:x"`, and six of each section that is observed.',
    Key("length", "number, above 0", "Length along z.", "m"),
    Key("width", "number, above 0", "Width along x.", "m"),
    Key("height", "number, above 0", "Height along y.", "m"),
    *MATERIAL_KEYS,
    _ENDS,
    PRESET,
    Key("origin", "list of 3 numbers", "Middle of the lower edge of the first end; the beam lies above it.", "m"),
    Key("hole", "table", "A bolt hole.", "", "none", _HOLE),
    Key("observed", "table of numbers", "Sections whose mean motion is observed: name, and distance from the first "
        "end; `r` gives `\"r:x\"` to `\"r:theta_z\"`.", "m", "none"),
)  # fmt: skip
_FILE = "name of a file"
_MATRICES = _of(
    "matrices",
    "Matrices of your own: Matrix Market (`.mtx`), or NPZ of `scipy.sparse.save_npz` or `numpy.savez` with one array, "
    "or with arrays named like the keys here. Files stand relative to `case.toml`.",
    Key("stiffness", _FILE, "K, symmetric, real.", "N/m"),
    Key("mass", _FILE, "M, symmetric, real.", "kg"),
    Key("damping", _FILE, "Viscous damping C.", "N s/m", "none"),
    Key("structural_damping", _FILE, "Structural damping H, i H added to K.", "N/m", "none"),
    Key("loss_factor", "number, at least 0", "Loss factor eta of the stiffness, K (1 + i eta).", "", "0"),
    Key("dofs", "list of texts, or name of a text file", 'Names of the DOFs in the order of the rows: `"12:y"`. In a '
        "file, one a line: `12:y`, or node and number of the DOF (1 to 6): `12 2`; `#` begins a comment."),
)  # fmt: skip
_RECEPTANCES = _of(
    "receptances",
    "FRFs of the substructure, measured or computed elsewhere, in any format that `jointfrf.io.read_frfs` reads. "
    "They must be there between all DOFs of `[points]` on "
    "this side, on the lines of `[frequency]`. Natural frequencies and mode shapes are left out of the report.",
    Key("file", "name of a file of FRFs", "Mobilities and accelerances become receptances."),
    Key("quantity", one_of(POWER_OF_I_OMEGA), "What the FRFs are, where the file does not say.", "", "by the file"),
    Key(
        "force_quantity",
        "true or false",
        "`true`: `quantity` holds also where the file says something else.",
        "",
        "`false`",
    ),
)
SUBSTRUCTURE = KeyTable(
    "[substructure_a], [substructure_b]",
    "The two structures that the joint connects.",
    (),
    {"chain": _CHAIN, "beam": _BEAM, "brick-beam": _BRICK_BEAM, "matrices": _MATRICES, "receptances": _RECEPTANCES},
    "model",
)
_DOFS_OF = "list of texts, as many as joint DOFs"
_POINTS = KeyTable(
    "[points]",
    'DOFs of the substructures, in the order of the tables `[[joint]]`. Of FRFs, node and direction: `"102:+y"`, '
    '`"102:rz"`; a channel measured the other way serves with the opposite sign.',
    (
        Key("j", _DOFS_OF, "Joint DOFs of A."),
        Key("k", _DOFS_OF, "Joint DOFs of B."),
        Key("r", _DOFS_OF, "Internal DOFs of A."),
        Key("s", _DOFS_OF, "Internal DOFs of B."),
    ),
)
_OBSERVED = KeyTable(
    "[[observed]]",
    "FRFs of the assembly that are looked at; without any, the first DOF of r and of s.",
    (
        Key("point", one_of(("r", "s")), "Response and force at this point."),
        Key("dof", "text", "Joint DOF whose direction it is."),
        Key("bands", "list of `[low, high]`", "Where errors of regenerated FRFs are counted.", "Hz", "all lines"),
    ),
)
_BANDS = KeyTable(
    "[[bands]]",
    "Sensitive bands over which K\\* is averaged; one or several sets, the first is that of the figures.",
    DOF_BANDS,
)
KNOWN_JOINT_KEYS = KeyTable(
    "case.toml of kind known-joint",
    "Two substructures and a joint of known parameters, identified from simulated measurements.",
    (
        *COMMON_KEYS,
        Key("substructure_a", "table", "Side j of the joint.", inner=SUBSTRUCTURE),
        Key("substructure_b", "table", "Side k of the joint.", inner=SUBSTRUCTURE),
        Key("points", "table", "DOFs of the joint, and internal ones.", inner=_POINTS),
        Key("joint", "tables", "The joint.", inner=JOINT),
        Key("observed", "tables", "FRFs that are looked at.", "", "first DOF of r and of s", _OBSERVED),
        Key("bands", "tables", "Sensitive bands.", inner=_BANDS),
        Key("noise", "tables", "Noise and methods.", inner=NOISE),
    ),
)
_BY_PARAMETER = (
    Key("k_DOF", "number", "Of the stiffness of a joint DOF.", "", "none"),
    Key("c_DOF", "number", "Of its damping.", "", "none"),
)
_APPLIED = (
    Key("source", "text", "Where the numbers come from: title of the table."),
    Key("noise", "text", "Name of a noise of the case."),
    Key("method", one_of(METHODS), "One that the case applies to this noise."),
)
_IDENTIFIED = KeyTable(
    "[[identified]]",
    "Published parameters of one identification.",
    (
        *_APPLIED,
        Key("bands", "text", "Name of a set of bands of the case.", "",
            "required but for `compliance` and `decoupling-fit`"),
        Key("values", "table", "Published values.", "as the parameters", "none",
            KeyTable("values, in [[identified]]", "Published values of the parameters.", _BY_PARAMETER)),
        Key("rmse_below", "table", "Largest root-mean-square error allowed.", "%", "none",
            KeyTable("rmse_below, in [[identified]]", "Largest errors of the parameters, %.", _BY_PARAMETER)),
    ),
)  # fmt: skip
_REGENERATED = KeyTable(
    "[[regenerated]]",
    "Published errors of a regenerated FRF.",
    (
        *_APPLIED,
        Key("observed", "text", "An FRF that the case looks at: `s`, `s-Fx`."),
        Key("band", "list of one `[low, high]`", "One of its bands.", "Hz"),
        Key("amplitude", "number", "Error (4.11).", "%", "not published"),
        Key("frequency", "number", "Error (4.12).", "%", "not published"),
        Key("offset", "list of 3 numbers", "Where the FRF is seen, from its reference point.", "m", "at the point"),
    ),
)
_REGIONS = KeyTable(
    "[[regions]]",
    "Where the source finds an FRF sensitive to a parameter.",
    (
        Key("source", "text", "Where the regions come from: title of the table."),
        Key("parameter", "`k_DOF` or `c_DOF`", "Parameter of the joint."),
        Key("observed", "text", "An FRF that the case looks at: `s`, `s-Fx`."),
        Key("bands", "list of `[low, high]`", "The regions.", "Hz"),
    ),
)
_PRINTED = KeyTable(
    "[printed]",
    "How errors of FRFs regenerated from published parameters are compared with the published errors.",
    (
        Key("step", "number, above 0", "Spacing of the lines.", "Hz"),
        Key("amplitude_within_percent", "number, at least 0", "How far error (4.11) may be off, of itself.", "%"),
        Key("lines_within", "number, at least 0", "How many lines error (4.12) may be off."),
    ),
)
_FREQUENCIES = KeyTable(
    "[[frequencies]]",
    "Natural frequencies of the assembly; both substructures must be models.",
    (Key("joint", one_of(("actual", "initial")), "With which joint."), *EXPECTED_FREQUENCIES),
)
EXPECTED_KEYS = KeyTable(
    "expected.toml of kind known-joint",
    "What is known about a case beforehand; the file may be missing.",
    (
        Key("frequencies", "tables", "Natural frequencies.", "", "none", _FREQUENCIES),
        Key("identified", "tables", "Published parameters.", "", "none", _IDENTIFIED),
        Key("regenerated", "tables", "Published errors of regenerated FRFs.", "", "none", _REGENERATED),
        Key("regions", "tables", "Published sensitive regions.", "", "none", _REGIONS),
        Key("printed", "table", "FRFs regenerated from published parameters; both substructures must be models.", "",
            "not compared", _PRINTED),
        FIGURES,
    ),
)  # fmt: skip
