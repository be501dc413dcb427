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
    """Sensitivities of the observed FRFs to a joint, and the proposed bands.

    Attributes
    ----------
    sensitivities : dict
        Sensitivity by the key of an observed FRF.
    proposals : dict
        Proposed bands, Hz, by the key of an observed FRF and Parameter.
    """

    sensitivities: dict[str, Sensitivity]
    proposals: dict[tuple[str, Parameter], list[Band]]


def sensitive_bands(case: KnownJointCase, exact: Exact, joint: Joint, h_c: ComplexArray) -> SensitiveBands:
    """Return sensitivities and proposed bands of all observed FRFs.

    Parameters
    ----------
    case : KnownJointCase
        Case with the observed FRFs.
    exact : Exact
        Receptances of the substructures.
    joint : Joint
        Actual joint, or its first estimate.
    h_c : ndarray, shape (n_freq, 4 n, 4 n)
        Receptance of the assembly with this joint, m/N; DOFs in the order of `Exact`.

    Returns
    -------
    SensitiveBands
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
        Case with its keys.
    exact : Exact
        FRFs without noise.
    n_realisations : int
        Number of realisations of each noise.
    modes : dict
        ModeShapes with the ``"initial"`` and the ``"actual"`` joint; empty without models.
    sensitive : dict
        SensitiveBands with the ``"initial"`` and the ``"actual"`` joint. Before the identification, a user has only
        the first estimate.
    identified : list of Identified
        Joints by noise, method and set of bands.
    regenerated : list of RegeneratedFrf
        FRFs regenerated from the identified joints.
    printed : list of PrintedErrors
        Errors of FRFs regenerated from published parameters.
    noise_free : dict
        NoiseFree by method.
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
    """Return the result of a case; the work runs in the processes that also compute the realisations."""
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
