"""
A rubber joint: stiffness that rises with frequency
===================================================

Where a joint is no spring with a dashpot, a law says how K* goes with frequency: here a fractional Zener element in
translation, found from noisy FRFs, and judged against a spring by the residual.
"""

import warnings

import matplotlib.pyplot as plt
import numpy as np

import jointfrf as jf

freq = np.arange(10.0, 601.0, 2.0)  # Hz
a = jf.beam(0.3, 20, ends=("clamped", "free"), youngs_modulus=70e9, density=2700.0, width=0.03, height=0.01)
b = jf.beam(0.2, 14, youngs_modulus=70e9, density=2700.0, width=0.03, height=0.01)
rubber = jf.FractionalZener(2e5, 3e6, 2e-4, 0.55)
truth = jf.LawJoint({"y": rubber, "theta": jf.SpringLaw(300.0, h=30.0)})
h_a, h_b = a.receptance(freq, a.ports("21:y", "21:theta")), b.receptance(freq, b.ports("1:y", "1:theta"))
gamma = jf.pollute(jf.couple(h_a, h_b, truth, [0, 1], [0, 1], freq_hz=freq), level=0.02, seed=4)

# %%
# A spring with hysteretic damping first: the residual says that it is not the joint.
with warnings.catch_warnings(action="ignore", category=jf.IdentificationWarning):
    spring = jf.identify(freq, gamma, ["y", "theta"], damping="hysteretic")
print(spring.findings[0])

# %%
# The law, from values that may be far off.
start = jf.LawJoint({"y": jf.FractionalZener(1e5, 1e6, 1e-4, 0.5), "theta": jf.SpringLaw(100.0, h=1.0)})
with warnings.catch_warnings(action="ignore", category=jf.IdentificationWarning):
    fit = jf.identify(freq, gamma, joint=start)
print(fit)

# %%
figure, axes = plt.subplots(2, 1, sharex=True, figsize=(7, 5), layout="constrained")
for name, k, style in (("true", truth.dynamic_stiffness(freq), "C1--"), ("law", fit.k_joint(freq), "k"),
                       ("spring", spring.k_joint(freq), "C0:")):  # fmt: skip
    axes[0].plot(freq, k[:, 0, 0].real / 1e6, style, label=name)
    axes[1].plot(freq, k[:, 0, 0].imag / k[:, 0, 0].real, style)
axes[0].set_ylabel("Re K*, MN/m")
axes[1].set(ylabel="loss factor", xlabel="frequency, Hz")
axes[0].legend()
plt.show()
