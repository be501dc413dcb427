# The public names and where they stand: `__init__.py` imports each when it is used, and type checkers read this.
from jointfrf import io as io
from jointfrf import report as report
from jointfrf import solids as solids
from jointfrf.channels.check.check import check_frfs
from jointfrf.channels.check.finding import FrfCheck, FrfFinding
from jointfrf.channels.consistency import (
    Consistency,
    DrivingPointCheck,
    driving_point_check,
    impact_consistency,
    sensor_consistency,
)
from jointfrf.channels.finite_differences import (
    DifferenceError,
    central_difference,
    difference_error,
    difference_weights,
    transform,
)
from jointfrf.channels.joint_channels import ChannelAgreement, JointChannels, SideAgreement, joint_channels
from jointfrf.channels.point_lines import Interface, interface
from jointfrf.channels.virtual_point import (
    VirtualPoint,
    append_virtual_point,
    channel_geometry,
    virtual_interface,
    virtual_point,
    virtual_points,
)
from jointfrf.dofs import rigid_offset
from jointfrf.errors import (
    ConvergenceWarning,
    CopyWarning,
    FileContentError,
    FileContentWarning,
    FrfCheckWarning,
    IdentificationWarning,
    IllConditionedWarning,
    SingularLineError,
)
from jointfrf.extras import MissingPackageError
from jointfrf.frf.bands import as_bands, band_mean, in_bands
from jointfrf.frf.channel_place import ChannelPlace, places_of_nodes
from jointfrf.frf.metrics import amplitude_error, frequency_error, has_peak, peak
from jointfrf.frf.noise import pollute, realisations
from jointfrf.frf.noise_model import NoiseModel, estimate_noise
from jointfrf.frf.smoothing import SmoothFrfs, smooth_frfs
from jointfrf.identification.elastic_centre import ElasticCentre, elastic_centre
from jointfrf.identification.identify import identify
from jointfrf.identification.joint_file import read_joint, write_joint
from jointfrf.identification.joint_fit import JointFit
from jointfrf.identification.law_fit.law_fit import LawFit
from jointfrf.identification.model_fit.assembly import Assembly
from jointfrf.identification.model_fit.attachments import AddedMass, GroundSpring
from jointfrf.identification.model_fit.identify_model import identify_model
from jointfrf.identification.model_fit.model_fit import ModelFit
from jointfrf.identification.model_fit.substructure import Substructure
from jointfrf.identification.model_fit.unknown import Unknown
from jointfrf.identification.monte_carlo import BandStatistics, MonteCarlo, monte_carlo
from jointfrf.identification.realisations import FitStart, identify_realisations
from jointfrf.identification.sensitivity import propose_bands, sensitivity
from jointfrf.joint import Joint
from jointfrf.kernel.engine import get_engine, set_engine, use_engine
from jointfrf.kernel.linear_algebra import invert, reciprocal_condition, solve
from jointfrf.kernel.status import RCOND_LIMIT
from jointfrf.laws.function_law import FunctionLaw
from jointfrf.laws.law import JointLaw, LawField
from jointfrf.laws.law_joint import LawJoint
from jointfrf.laws.springs import SpringLaw
from jointfrf.laws.viscoelastic import FractionalZener, PowerLaw, StandardLinearSolid
from jointfrf.models.beam import beam
from jointfrf.models.chain import chain
from jointfrf.models.matrices import from_triangle
from jointfrf.models.model import Model, assemble
from jointfrf.models.receptance.receptance import ReceptanceInfo, receptance
from jointfrf.parallel.pool import BrokenPoolError
from jointfrf.parallel.sweep import SweepPlan, plan_sweep, sweep
from jointfrf.solids.bolt import PROOF_STRENGTH, STRESS_AREA, Bolt, preload_force
from jointfrf.solids.bolted_lap import BoltedLap, LapDivisions, bolted_lap
from jointfrf.solids.brick import Material, assemble_bricks, brick_quality, element_matrices
from jointfrf.solids.brick_beam import Hole, brick_beam
from jointfrf.solids.contact_pairs import ContactLaw
from jointfrf.solids.interpolation import interpolation
from jointfrf.solids.mesh import Mesh
from jointfrf.solids.preload import PreloadedLap, preload
from jointfrf.solids.solid import Patch, SolidModel, solid_model
from jointfrf.studies.design import StudyDesign
from jointfrf.studies.result import StudyResult, read_study
from jointfrf.studies.run import merge_studies, study
from jointfrf.studies.summary import ParameterSummary
from jointfrf.substructuring.compliance import compliance_covariance, compliance_factors, joint_compliance
from jointfrf.substructuring.coupling import couple
from jointfrf.substructuring.decoupling import decouple
from jointfrf.substructuring.ismm import inverse_substructuring, ismm
from jointfrf.substructuring.modification import find_modification, modify
from jointfrf.substructuring.multi_point import MultiPointJoint, multi_point_compliance, multi_point_stiffness
from jointfrf.substructuring.semm import semm

