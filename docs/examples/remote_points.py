"""
One shaker, points away from the joint
======================================

With models of both parts any FRFs will do. What a model does not know exactly is an unknown with a prior; here Young's
modulus of each beam, known to 3 %.
"""

import matplotlib.pyplot as plt
import numpy as np

import jointfrf as jf

freq = np.arange(15.0, 801.0, 2.0)  # Hz
of_both = dict(youngs_modulus=67e9, density=2700.0, width=0.025, height=0.006, loss_factor=0.01)
a = jf.Substructure(jf.beam(0.3, 12, ends=("clamped", "free"), **of_both), ["13:y", "13:theta"])
b = jf.Substructure(jf.beam(0.225, 9, **of_both), ["1:y", "1:theta"])
channels, shaker = ["A/7:y", "A/10:y", "B/5:y", "B/10:y"], ["A/7:y"]

# %%
# The measurement: the joint is to be found.
truth = jf.Assembly(a, b, jf.Joint([6e5, 5e3], [20, 1.5], ["y", "theta"]))
h = jf.pollute(truth.receptance(freq, channels, shaker), level=0.03, seed=3)

# %%
start = jf.LawJoint({"y": jf.SpringLaw(1e5, c=5.0), "theta": jf.SpringLaw(1e3, c=0.5)})
fit = jf.identify_model(freq, h, jf.Assembly(a, b, start), channels, shaker)
print(fit)

# %%
figure, axis = plt.subplots(figsize=(7, 3.5), layout="constrained")
axis.semilogy(freq, np.abs(h[:, 3, 0]), ".", markersize=2, color="0.5", label="measured, far side of the joint")
found = jf.Assembly(a, b, jf.Joint(fit.stiffness, fit.damping, ["y", "theta"]))
axis.semilogy(freq, np.abs(found.receptance(freq, channels[3:], shaker)[:, 0, 0]), "k", label="with the joint found")
axis.set(xlabel="frequency, Hz", ylabel="|H|, m/N")
axis.legend()
plt.show()
