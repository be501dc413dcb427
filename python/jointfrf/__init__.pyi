# The public names and where they stand: `__init__.py` imports each when it is used, and type checkers read this.
from jointfrf import io as io
from jointfrf.channels.check.check import check_frfs
from jointfrf.channels.check.result import FrfCheck
from jointfrf.channels.joint_channels import ChannelAgreement, JointChannels, SideAgreement, joint_channels
from jointfrf.channels.point_lines import (
    DifferenceError,
    Interface,
    central_difference,
    difference_error,
    difference_weights,
    interface,
    transform,
)
from jointfrf.channels.virtual_point import (
    Consistency,
    DrivingPointCheck,
    VirtualPoint,
    append_virtual_point,
    channel_geometry,
    driving_point_check,
    impact_consistency,
    sensor_consistency,
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
    FrfCheckError,
    FrfCheckWarning,
    IdentificationWarning,
    IllConditionedWarning,
    SingularLineError,
)
from jointfrf.extras import MissingPackageError
from jointfrf.frf.bands import amplitude_error, as_bands, band_mean, frequency_error, has_peak, in_bands, peak
from jointfrf.frf.frf_set import ChannelPlace, places_of_nodes
from jointfrf.frf.noise import pollute, realisations
from jointfrf.frf.noise_model import NoiseModel, estimate_noise
from jointfrf.frf.setups import SetUps
from jointfrf.frf.smoothing import SmoothFrfs, smooth_frfs
from jointfrf.frf.stated_noise import StatedNoise
from jointfrf.identification.band_means import identify_band_mean
from jointfrf.identification.derived import Derived
from jointfrf.identification.elastic_centre import ElasticCentre, elastic_centre
from jointfrf.identification.fit_cards import cards
from jointfrf.identification.identify import identify
from jointfrf.identification.identify_model import identify_model
from jointfrf.identification.joint_file import read_joint, write_joint
from jointfrf.identification.model.assembly import AddedMass, Alike, Assembly, GroundSpring, PlacedJoint
from jointfrf.identification.model.substructure import Substructure, Unknown
from jointfrf.identification.monte_carlo import BandStatistics, MonteCarlo, monte_carlo
from jointfrf.identification.realisations import FitStart, identify_realisations
from jointfrf.identification.record import fit_from_dict, fit_to_dict, load, save
from jointfrf.identification.result import Fit, FittedParameter
from jointfrf.identification.sensitivity import propose_bands, sensitivity
from jointfrf.identification.side_models import SideModel
from jointfrf.identification.validation import Validation, validate
from jointfrf.joint import Joint
from jointfrf.kernel.call import RCOND_LIMIT, get_engine, set_engine, use_engine
from jointfrf.kernel.linear_algebra import invert, reciprocal_condition, solve
from jointfrf.laws.function_law import FunctionLaw
from jointfrf.laws.law import JointLaw, LawField
from jointfrf.laws.law_joint import LawJoint
from jointfrf.laws.springs import SpringLaw
from jointfrf.laws.viscoelastic import FractionalZener, PowerLaw, StandardLinearSolid
from jointfrf.messages.finding import Finding
from jointfrf.models.beam import beam
from jointfrf.models.matrices import from_triangle
from jointfrf.models.model import Model, assemble, chain, with_modal_damping
from jointfrf.models.plate import PlateRegion, plate
from jointfrf.models.points import PointModel, rigid_body
from jointfrf.models.receptance import ReceptanceInfo, receptance
from jointfrf.models.regions import NodeRegion, add_regions
from jointfrf.parallel.pool import BrokenPoolError
from jointfrf.parallel.sweep import SweepPlan, plan_sweep, sweep
from jointfrf.substructuring.bodies import BodyLink, FreeBody, couple_bodies
from jointfrf.substructuring.compliance import (
    MultiPointJoint,
    compliance_covariance,
    compliance_factors,
    joint_compliance,
    multi_point_compliance,
    multi_point_stiffness,
)
from jointfrf.substructuring.coupling import couple, semm, semm_standard_error
from jointfrf.substructuring.methods import decouple
from jointfrf.substructuring.modification import find_modification, inverse_substructuring, ismm, modify
from jointfrf.workbench import report as report
from jointfrf.workbench import solids as solids
from jointfrf.workbench.amplitude.amplitude_laws import AmplitudeLawFit, AmplitudeLawFits, fit_amplitude_laws
from jointfrf.workbench.amplitude.backbone import Backbone, backbone_levels
from jointfrf.workbench.amplitude.decay import DecayRecord, ModalDecay, decay_of_mode
from jointfrf.workbench.amplitude.decay_levels import decay_levels
from jointfrf.workbench.amplitude.levels import JointLevel, JointLevels, levels
from jointfrf.workbench.amplitude.lines import Drive
from jointfrf.workbench.assembly_file.measured import MeasuredAssembly, measured_assembly
from jointfrf.workbench.assembly_file.read import AssemblyPart, read_part
from jointfrf.workbench.cases.bolted_lap.contact import ContactLaw
from jointfrf.workbench.cases.bolted_lap.lap import (
    PROOF_STRENGTH,
    STRESS_AREA,
    Bolt,
    BoltedLap,
    LapDivisions,
    bolted_lap,
    preload_force,
)
from jointfrf.workbench.cases.bolted_lap.preload import PreloadedLap, preload
from jointfrf.workbench.planning.assemblies import assemblies_needed, expected_half_width
from jointfrf.workbench.planning.joint_frfs import JointFrfPlan, plan_joint_frfs
from jointfrf.workbench.planning.plan import MeasurementPlan, plan
from jointfrf.workbench.pooling.parameter import PooledParameter
from jointfrf.workbench.pooling.pool import PooledFits, pool
from jointfrf.workbench.pooling.transfer import Transfer, transfer
from jointfrf.workbench.report.fit import plot
from jointfrf.workbench.report.fit_page import write_report
from jointfrf.workbench.report.levels_page import write_levels
from jointfrf.workbench.report.plan_page import write_plan
from jointfrf.workbench.report.pool_page import write_pool
from jointfrf.workbench.solids.brick import Material, assemble_bricks, brick_quality, element_matrices
from jointfrf.workbench.solids.brick_beam import Hole, brick_beam
from jointfrf.workbench.solids.mesh import Mesh, interpolation
from jointfrf.workbench.solids.solid import Patch, SolidModel, solid_model
from jointfrf.workbench.studies.design import StudyDesign
from jointfrf.workbench.studies.result import StudyResult, read_study
from jointfrf.workbench.studies.run import merge_studies, study
from jointfrf.workbench.studies.summary import ParameterSummary