__all__ = [
    "PROOF_STRENGTH",
    "RCOND_LIMIT",
    "STRESS_AREA",
    "AddedMass",
    "Assembly",
    "BandStatistics",
    "Bolt",
    "BoltedLap",
    "BrokenPoolError",
    "ChannelAgreement",
    "ChannelPlace",
    "Consistency",
    "ContactLaw",
    "ConvergenceWarning",
    "CopyWarning",
    "DifferenceError",
    "DrivingPointCheck",
    "ElasticCentre",
    "FileContentError",
    "FileContentWarning",
    "FitStart",
    "FractionalZener",
    "FrfCheck",
    "FrfCheckWarning",
    "FrfFinding",
    "FunctionLaw",
    "GroundSpring",
    "Hole",
    "IdentificationWarning",
    "IllConditionedWarning",
    "Interface",
    "Joint",
    "JointChannels",
    "JointFit",
    "JointLaw",
    "LapDivisions",
    "LawField",
    "LawFit",
    "LawJoint",
    "Material",
    "Mesh",
    "MissingPackageError",
    "Model",
    "ModelFit",
    "MonteCarlo",
    "MultiPointJoint",
    "NoiseModel",
    "ParameterSummary",
    "Patch",
    "PowerLaw",
    "PreloadedLap",
    "ReceptanceInfo",
    "SideAgreement",
    "SingularLineError",
    "SmoothFrfs",
    "SolidModel",
    "SpringLaw",
    "StandardLinearSolid",
    "StudyDesign",
    "StudyResult",
    "Substructure",
    "SweepPlan",
    "Unknown",
    "VirtualPoint",
    "amplitude_error",
    "append_virtual_point",
    "as_bands",
    "assemble",
    "assemble_bricks",
    "band_mean",
    "beam",
    "bolted_lap",
    "brick_beam",
    "brick_quality",
    "central_difference",
    "chain",
    "channel_geometry",
    "check_frfs",
    "compliance_covariance",
    "compliance_factors",
    "couple",
    "decouple",
    "difference_error",
    "difference_weights",
    "driving_point_check",
    "elastic_centre",
    "element_matrices",
    "estimate_noise",
    "find_modification",
    "frequency_error",
    "from_triangle",
    "get_engine",
    "has_peak",
    "identify",
    "identify_model",
    "identify_realisations",
    "impact_consistency",
    "in_bands",
    "interface",
    "interpolation",
    "inverse_substructuring",
    "invert",
    "ismm",
    "joint_channels",
    "joint_compliance",
    "merge_studies",
    "modify",
    "monte_carlo",
    "multi_point_compliance",
    "multi_point_stiffness",
    "peak",
    "places_of_nodes",
    "plan_sweep",
    "pollute",
    "preload",
    "preload_force",
    "propose_bands",
    "read_joint",
    "read_study",
    "realisations",
    "receptance",
    "reciprocal_condition",
    "rigid_offset",
    "semm",
    "sensitivity",
    "sensor_consistency",
    "set_engine",
    "smooth_frfs",
    "solid_model",
    "solve",
    "study",
    "sweep",
    "transform",
    "use_engine",
    "virtual_interface",
    "virtual_point",
    "virtual_points",
    "write_joint",
]
