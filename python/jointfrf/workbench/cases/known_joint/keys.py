"""Keys of the files of a case of a known joint, and the case itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Literal, cast

from msgspec import field

from jointfrf.dofs import Parameter
from jointfrf.errors import FileContentError
from jointfrf.frf.bands import Band
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import FloatArray
from jointfrf.substructuring.methods import STIFFNESS_METHODS, StiffnessMethod
from jointfrf.toml.declared import Bands, Keys, NotNegative, Positive, key
from jointfrf.workbench.cases.keys import (
    FITTED,
    LIKE_DOFS,
    METHODS,
    BandKeys,
    BandSet,
    Case,
    CaseKeys,
    ExpectedFrequencies,
    ExpectedKeys,
    JointDofKeys,
    Noise,
    Observed,
    WithActualJoint,
    check_bands,
    check_different,
    check_noises,
    joints_of,
)
from jointfrf.workbench.structures.substructures import (
    BeamKeys,
    BrickBeamKeys,
    ChainKeys,
    MatricesKeys,
    ModelStructure,
    PlateKeys,
    ReceptancesKeys,
    Structure,
)

__all__ = [
    "ExpectedErrors",
    "ExpectedParameters",
    "ExpectedRegions",
    "KnownJointCase",
    "KnownJointExpected",
    "KnownJointKeys",
    "PrintedLines",
    "read_known_joint",
]


class PointKeys(Keys):
    """DOFs of the substructures, in the order of the tables `[[joint]]`.

    Of FRFs, node and direction: `"102:+y"`, `"102:rz"`; a channel measured the other way serves with the opposite sign.
    """

    j: Annotated[tuple[str, ...], key("Joint DOFs of A.", takes=LIKE_DOFS, min_length=1, example=["2:x"])]
    k: Annotated[tuple[str, ...], key("Joint DOFs of B.", takes=LIKE_DOFS, min_length=1, example=["1:x"])]
    r: Annotated[
        tuple[str, ...],
        key("Internal DOFs of A.", takes=LIKE_DOFS, absent="`j`; required by decoupling", min_length=1,
            example=["1:x"]),
    ] = ()  # fmt: skip
    s: Annotated[
        tuple[str, ...],
        key("Internal DOFs of B.", takes=LIKE_DOFS, absent="`k`; required by decoupling", min_length=1,
            example=["2:x"]),
    ] = ()  # fmt: skip


class ObservedKeys(Keys):
    """Observed FRFs of the assembly; by default, the first DOF of r and of s."""

    point: Annotated[Literal["r", "s"], key("Response and force at this point.")]
    dof: Annotated[str, key("Joint DOF whose direction it is.")]
    bands: Annotated[Bands, key("Where errors of regenerated FRFs are counted.", "Hz", absent="all lines")] = ()


class KnownJointKeys(CaseKeys, tag="known-joint"):
    """Two substructures and a joint of known parameters, identified from simulated measurements."""

    tag_absent = "`known-joint`"
    examples = {"frequency": {"first": 0.05, "last": 10.0, "step": 0.05}}  # noqa: RUF012
    substructure_a: Annotated[
        ChainKeys | BeamKeys | PlateKeys | BrickBeamKeys | MatricesKeys | ReceptancesKeys, key("Side j of the joint.")
    ]
    substructure_b: Annotated[
        ChainKeys | BeamKeys | PlateKeys | BrickBeamKeys | MatricesKeys | ReceptancesKeys,
        key("Side k of the joint.", example={"masses": [4.0, 2.0], "stiffness": [2000.0, 2500.0],
                                            "damping": [2.0, 1.0], "ground": "end"}),
    ]  # fmt: skip
    points: Annotated[PointKeys, key("DOFs of the joint, and internal ones.")]
    joint: Annotated[tuple[JointDofKeys, ...], key("The joint.")]
    observed: Annotated[
        tuple[ObservedKeys, ...], key("FRFs that are looked at.", absent="first DOF of r and of s")
    ] = ()
    bands: Annotated[
        tuple[BandKeys, ...],
        key("Sensitive bands; the first set is that of the figures.",
            absent="required by methods that take means over bands"),
    ] = ()  # fmt: skip
    noise: Annotated[tuple[Noise, ...], key("Noise and methods.")]


class _Applied(Keys):
    """A number of a source, by the noise and the method to which it belongs."""

    source: Annotated[str, key("Where the numbers come from: title of the table.")]
    noise: Annotated[str, key("Name of a noise of the case.")]
    method: Annotated[str, key("Method that the case applies to this noise.", choice=METHODS)]


class ExpectedParameters(_Applied):
    """Published parameters of one identification, and the largest errors allowed."""

    bands: Annotated[
        str, key("Name of a set of bands of the case.", absent="required but for `compliance` and `decoupling-fit`")
    ] = ""
    values: Annotated[
        dict[str, float], key("Published values, by the parameter: `k_DOF`, `c_DOF`.", "as the parameters")
    ] = field(default_factory=dict)
    rmse_below: Annotated[dict[str, float], key("Largest root-mean-square error allowed, by the parameter.", "%")] = (
        field(default_factory=dict)
    )


class ExpectedErrors(_Applied, rename={"bands": "band"}):
    """Published errors (4.11), (4.12) of a regenerated FRF in a band."""

    observed: Annotated[str, key("Observed FRF of the case: `s`, `s-Fx`.")]
    bands: Annotated[Bands, key("One of the bands of this FRF.", "Hz", takes="list of one `[low, high]`")]
    amplitude: Annotated[float | None, key("Error (4.11).", "%", absent="not published")] = None
    frequency: Annotated[float | None, key("Error (4.12).", "%", absent="not published")] = None
    offset: Annotated[
        tuple[float, float, float] | None,
        key("Offset of the FRF from its reference point: x, y, z.", "m", absent="at the point"),
    ] = None

    @property
    def band(self) -> Band:
        """The band."""
        return self.bands[0]


class ExpectedRegions(Keys, rename={"name": "parameter"}):
    """Published bands in which an FRF is sensitive to a parameter."""

    source: Annotated[str, key("Where the regions come from: title of the table.")]
    name: Annotated[str, key("Parameter of the joint.", takes="`k_DOF` or `c_DOF`")]
    observed: Annotated[str, key("Observed FRF of the case: `s`, `s-Fx`.")]
    bands: Annotated[Bands, key("The regions.", "Hz")]

    @property
    def parameter(self) -> Parameter:
        """The parameter."""
        return Parameter.parse(self.name)


class PrintedLines(Keys):
    """Comparison of errors of FRFs regenerated from published parameters with the published errors."""

    step: Annotated[Positive, key("Spacing of the lines.", "Hz")]
    amplitude_within_percent: Annotated[NotNegative, key("Largest relative difference of error (4.11).", "%")]
    lines_within: Annotated[NotNegative, key("Largest difference of error (4.12), in lines.")]


class JointFrequencies(ExpectedFrequencies):
    """Natural frequencies of the assembly; both substructures must be models."""

    joint: Annotated[Literal["actual", "initial"], key("Joint of these frequencies.")]


class KnownJointExpected(ExpectedKeys):
    """Expected results of a case; the file may be missing."""

    frequencies: Annotated[tuple[JointFrequencies, ...], key("Natural frequencies.")] = ()
    identified: Annotated[tuple[ExpectedParameters, ...], key("Published parameters.")] = ()
    regenerated: Annotated[tuple[ExpectedErrors, ...], key("Published errors of regenerated FRFs.")] = ()
    regions: Annotated[tuple[ExpectedRegions, ...], key("Published sensitive regions.")] = ()
    printed: Annotated[
        PrintedLines | None,
        key("FRFs regenerated from published parameters; both substructures must be models.", absent="not compared"),
    ] = None

    def frequencies_with(self, joint: str) -> ExpectedFrequencies | None:
        """Return the natural frequencies with the "actual" or the "initial" joint."""
        return next((one for one in self.frequencies if one.joint == joint), None)


@dataclass(frozen=True, kw_only=True)
class KnownJointCase(Case, WithActualJoint):
    """Case of a simulated identification.

    Attributes
    ----------
    a, b : Structure
        Substructures.
    points : mapping of str to tuple of str
        Names of the joint DOFs, "j" in A and "k" in B, and of internal DOFs, "r" in A and "s" in B.
    joint, initial : Joint
        Actual joint and its first estimate.
    observed : tuple of Observed
        Observed FRFs of the assembly.
    band_sets : tuple of BandSet
        Sets of bands; tables use the first.
    noises : tuple of Noise
        Noises, each with its methods.
    expected : KnownJointExpected
        Published numbers.
    """

    a: Structure
    b: Structure
    points: Mapping[str, tuple[str, ...]]
    joint: Joint
    initial: Joint
    observed: tuple[Observed, ...]
    band_sets: tuple[BandSet, ...]
    noises: tuple[Noise, ...]
    expected: KnownJointExpected

    @property
    def models(self) -> tuple[ModelStructure, ModelStructure] | None:
        """Both substructures if both have models, otherwise None."""
        a, b = self.a, self.b
        return (a, b) if isinstance(a, ModelStructure) and isinstance(b, ModelStructure) else None


def read_known_joint(common: Case, keys: KnownJointKeys, expected: KnownJointExpected) -> KnownJointCase:
    """Return the case of its files; raise FileContentError if they are invalid."""
    a, b = (one.structure(common.freq_hz) for one in (keys.substructure_a, keys.substructure_b))
    methods = list(dict.fromkeys(method for noise in keys.noise for method in noise.methods))
    joint, initial = joints_of(keys.joint, next(filter(_begins_with_estimate, methods), ""))
    points = _points(keys.points, a, b, len(joint.dofs), methods)
    check_noises(keys, keys.noise, len(joint.dofs))
    if (averaged := [method for method in methods if method not in FITTED]) and not keys.bands:
        raise keys.missing(["bands"], f"{averaged[0]} takes means over bands")
    check_different(keys, "bands", [one.name for one in keys.bands])
    case = KnownJointCase(
        **vars(common),
        a=a,
        b=b,
        points=points,
        joint=joint,
        initial=initial,
        observed=_observed(keys, joint.dofs, common.freq_hz),
        band_sets=tuple(one.band_set(joint.dofs, common.freq_hz) for one in keys.bands),
        noises=keys.noise,
        expected=expected,
    )
    _check_expected(case)
    return case


def _begins_with_estimate(method: str) -> bool:
    if method in FITTED:
        return method == "decoupling-fit"
    return not {"alpha", "k_initial"}.isdisjoint(STIFFNESS_METHODS[cast(StiffnessMethod, method)].model)


def _points(keys: PointKeys, a: Structure, b: Structure, n: int, methods: Sequence[str]) -> dict[str, tuple[str, ...]]:
    decoupling = [method for method in methods if method.startswith("decoupling")]
    if decoupling and (lacking := [point for point in "rs" if not getattr(keys, point)]):
        raise keys.missing(lacking, f"{decoupling[0]} takes FRFs of internal points")
    points = {"j": keys.j, "k": keys.k, "r": keys.r or keys.j, "s": keys.s or keys.k}
    for point, names in points.items():
        if len(names) != n:
            raise keys.error(point, f"a list of {n} DOFs, as many as the joint has")
    for structure, joint, internal in ((a, "j", "r"), (b, "k", "s")):
        keys.build(partial(structure.check_points, points[joint], points[internal]))
    return points


def _observed(keys: KnownJointKeys, dofs: tuple[str, ...], freq_hz: FloatArray) -> tuple[Observed, ...]:
    found = []
    for one in keys.observed:
        if one.dof not in dofs:
            raise one.error("dof", f"one of {', '.join(dofs)}")
        check_bands(one, "bands", one.bands, freq_hz)
        found.append(Observed(f"{one.point}-{one.dof}", one.point, dofs.index(one.dof), one.bands))
    check_different(keys, "observed", [one.key for one in found], "name the same FRF")
    return tuple(found) or (Observed("r", "r", 0), Observed("s", "s", 0))


def _check_expected(case: KnownJointCase) -> None:
    """Raise an error if `expected.toml` does not match the case."""
    expected, methods = case.expected, {noise.name: noise.methods for noise in case.noises}
    parameters, observed = [one.name for one in case.parameters], {one.key: one.bands for one in case.observed}
    for name in ("frequencies", "printed"):
        if case.models is None and getattr(expected, name):
            why = f"{name} needs models, not receptances, of both substructures"
            raise FileContentError(f"{expected.table.where}: {why}")
    check_different(expected, "frequencies", [one.joint for one in expected.frequencies], "name the same joint")
    for one in (*expected.identified, *expected.regenerated):
        _check_choice(one, "noise", list(methods))
        if one.method not in methods[one.noise]:
            raise one.error("method", f"one of the methods that case.toml applies to {one.noise!r}")
    for table in expected.identified:
        if table.method not in FITTED:
            if not table.bands:
                raise table.missing(["bands"], f"{table.method} takes means over bands")
            _check_choice(table, "bands", [own.name for own in case.band_sets])
        for values in ("values", "rmse_below"):
            for name in getattr(table, values):
                if name not in parameters:
                    raise table.wrong(values, f"unknown parameter {name!r}; the joint has {', '.join(parameters)}")
    for error in expected.regenerated:
        _check_choice(error, "observed", list(observed))
        if len(error.bands) != 1 or error.band not in observed[error.observed]:
            raise error.error("band", f"one of the bands that case.toml names for {error.observed}")
    for region in expected.regions:
        _check_choice(region, "parameter", parameters)
        _check_choice(region, "observed", list(observed))
        check_bands(region, "bands", region.bands, case.freq_hz)


def _check_choice(keys: Keys, name: str, choice: list[str]) -> None:
    if keys.table.content[name] not in choice:
        raise keys.error(name, f"one of {', '.join(choice)}")
