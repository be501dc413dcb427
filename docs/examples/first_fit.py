"""
A joint with error bars
=======================

Two short beams, a joint in deflection and rotation, FRFs of the assembly at the joint with 5 % noise: what the means of
K* over the band say, and the fit.
"""

import matplotlib.pyplot as plt
import numpy as np

import jointfrf as jf

freq = np.arange(15.0, 801.0, 1.0)  # Hz
steel = dict(youngs_modulus=210e9, density=7850.0, width=0.025, height=0.008)
a = jf.beam(0.30, 30, ends=("clamped", "free"), loss_factor=0.002, **steel)
b = jf.beam(0.22, 22, loss_factor=0.002, **steel)
joint = jf.Joint([6e5, 5e3], [20.0, 1.5], ["y", "theta"])

# %%
# The assembly is coupled, and its FRFs at both sides of the joint are what a test would give.
h_a = a.receptance(freq, a.ports("31:y", "31:theta"))
h_b = b.receptance(freq, b.ports("1:y", "1:theta"))
gamma = jf.pollute(jf.couple(h_a, h_b, joint.dynamic_stiffness(freq), [0, 1], [0, 1]), level=0.05, seed=1)

# %%
# K* line by line needs no model, but is the inverse of noisy numbers.
k_line = jf.inverse_substructuring(gamma)
print(jf.identify_band_mean(freq, gamma, dofs=["y", "theta"], method="inverse-substructuring", bands=[(200, 800)]))

# %%
# The fit uses every line, and knows how good it is.
fit = jf.identify(freq, gamma, dofs=["y", "theta"])
print(fit)

# %%
figure, axes = plt.subplots(2, 1, sharex=True, figsize=(7, 5), layout="constrained")
for axis, n, unit in zip(axes, range(2), ("N/m", "N m/rad"), strict=True):
    axis.semilogy(freq, np.abs(k_line[:, n, n]), ".", markersize=2, color="0.6", label="line by line")
    axis.semilogy(freq, np.abs(fit.k_joint(freq)[:, n, n]), "k", label="fit")
    axis.semilogy(freq, np.abs(joint.dynamic_stiffness(freq)[:, n, n]), "C1--", label="true")
    axis.set_ylabel(f"|K*| of {fit.dofs[n]}, {unit}")
axes[0].legend()
axes[1].set_xlabel("frequency, Hz")
plt.show()
