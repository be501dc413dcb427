"""Stiffness and damping of joints from frequency response functions.

Time convention exp(+i w t). Arrays over frequency have shape (n_freq, out, in), complex128, C order. SI units.
"""

from jointfrf._sweep import RCOND_LIMIT, VERSION
from jointfrf.bands import as_bands, band_mean, in_bands, propose_bands, sensitivity
from jointfrf.beam import beam
from jointfrf.compliance import compliance_covariance, compliance_factors, joint_compliance
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
from jointfrf.noise import pollute, realisations
from jointfrf.receptance import ReceptanceInfo, receptance
from jointfrf.rotations import DifferenceError, central_difference, difference_error, difference_weights, transform

__version__ = VERSION
