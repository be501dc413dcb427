"""Stiffness and damping of joints from frequency response functions.

Time convention exp(+i w t). Arrays over frequency have shape (n_freq, out, in), complex128, C order. SI units.
"""

from jointfrf._sweep import RCOND_LIMIT, VERSION
from jointfrf.bands import as_bands, band_mean, in_bands, propose_bands, sensitivity
from jointfrf.beam import beam
from jointfrf.compliance import compliance_covariance, compliance_factors, joint_compliance
from jointfrf.consistency import (
    Consistency,
    DrivingPointCheck,
    driving_point_check,
    impact_consistency,
    sensor_consistency,
)
from jointfrf.coupling import couple
from jointfrf.decoupling import decouple
from jointfrf.discrete import chain
from jointfrf.engine import get_engine, set_engine, use_engine
from jointfrf.errors import (
    ConvergenceWarning,
    CopyWarning,
    FileContentError,
    FileContentWarning,
    IdentificationWarning,
    IllConditionedWarning,
    SingularLineError,
)
from jointfrf.identify import identify
from jointfrf.interface import Interface, interface
from jointfrf.ismm import inverse_substructuring, ismm
from jointfrf.joint import Joint
from jointfrf.joint_fit import JointFit
from jointfrf.linear_algebra import invert, reciprocal_condition, solve
from jointfrf.metrics import amplitude_error, frequency_error, peak
from jointfrf.model import Model, assemble
from jointfrf.modification import find_modification, modify
from jointfrf.monte_carlo import BandStatistics, MonteCarlo, monte_carlo
from jointfrf.multi_point import MultiPointJoint, multi_point_compliance, multi_point_stiffness
from jointfrf.noise import pollute, realisations
from jointfrf.receptance import ReceptanceInfo, receptance
from jointfrf.rigid_motion import rigid_offset
from jointfrf.rotations import DifferenceError, central_difference, difference_error, difference_weights, transform
from jointfrf.solids.bolt import PROOF_STRENGTH, STRESS_AREA, Bolt, preload_force
from jointfrf.solids.bolted_lap import BoltedLap, LapDivisions, bolted_lap
from jointfrf.solids.brick import Material, assemble_bricks, brick_quality, element_matrices
from jointfrf.solids.brick_beam import Hole, brick_beam
from jointfrf.solids.contact_pairs import ContactLaw
from jointfrf.solids.interpolation import interpolation
from jointfrf.solids.mesh import Mesh
from jointfrf.solids.preload import PreloadedLap, preload
from jointfrf.solids.solid import Patch, SolidModel, solid_model
from jointfrf.virtual_point import (
    VirtualPoint,
    append_virtual_point,
    channel_geometry,
    virtual_point,
    virtual_points,
)

__version__ = VERSION
