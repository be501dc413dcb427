"""Results of a case of a known joint: modes, sensitivities, identified parameters, regenerated FRFs."""

from __future__ import annotations

from dataclasses import dataclass

from jointfrf.dofs import Parameter
from jointfrf.frf.bands import Band
from jointfrf.identification.sensitivity import Sensitivity, propose_bands, sensitivity
from jointfrf.joint import Joint
from jointfrf.kernel.arguments import ComplexArray
from jointfrf.workbench.cases.kind import Computed
from jointfrf.workbench.cases.known_joint.exact import Exact, NoiseFree, noise_free_errors
from jointfrf.workbench.cases.known_joint.keys import KnownJointCase
from jointfrf.workbench.cases.known_joint.modes import ModeShapes, modes_of_case
from jointfrf.workbench.cases.known_joint.realisations import Identified, identified_joints
from jointfrf.workbench.cases.known_joint.regenerate import (
    PrintedErrors,
    RegeneratedFrf,
    printed_errors,
    regenerate_all,
)

__all__ = ["KnownJointResult", "SensitiveBands", "known_joint_result", "sensitive_bands"]


@dataclass(frozen=True)
class SensitiveBands:
    """Sensitivities of the observed FRFs to a joint, and the bands that follow.

    Attributes
    ----------
    sensitivities : dict
        Key of an observed FRF to Sensitivity.
    proposals : dict
        Key of an observed FRF, and Parameter, to bands, Hz.
    """

    sensitivities: dict[str, Sensitivity]
    proposals: dict[tuple[str, Parameter], list[Band]]


def sensitive_bands(case: KnownJointCase, exact: Exact, joint: Joint, h_c: ComplexArray) -> SensitiveBands:
    """Sensitivities and proposed bands of all observed FRFs.

    Parameters
    ----------
    case : KnownJointCase
    exact : Exact
    joint : Joint
        The actual joint, or its first estimate.
    h_c : ndarray, shape (n_freq, 4 n, 4 n)
        Receptance of the assembly with this joint, DOFs as in `Exact`, m/N.
    """
    j, k = (list(range(exact.where(point).start, exact.where(point).stop)) for point in "jk")
    found = {}
    for one in case.observed:
        at = exact.at(one)
        found[one.key] = sensitivity(exact.freq_hz, h_c, joint, j, k, at, at)
    proposals = {
        (key, parameter): propose_bands(exact.freq_hz, change)
        for key, own in found.items()
        for parameter, change in zip(case.parameters, own.change, strict=True)
    }
    return SensitiveBands(found, proposals)


@dataclass(frozen=True)
class KnownJointResult:
    """Results of a case of a known joint.

    Attributes
    ----------
    case : KnownJointCase
    exact : Exact
    n_realisations : int
    modes : dict
        ``"initial"`` and ``"actual"`` joint to ModeShapes; empty without models.
    sensitive : dict
        ``"initial"`` and ``"actual"`` joint to SensitiveBands: before the identification, a user has the first
        estimate only.
    identified : list of Identified
    regenerated : list of RegeneratedFrf
    printed : list of PrintedErrors
        FRFs regenerated from published parameters.
    noise_free : dict
        Method to NoiseFree.
    """

    case: KnownJointCase
    exact: Exact
    n_realisations: int
    modes: dict[str, ModeShapes]
    sensitive: dict[str, SensitiveBands]
    identified: list[Identified]
    regenerated: list[RegeneratedFrf]
    printed: list[PrintedErrors]
    noise_free: dict[str, NoiseFree]


def known_joint_result(computed: Computed[KnownJointCase, Exact]) -> KnownJointResult:
    """Return the result of a case whose realisations are under way; processes do all this at the same time."""
    case, exact, workers = computed.case, computed.frfs, computed.workers
    initial = workers.begin(sensitive_bands, case, exact, case.initial, exact.h_initial)
    actual = workers.begin(sensitive_bands, case, exact, case.joint, exact.h_c)
    modes = workers.begin(modes_of_case, case)
    printed = workers.begin(printed_errors, case)
    noise_free = workers.begin(noise_free_errors, exact, case.joint.dynamic_stiffness(case.freq_hz))
    identified = identified_joints(case, computed.estimates())
    return KnownJointResult(
        case=case,
        exact=exact,
        n_realisations=computed.n_realisations,
        modes=modes(),
        sensitive={"initial": initial(), "actual": actual()},
        identified=identified,
        regenerated=regenerate_all(exact, identified, case.observed, workers),
        printed=printed(),
        noise_free=noise_free(),
    )
