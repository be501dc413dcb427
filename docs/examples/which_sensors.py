"""
Before the test: which sensors and hits
=======================================

Two beams and the joint that is expected: which of 22 places see it best, and how well it will then be known. No FRF has
been measured yet.
"""

import matplotlib.pyplot as plt
import numpy as np

import jointfrf as jf

aluminium = dict(youngs_modulus=70e9, density=2700.0, width=0.025, height=0.006, loss_factor=0.005)
a = jf.Substructure(jf.beam(0.3, 12, ends=("clamped", "free"), **aluminium), ["13:y", "13:theta"])
b = jf.Substructure(jf.beam(0.225, 9, **aluminium), ["1:y", "1:theta"])
whole = jf.Assembly(a, b, jf.Joint([2e6, 2e3], [50.0, 0.05], dofs=["y", "theta"]))
nodes = [f"A/{i}:y" for i in range(2, 14)] + [f"B/{i}:y" for i in range(1, 11)]

# %%
# Noise as a hammer test has it: 2 % of each FRF, and a floor.
freq = np.arange(20.0, 800, 2)
plan = jf.plan(whole, freq, nodes, nodes, noise=0.02, floor=0.01, budget=4)
print(plan)

# %%
# From the smallest test to one of eight sensors and hits: what each more would bring.
steps = jf.plan(whole, freq, nodes, nodes, noise=0.02, floor=0.01, budget=8).steps
figure, axis = plt.subplots(figsize=(7, 3), layout="constrained")
for name in plan.targets:
    errors = [100 * one.std_error[name] / plan.value[name] for one in steps]
    axis.semilogy([one.cost for one in steps], errors, "o-", label=name)
axis.set(xlabel="sensors and hits together", ylabel="relative standard error, %")
axis.legend()
plt.show()
