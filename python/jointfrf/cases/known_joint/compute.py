"""Everything a case yields: exact FRFs, natural frequencies, sensitivities, identified parameters, regenerated FRFs."""

from __future__ import annotations

from dataclasses import dataclass

from jointfrf.cases.known_joint.exact import Exact, exact_frfs
from jointfrf.cases.known_joint.modes import ModeShapes, modes_of_case
from jointfrf.cases.known_joint.noise_free import NoiseFree, noise_free_errors
from jointfrf.cases.known_joint.printed import PrintedErrors, printed_errors
from jointfrf.cases.known_joint.read import KnownJointCase
from jointfrf.cases.known_joint.regenerate import RegeneratedFrf, regenerate_all
from jointfrf.cases.known_joint.sensitive import SensitiveBands, sensitive_bands
from jointfrf.cases.known_joint.study import Identified, run_study
from jointfrf.cases.workers import Workers
from jointfrf.dofs import Parameter
from jointfrf.frf.bands import Band
from jointfrf.identification.sensitivity import Sensitivity

__all__ = ["KnownJointResult", "compute"]


@dataclass(frozen=True)
class KnownJointResult:
    """Results of a case of a known joint.

    Attributes
    ----------
    case : KnownJointCase
    exact : Exact
    n_realisations : int
    modes : dict
        ``"actual"`` and ``"initial"`` joint to ModeShapes; empty without models.
    sensitivities : dict
        Key of an observed FRF to Sensitivity.
    proposals : dict
        Key of an observed FRF, and Parameter, to bands, Hz.
    from_initial : SensitiveBands
        Both with the first estimate in the place of the actual joint.
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
    sensitivities: dict[str, Sensitivity]
    proposals: dict[tuple[str, Parameter], list[Band]]
    from_initial: SensitiveBands
    identified: list[Identified]
    regenerated: list[RegeneratedFrf]
    printed: list[PrintedErrors]
    noise_free: dict[str, NoiseFree]


def compute(case: KnownJointCase, n_realisations: int, workers: Workers | None = None) -> KnownJointResult:
    """Run a case.

    Parameters
    ----------
    case : KnownJointCase
    n_realisations : int
    workers : Workers, optional
        Processes that share the work; this process by default.

    Returns
    -------
    KnownJointResult
    """
    at_work = workers or Workers()
    exact = at_work.begin(exact_frfs, case)()
    # Processes do all this at the same time.
    actual = at_work.begin(sensitive_bands, case, exact, case.joint, exact.h_c)
    from_initial = at_work.begin(sensitive_bands, case, exact, case.initial, exact.h_initial)
    modes = at_work.begin(modes_of_case, case)
    printed = at_work.begin(printed_errors, case)
    noise_free = at_work.begin(noise_free_errors, exact, case.joint.dynamic_stiffness(case.freq_hz))
    identified = run_study(case, exact, n_realisations, at_work)
    known = actual()
    return KnownJointResult(
        case=case,
        exact=exact,
        n_realisations=n_realisations,
        modes=modes(),
        sensitivities=known.sensitivities,
        proposals=known.proposals,
        from_initial=from_initial(),
        identified=identified,
        regenerated=regenerate_all(exact, identified, case.observed, at_work),
        printed=printed(),
        noise_free=noise_free(),
    )
