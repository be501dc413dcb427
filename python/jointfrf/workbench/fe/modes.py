"""Modes of a structure: Universal Files (datasets 55, 2414), named arrays of sdypy-EMA, pyOMA2 and scripts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from jointfrf.dofs import DIRECTIONS
from jointfrf.errors import FileContentError
from jointfrf.files import ReadLimit, check_file, damage_named, head_of
from jointfrf.io.npz_file import npz_fields
from jointfrf.io.uff_axes import node_axes
from jointfrf.io.uff_file import UniversalFile, name_some
from jointfrf.io.units import ModelUnits
from jointfrf.kernel.arguments import ComplexArray, FloatArray

__all__ = ["ModesFile", "read_modes"]

#: Names of arrays, in small letters, as programs and scripts have them.
_KNOWN = {
    "poles": ("poles", "pole"),
    "frequency": ("nat_freq", "fn", "frequencies", "frequency", "natural_frequencies", "freq_hz"),
    "damping": ("nat_xi", "xi", "damping_ratios", "damping_ratio", "damping", "zeta"),
    "residues": ("residues", "a", "modal_constants"),
    "shapes": ("shapes", "phi", "mode_shapes", "modes"),
    "modal_mass": ("modal_mass", "modal_masses"),
    "reference": ("driving_point", "reference"),
    "lower": ("lr", "lower_residual", "lower_residuals"),
    "upper": ("ur", "upper_residual", "upper_residuals"),
    "dofs": ("dofs", "channels", "names"),
}
#: Modes below are rigid motions, Hz: FE programs give them as rounding of zero.
_RIGID_HZ = 1e-2
#: Columns of a whole and of a real number where no blanks are between them; words of a value by the kind of data.
_WHOLE, _REAL, _WORDS = 10, 13, {2: 1, 4: 1, 5: 2, 6: 2}
#: Normal modes, complex modes by displacement.
_NORMAL, _COMPLEX = 2, 3
#: Least motion of the driving point of a mode, as a share of its largest motion.
_SEEN = 1e-6


@dataclass
class ModesFile:
    """Modes of a file.

    Attributes
    ----------
    frequency, damping : ndarray, shape (m,)
        Natural frequencies, Hz, and damping ratios; NaN if the file has no damping.
    shapes : ndarray, shape (n, m)
        Real or complex mode shapes; the residue of a mode is shape shape^T / scale, or over modal mass and 2 i w_d.
    modal_mass : ndarray, shape (m,), or None
        Modal mass of normal modes.
    scale : ndarray, shape (m,), or None
        Modal A of complex modes.
    dofs : tuple of str
        Names of the DOFs; empty if the file does not contain them.
    lower, upper : ndarray, shape (n, n), or None
        Lower and upper residuals.
    notes : list of str
        Descriptions of unusable content.
    has_nodes : bool
        Whether the file also contains places of nodes.
    """

    frequency: FloatArray
    damping: FloatArray
    shapes: NDArray[Any]
    modal_mass: FloatArray | None = None
    scale: ComplexArray | None = None
    dofs: tuple[str, ...] = ()
    lower: FloatArray | None = None
    upper: FloatArray | None = None
    notes: list[str] = field(default_factory=list)
    has_nodes: bool = False

    def poles(self, damping_ratio: float = 0.0) -> ComplexArray:
        """Return the poles of the upper half plane, rad/s; with a damping ratio for modes that have none."""
        zeta = np.where(np.isnan(self.damping), damping_ratio, self.damping)
        omega: FloatArray = 2 * np.pi * self.frequency
        return np.asarray(omega * (-zeta + 1j * np.sqrt(1 - zeta**2)))

    @property
    def is_rigid(self) -> NDArray[np.bool_]:
        """Which modes are rigid motions."""
        return self.frequency < _RIGID_HZ


def read_modes(path: Path, limit_gb: float | None = None, units: ModelUnits | None = None) -> ModesFile:
    """Return the modes of a file.

    Parameters
    ----------
    path : Path
        Path of a Universal File with datasets 55 or 2414 of modes, or of an NPZ file.
    limit_gb : float, optional
        Limit of memory in GB, see `jointfrf.io.read_frfs`.
    units : ModelUnits, optional
        Units of a Universal File without dataset 164.

    Raises
    ------
    FileContentError
        It cannot be read, has no units, or contains no modes whose scale is known.
    """
    check_file(path, limit_gb)
    head, limit = head_of(path, limit_gb), ReadLimit(path, limit_gb)
    if head.startswith(b"PK"):
        found = _of_arrays(path, npz_fields(path, limit))
    else:
        limit.take(12 * path.stat().st_size)  # lines, words and numbers of text
        found = _of_universal(UniversalFile(path), units)
    _check(path, found)
    return found


def _check(path: Path, found: ModesFile) -> None:
    """Raise an error for numbers that are none, or damping that is not that of a structure."""
    parts = [one for one in vars(found).values() if isinstance(one, np.ndarray) and one is not found.damping]
    if not all(np.isfinite(one).all() for one in parts) or (found.frequency < 0).any():
        raise FileContentError(f"{path} contains modes with numbers that are not finite, or negative frequencies")
    if (abs(found.damping) >= 1).any() or (found.damping < 0).any():
        raise FileContentError(f"{path} contains modes with damping ratios that are not between 0 and 1")
    for name, scale in (("modal mass", found.modal_mass), ("modal A", found.scale)):
        if scale is not None and not scale.all():
            number = int(np.argmin(abs(scale))) + 1
            raise FileContentError(f"{path}: mode {number} has no {name}, so that its shape has no scale")
    if found.modal_mass is not None and (found.modal_mass < 0).any():
        raise FileContentError(f"{path} contains negative modal masses")


def _of_universal(file: UniversalFile, units: ModelUnits | None) -> ModesFile:
    """Return the modes of a Universal File, in SI units."""
    modes = []
    for number in file.datasets(55, 2414):
        with file.damage_named(number):
            read = _dataset_55 if file.types[number - 1] == 55 else _dataset_2414
            mode = read(file.records(number))
        if mode is None or mode.get("is_conjugate"):  # conjugates are added anyway
            continue
        system = file.unit_system(number)
        system = units.system if system is None and units is not None else system
        if system is None:
            raise file.error("has modes without units (there is no dataset 164); give units=SI, mm-t-s or mm-kg-ms")
        # Shapes are motions, modal masses and modal A twice a kinetic energy: kg m^2.
        length, force = 1 / system.length, 1 / system.force
        mode["shape"] = {dof: value * (length if dof.rpartition(":")[2] in DIRECTIONS[:3] else 1.0)
                         for dof, value in mode["shape"].items()}  # fmt: skip
        mode["scale"] *= force * length
        modes.append(mode)
    if not modes:
        raise file.error("contains no modes: no dataset 55 or 2414 of normal or complex modes")
    kinds = {mode["kind"] for mode in modes}
    dofs = tuple(modes[0]["shape"])
    if len(kinds) > 1 or any(set(mode["shape"]) != set(dofs) for mode in modes):
        raise file.error("contains modes of different kinds, or of different nodes; write one kind for all nodes")
    shapes = np.array([[mode["shape"][dof] for mode in modes] for dof in dofs])
    dofs, shapes = _in_global_axes(file, dofs, shapes)
    scale = np.array([mode["scale"] for mode in modes])
    frequency, damping = (np.array([mode[name] for mode in modes]) for name in ("frequency", "damping"))
    more: dict[str, Any] = {"dofs": dofs, "notes": file.notes(), "has_nodes": bool(file.datasets(15, 2411))}
    if kinds == {_NORMAL}:
        return ModesFile(frequency, damping, shapes, modal_mass=scale.real, **more)
    return ModesFile(frequency, damping, shapes, scale=scale.astype(complex), **more)


def _in_global_axes(
    file: UniversalFile, dofs: tuple[str, ...], shapes: NDArray[Any]
) -> tuple[tuple[str, ...], NDArray[Any]]:
    """Turn the motions of nodes that have axes of their own; where these are unknown, directions are ``local_x``."""
    found, names = shapes.copy(), list(dofs)
    number = {dof: i for i, dof in enumerate(dofs)}
    axes = node_axes(file, {int(dof.partition(":")[0]) for dof in dofs})
    for node, turn in axes.items():
        for three in (DIRECTIONS[:3], DIRECTIONS[3:]):
            own = [number[f"{node}:{way}"] for way in three if f"{node}:{way}" in number]
            if turn is None:
                names = [f"{node}:local_{three[own.index(i)]}" if i in own else name for i, name in enumerate(names)]
            elif own:
                found[own] = turn.T @ shapes[own]
    lost = [node for node, turn in axes.items() if turn is None]
    if lost:
        what = f"directions at {name_some('node', lost)} are local, named local_x, ...: their axes are not known"
        file.note(what, *file.datasets(15, 2411))
    return tuple(names), found


def _dataset_55(records: list[str]) -> dict[str, Any] | None:
    """Return one mode, or None if the dataset contains something else."""
    _, kind, _, _, data, values = _integers(records[5])[:6]
    words = _numbers(records[7])
    return _mode(kind, words[:4], words[:4]) | {"shape": _shape(records[8:], data, values)} if _is_mode(kind) else None


def _dataset_2414(records: list[str]) -> dict[str, Any] | None:
    """Return one mode, or None if the dataset contains something else, or no values at nodes."""
    _, kind, _, _, data, values = _integers(records[8])[:6]
    if not _is_mode(kind) or _integers(records[2])[0] != 1:
        return None
    _, frequency, _, *normal = _numbers(records[11])
    return _mode(kind, [frequency, *normal], _numbers(records[12])) | {"shape": _shape(records[13:], data, values)}


def _is_mode(kind: int) -> bool:
    return kind in (_NORMAL, _COMPLEX)


def _mode(kind: int, normal: list[float], complex_one: list[float]) -> dict[str, Any]:
    """Return the fields of a mode of a dataset, without its shape.

    Parameters
    ----------
    kind : int
    normal : list of float
        Frequency in Hz, modal mass, viscous damping ratio, hysteretic damping.
    complex_one : list of float
        Real and imaginary part of eigenvalue and modal A.
    """
    if kind == _NORMAL:
        frequency, mass, viscous, hysteretic = normal[:4]
        damping = viscous if viscous > 0 else hysteretic / 2 if hysteretic > 0 else np.nan
        return {"kind": kind, "frequency": frequency, "damping": damping, "scale": mass}
    pole, modal_a = complex(*complex_one[:2]), complex(*complex_one[2:4])
    damping = -pole.real / abs(pole) if pole else 0.0
    return {"kind": kind, "frequency": abs(pole) / (2 * np.pi), "damping": damping, "scale": modal_a,
            "is_conjugate": pole.imag < 0}  # fmt: skip


def _shape(records: list[str], data: int, values: int) -> dict[str, complex | float]:
    """Return the motion of each DOF: records of node, then values of it."""
    if data not in _WORDS or values not in (3, 6):
        raise ValueError("not three or six values of a node")
    shape: dict[str, complex | float] = {}
    count, at = values * _WORDS[data], 0
    while at < len(records):
        node, at = _integers(records[at])[0], at + 1
        entry: list[float] = []
        while len(entry) < count:
            entry += _numbers(records[at])
            at += 1
        own = entry if _WORDS[data] == 1 else [complex(*entry[i : i + 2]) for i in range(0, count, 2)]
        shape |= {f"{node}:{direction}": value for direction, value in zip(DIRECTIONS, own, strict=False)}
    if not shape:
        raise ValueError("no nodes")
    return shape


def _integers(line: str) -> list[int]:
    return [int(word) for word in _words(line, _WHOLE, int)]


def _numbers(line: str) -> list[float]:
    return [float(word) for word in _words(line, _REAL, float)]


def _words(line: str, width: int, kind: type[int | float]) -> list[str]:
    """Return the numbers of a line, between blanks; by columns where numbers touch."""
    words = line.split()
    try:
        for word in words:
            kind(word)
    except ValueError:
        text = line.rstrip()
        return [text[at : at + width] for at in range(0, len(text), width)]
    return words


def _of_arrays(path: Path, fields: Mapping[str, NDArray[Any]]) -> ModesFile:
    """Return the modes of named arrays, in SI units."""
    lowered = {name.lower(): value for name, value in fields.items()}
    own = {field: next((lowered[name] for name in names if name in lowered), None) for field, names in _KNOWN.items()}
    with damage_named(path, "a file of modes", AttributeError, IndexError):
        frequency, damping = _frequencies(path, own)
        count = frequency.size
        dofs = () if own["dofs"] is None else tuple(str(name) for name in np.ravel(own["dofs"]))
        if own["residues"] is not None:
            residues = np.asarray(own["residues"], complex)
            shapes, reference = _factors(path, residues, own["reference"])
            mass, scale = None, np.ones(count, complex)
        elif own["shapes"] is not None:
            shapes, reference = np.asarray(own["shapes"]), None
            if own["modal_mass"] is None:
                raise FileContentError(
                    f"{path} contains shapes without modal_mass, so without a scale; add modal_mass, 1 for each mode "
                    "of unit modal mass"
                )
            mass, scale = np.broadcast_to(np.asarray(own["modal_mass"], float), (count,)).copy(), None
        else:
            raise FileContentError(
                f"{path} must contain residues, or shapes and modal_mass; it contains {', '.join(fields)}"
            )
    if shapes.ndim != 2 or shapes.shape[1] != count:
        size = " x ".join(map(str, shapes.shape))
        raise FileContentError(f"{path}: shapes or residues must be DOFs x {count} modes, not {size}")
    found = ModesFile(frequency, damping, shapes, mass, scale, dofs)
    found.lower, found.upper = (_residual(path, found, name, own[name], reference) for name in ("lower", "upper"))
    return found


def _frequencies(path: Path, own: Mapping[str, NDArray[Any] | None]) -> tuple[FloatArray, FloatArray]:
    """Return natural frequencies, Hz, and damping ratios."""
    if own["poles"] is not None:
        poles = np.asarray(own["poles"], complex).ravel()
        if (poles.imag < 0).any():
            raise FileContentError(f"{path} must contain poles of the upper half plane only, in rad/s")
        size = np.where(poles == 0, 1, abs(poles))
        hertz: FloatArray = np.asarray(abs(poles) / (2 * np.pi), float)
        return hertz, np.asarray(-poles.real / size, float)
    if own["frequency"] is None:
        raise FileContentError(f"{path} must contain poles, or frequencies and damping")
    frequency: FloatArray = np.asarray(own["frequency"], float).ravel()
    damping = own["damping"]
    none = np.full(frequency.size, np.nan)
    return frequency, none if damping is None else np.broadcast_to(
        np.asarray(damping, float).ravel(), none.shape
    ).copy()


def _factors(path: Path, residues: ComplexArray, reference: NDArray[Any] | None) -> tuple[ComplexArray, int | None]:
    """Return shapes psi with residues psi psi^T, and the driving point of a single column."""
    if residues.ndim == 3:
        if residues.shape[0] != residues.shape[1]:
            raise FileContentError(f"{path}: residues must be DOFs x modes, or DOFs x DOFs x modes")
        at = np.argmax(abs(np.einsum("iim->im", residues)), axis=0)
        columns = residues[:, at, np.arange(residues.shape[2])]
        return columns / np.sqrt(columns[at, np.arange(at.size)]), None
    if reference is None or np.size(reference) != 1:
        raise FileContentError(f"{path} must contain driving_point, the row of the force counted from 0")
    point = int(np.ravel(reference)[0])
    if not 0 <= point < len(residues):
        raise FileContentError(f"{path}: driving_point must be one of its {len(residues)} rows, from 0")
    weak = abs(residues[point]) <= _SEEN**2 * abs(residues).max(axis=0)
    if weak.any():
        raise FileContentError(f"{path}: mode {int(np.argmax(weak)) + 1} does not move its driving point")
    return residues / np.sqrt(residues[point]), point


def _residual(
    path: Path, found: ModesFile, name: str, given: NDArray[Any] | None, reference: int | None
) -> FloatArray | None:
    """Return a matrix of residuals; a single column also fills its row, and missing residuals are noted."""
    if given is None:
        return None
    n = len(found.shapes)
    own: FloatArray = np.asarray(np.real(given), float)
    if own.shape == (n, n):
        return np.asarray((own + own.T) / 2)
    if own.shape != (n,) or reference is None:
        raise FileContentError(f"{path}: {name} residuals must be one for each DOF, or DOFs x DOFs")
    whole = np.zeros((n, n))
    whole[reference] = whole[:, reference] = own
    found.notes.append(f"{name} residuals are known of FRFs with the driving point only, and zero of all others")
    return whole
