"""
A joint that slides: laws over amplitude
========================================

Stiffness and loss factor of a bolted joint at eight amplitudes, from a free decay, say: which law of friction holds.
"""

import matplotlib.pyplot as plt
import numpy as np

import jointfrf as jf

amplitude = np.geomspace(2e-7, 2e-5, 8)  # peak relative motion in the joint, m
stiffness = np.array([947800.0, 923900.0, 882900.0, 818700.0, 742300.0, 576700.0, 261600.0, 105700.0])  # N/m
loss_factor = np.array([0.0208, 0.0296, 0.0434, 0.0673, 0.106, 0.313, 0.865, 1.5])

# %%
# All laws are fitted, and judged by what they leave and how many parameters they take. These numbers are those of an
# Iwan element that slips at 3 N, with errors of 0.5 % and 2 %.
found = jf.fit_amplitude_laws(amplitude, stiffness, loss_factor, 0.005 * stiffness, 0.02 * loss_factor)
print(found)

# %%
figure, axes = plt.subplots(2, 1, sharex=True, figsize=(7, 5), layout="constrained")
axes[0].loglog(amplitude, stiffness, "ko", label="measured")
axes[1].loglog(amplitude, loss_factor, "ko")
for one, style in zip(found.fits, ("C0", "C1--", "C2:", "C3-.", "0.6"), strict=True):
    axes[0].loglog(amplitude, one.stiffness, style, label=one.law)
    axes[1].loglog(amplitude, np.maximum(one.loss_factor, 1e-3), style)
axes[0].set_ylabel("k, N/m")
axes[0].legend()
axes[1].set(ylabel="loss factor", xlabel="amplitude in the joint, m")
plt.show()
