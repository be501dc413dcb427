"""Words that functions and commands accept; this module imports nothing that computes."""

from __future__ import annotations

from typing import Literal, NamedTuple

__all__ = [
    "AMPLITUDE_LAWS",
    "CASE_KINDS",
    "FRF_FORMATS",
    "MAPPING_FIELDS",
    "POWER_OF_I_OMEGA",
    "Arrangement",
    "CardFormat",
    "CrossTerms",
    "DampingTerms",
    "MotionQuantity",
    "StiffnessMethod",
    "UnitSystemName",
    "format_names",
]

#: Terms of K* in addition to its stiffness.
DampingTerms = Literal["none", "viscous", "hysteretic", "both"]
#: Terms that couple the DOFs of a joint: none; perhaps, but not fitted; fitted between the DOFs of each point, none
#: between points; fitted.
CrossTerms = Literal["zero", "ignore", "points", "fit"]
StiffnessMethod = Literal[
    "ismm", "ismm-kj", "inverse-substructuring", "decoupling-rr", "decoupling-rs", "decoupling-sr", "decoupling-ss"
]
CardFormat = Literal["abaqus", "calculix", "nastran", "ansys", "code_aster", "lsdyna", "subdyn"]
UnitSystemName = Literal["SI", "mm-t-s", "mm-kg-ms"]
MotionQuantity = Literal["displacement", "velocity", "acceleration"]
#: Designs of a study.
Arrangement = Literal["full", "one-at-a-time"]

#: Number of differentiations of a receptance in time that give the quantity.
POWER_OF_I_OMEGA = {"receptance": 0, "mobility": 1, "accelerance": 2}
#: Laws over amplitude.
AMPLITUDE_LAWS = ("constant", "power", "jenkins", "iwan", "bouc-wen")
#: Kinds of cases, each a package of `jointfrf.workbench.cases`; the first is the default.
CASE_KINDS = ("known-joint", "bolted-lap", "modelled-joint")
#: Fields of `jointfrf.io.FrfMapping`.
MAPPING_FIELDS = (
    "freq_hz",
    "h",
    "responses",
    "excitations",
    "response_nodes",
    "response_directions",
    "excitation_nodes",
    "excitation_directions",
    "direction",
    "components",
    "axes",
    "quantity",
    "unit",
    "coherence",
    "averages",
    "real",
    "imag",
    "magnitude",
    "phase_deg",
    "phase_rad",
)


class _FormatName(NamedTuple):
    """Name of a format of FRFs, its usual suffixes, the recommended one first, and whether it is written."""

    name: str
    suffixes: tuple[str, ...]
    is_written: bool = True


#: Formats of FRFs by their modules in `jointfrf.io`. The order counts if a file has no mark, and for MATLAB 7.3, which
#: is HDF5 inside.
FRF_FORMATS = {
    "uff": _FormatName("Universal File", (".uff", ".unv")),
    "mat_file": _FormatName("MATLAB", (".mat",)),
    "npz_file": _FormatName("NPZ", (".npz",)),
    "npy_file": _FormatName("NPY", (".npy",), is_written=False),
    "hdf5_file": _FormatName("HDF5", (".h5", ".hdf5")),
    "csv_file": _FormatName("CSV", (".csv", ".txt")),
}


def format_names(*, written: bool = False) -> str:
    """Return the names of all formats with their suffixes, or of those that are written, as part of a sentence."""
    chosen = [each for each in FRF_FORMATS.values() if each.is_written or not written]
    names = [f"{each.name} ({' '.join(each.suffixes)})" for each in chosen]
    return f"{', '.join(names[:-1])} {'or' if written else 'and'} {names[-1]}"
