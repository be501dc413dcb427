"""The Cramer-Rao bound of a joint between unknown sides, against differences of the model."""

import numpy as np

from cramer_rao import cramer_rao
from jointfrf.identification.information_bound import least_std_errors
from jointfrf.identification.manifold.coordinates import joint_terms


def test_bound_is_that_by_differences(assembly):
    gamma, k = assembly.gamma(assembly.joint), assembly.joint.dynamic_stiffness(assembly.freq)
    terms = joint_terms(2 * np.pi * assembly.freq, assembly.joint.dofs, "viscous", "zero")
    expected = 0.05 * np.sqrt(np.diag(cramer_rao(gamma, k, terms)))
    found = least_std_errors(assembly.freq, gamma, (0.05 * abs(gamma)) ** 2)
    np.testing.assert_allclose(found, expected, rtol=1e-5)
