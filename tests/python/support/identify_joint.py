"""The joint of two beams (thesis case 3.3) from noisy FRFs at it, with standard errors, from Python.

The same program, alike line by line: tests/f77/identify.f, tests/fortran/identify.f90, tests/c/identify.c. It calls the
routine of the kernel that these call; `jointfrf.identify` also estimates the noise and smooths the FRFs.

A is clamped, 300 elements of 1 mm; B is free, 225 elements; the elements are linear with shear and lumped mass. A joint
in deflection and rotation connects them. Its stiffness and damping come from FRFs at both sides of it, 15 to 800 Hz, to
which 5 % noise was added.

Output, 6 significant digits: each parameter, its value and its standard error. Exit status 1 if anything is wrong.
"""

import sys

import numpy as np

import jointfrf as jf
from jointfrf.kernel.call import call_for_number

N_J, N_PAR, N_FREQ, N_NEAR = 2, 4, 786, 2
LEVEL = 0.05
NAMES = ["k_Fy", "k_Mtheta", "c_Fy", "c_Mtheta"]
# the DOF of each parameter, and its kind: 0 stiffness, 2 viscous damping
DOFS, KINDS = np.array([1, 2, 1, 2], np.int32), np.array([0, 0, 2, 2], np.int32)
FREQ_HZ = 15.0 + np.arange(N_FREQ)
OMEGA = 2 * np.pi * FREQ_HZ
SECTION = {"youngs_modulus": 67e9, "density": 2700.0, "width": 0.025, "height": 0.006, "loss_factor": 0.01}
ELEMENT = {"element": "shear-flexible", "poisson": 0.33}


def fit_joint(measured, inverse_std):
    """Return whether the fit converged, the parameters, and their covariance."""
    spring, x, values, descent = np.zeros(N_J), np.zeros(N_PAR), np.empty(N_PAR), np.empty(N_PAR)
    free_h, free_q = np.zeros((2, N_FREQ, N_J, N_J), complex)
    covariance, normal = np.empty((2, N_PAR, N_PAR))
    line_descent, distance, used = np.empty((N_FREQ, N_PAR)), np.empty(N_FREQ), np.empty(N_FREQ, np.int32)
    c_joint, gradient = np.empty((2, N_FREQ, N_J), complex)
    information, squares = np.empty((N_FREQ, N_J, N_J), complex), np.empty(N_FREQ)
    line_info, whitening = np.empty(N_FREQ, np.int32), np.zeros((N_FREQ, 1, 1))
    sizes, options = (1, N_J, N_PAR, 2 * N_J, 2 * N_J, 0, N_FREQ), (0, 8, 0, 0.0)
    frfs = OMEGA, measured, measured, inverse_std, whitening
    results = values, covariance, normal, descent, line_descent, distance, used, c_joint, information, gradient, squares
    args = *sizes, *options, DOFS, KINDS, *frfs, spring, x, free_h, free_q, *results, line_info
    _, _, _, converged, _ = call_for_number("fit_joint", args)
    return converged == 1, values, covariance


def main():
    # FRFs at the joint, coupled through it, and noise on them
    a = jf.beam(0.3, 300, ends=("clamped", "free"), **ELEMENT, **SECTION)
    b = jf.beam(0.225, 225, **ELEMENT, **SECTION)
    h_a = a.receptance(FREQ_HZ, ["301:y", "301:theta"])
    h_b = b.receptance(FREQ_HZ, ["1:y", "1:theta"])
    gamma = jf.couple(h_a, h_b, jf.Joint([6e5, 5e3], [20, 1.5]).dynamic_stiffness(FREQ_HZ), [0, 1], [0, 1])
    measured = jf.pollute(gamma, LEVEL, seed=1)

    # the mean of both directions, and one over the standard deviation of its noise, by the mean over neighbouring lines
    measured = 0.5 * (measured + measured.swapaxes(1, 2))
    lines = np.arange(N_FREQ)
    first, last = np.maximum(lines - N_NEAR, 0), np.minimum(lines + N_NEAR, N_FREQ - 1)
    mean = np.array([(abs(measured[i : k + 1]) ** 2).mean(axis=0) for i, k in zip(first, last, strict=True)])
    inverse_std = np.where(np.eye(2 * N_J) == 1, 1, np.sqrt(2)) / (LEVEL * np.sqrt(mean))

    # the joint
    converged, values, covariance = fit_joint(measured, inverse_std)
    for name, value, error in zip(NAMES, values, np.sqrt(covariance.diagonal()), strict=True):
        print(f"{name:8s} {value:13.5E} {error:13.5E}")
    return 0 if converged else 1


if __name__ == "__main__":
    sys.exit(main())