__all__ = [
    "PROOF_STRENGTH",
    "RCOND_LIMIT",
    "STRESS_AREA",
    "AddedMass",
    "Alike",
    "AmplitudeLawFit",
    "AmplitudeLawFits",
    "Assembly",
    "AssemblyPart",
    "Backbone",
    "BandStatistics",
    "BodyLink",
    "Bolt",
    "BoltedLap",
    "BrokenPoolError",
    "ChannelAgreement",
    "ChannelPlace",
    "Consistency",
    "ContactLaw",
    "ConvergenceWarning",
    "CopyWarning",
    "DecayRecord",
    "Derived",
    "DifferenceError",
    "Drive",
    "DrivingPointCheck",
    "ElasticCentre",
    "FileContentError",
    "FileContentWarning",
    "Finding",
    "Fit",
    "FitStart",
    "FittedParameter",
    "FractionalZener",
    "FreeBody",
    "FrfCheck",
    "FrfCheckError",
    "FrfCheckWarning",
    "FunctionLaw",
    "GroundSpring",
    "Hole",
    "IdentificationWarning",
    "IllConditionedWarning",
    "Interface",
    "Joint",
    "JointChannels",
    "JointFrfPlan",
    "JointLaw",
    "JointLevel",
    "JointLevels",
    "LapDivisions",
    "LawField",
    "LawJoint",
    "Material",
    "MeasuredAssembly",
    "MeasurementPlan",
    "Mesh",
    "MissingPackageError",
    "ModalDecay",
    "Model",
    "MonteCarlo",
    "MultiPointJoint",
    "NodeRegion",
    "NoiseModel",
    "ParameterSummary",
    "Patch",
    "PlacedJoint",
    "PlateRegion",
    "PointModel",
    "PooledFits",
    "PooledParameter",
    "PowerLaw",
    "PreloadedLap",
    "ReceptanceInfo",
    "SetUps",
    "SideAgreement",
    "SideModel",
    "SingularLineError",
    "SmoothFrfs",
    "SolidModel",
    "SpringLaw",
    "StandardLinearSolid",
    "StatedNoise",
    "StudyDesign",
    "StudyResult",
    "Substructure",
    "SweepPlan",
    "Transfer",
    "Unknown",
    "Validation",
    "VirtualPoint",
    "add_regions",
    "amplitude_error",
    "append_virtual_point",
    "as_bands",
    "assemble",
    "assemble_bricks",
    "assemblies_needed",
    "backbone_levels",
    "band_mean",
    "beam",
    "bolted_lap",
    "brick_beam",
    "brick_quality",
    "cards",
    "central_difference",
    "chain",
    "channel_geometry",
    "check_frfs",
    "compliance_covariance",
    "compliance_factors",
    "couple",
    "couple_bodies",
    "decay_levels",
    "decay_of_mode",
    "decouple",
    "difference_error",
    "difference_weights",
    "driving_point_check",
    "elastic_centre",
    "element_matrices",
    "estimate_noise",
    "expected_half_width",
    "find_modification",
    "fit_amplitude_laws",
    "fit_from_dict",
    "fit_to_dict",
    "frequency_error",
    "from_triangle",
    "get_engine",
    "has_peak",
    "identify",
    "identify_band_mean",
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
    "levels",
    "load",
    "measured_assembly",
    "merge_studies",
    "modify",
    "monte_carlo",
    "multi_point_compliance",
    "multi_point_stiffness",
    "peak",
    "places_of_nodes",
    "plan",
    "plan_joint_frfs",
    "plan_sweep",
    "plate",
    "plot",
    "pollute",
    "pool",
    "preload",
    "preload_force",
    "propose_bands",
    "read_joint",
    "read_part",
    "read_study",
    "realisations",
    "receptance",
    "reciprocal_condition",
    "rigid_body",
    "rigid_offset",
    "save",
    "semm",
    "semm_standard_error",
    "sensitivity",
    "sensor_consistency",
    "set_engine",
    "smooth_frfs",
    "solid_model",
    "solve",
    "study",
    "sweep",
    "transfer",
    "transform",
    "use_engine",
    "validate",
    "virtual_interface",
    "virtual_point",
    "virtual_points",
    "with_modal_damping",
    "write_joint",
    "write_levels",
    "write_plan",
    "write_pool",
    "write_report",
]
