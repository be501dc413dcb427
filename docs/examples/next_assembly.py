"""
Several assemblies: the next one
================================

Five beams joined anew each time, the joint a little different each time: what a fit of one assembly knows of its joint,
and what all five know of the next.
"""

import matplotlib.pyplot as plt
import numpy as np

import jointfrf as jf

freq = np.arange(15.0, 801.0, 2.0)  # Hz
steel = dict(youngs_modulus=210e9, density=7850.0, width=0.025, height=0.008, loss_factor=0.002)
a, b = jf.beam(0.30, 30, ends=("clamped", "free"), **steel), jf.beam(0.22, 22, **steel)
h_a, h_b = (beam.receptance(freq, beam.ports(f"{n}:y", f"{n}:theta")) for beam, n in ((a, 31), (b, 1)))

# %%
# A fit of each assembly, from FRFs with 5 % noise.
fits = []
for seed, share in enumerate([0.93, 1.08, 1.02, 0.87, 1.12]):
    joint = jf.Joint([6e5 * share, 5e3 * share], [20.0, 1.5], ["y", "theta"])
    gamma = jf.couple(h_a, h_b, joint.dynamic_stiffness(freq), [0, 1], [0, 1])
    fits.append(jf.identify(freq, jf.pollute(gamma, level=0.05, seed=seed), ["y", "theta"], damping="viscous"))

# %%
# Together: the mean, the spread between assemblies beyond the errors of the fits, and where the next one lies.
pooled = jf.pool(fits)
print(pooled)

# %%
figure, axis = plt.subplots(figsize=(7, 3), layout="constrained")
found = pooled.parameters["k_y"]
for i, fit in enumerate(fits):
    low, high = fit.confidence_interval(0.95)["k_y"]
    axis.plot([low / 1e5, high / 1e5], [i, i], "k", linewidth=3)
for row, (one, style) in enumerate([(found.mean, "C0"), (found.next_one, "C1")], len(fits)):
    axis.plot([one.low / 1e5, one.high / 1e5], [row, row], style, linewidth=3)
axis.set_yticks(range(len(fits) + 2), [*(f"assembly {i + 1}" for i in range(len(fits))), "mean", "the next one"])
axis.set_xlabel("k of y, 95 % interval, 100 kN/m")
plt.show()
