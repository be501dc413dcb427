"""
Several joints: a machine on four mounts
========================================

One part, four joints to the ground, all unknown, from three sensors that are not at the mounts, which came out of one
box.
"""

import matplotlib.pyplot as plt
import numpy as np

import jointfrf as jf

feet = {"fl": (-0.3, -0.2, -0.25), "fr": (0.3, -0.2, -0.25), "rl": (-0.3, 0.2, -0.25), "rr": (0.3, 0.2, -0.25)}  # m
places = {**feet, "top": (0.1, 0.05, 0.25), "side": (0.35, 0.0, 0.0), "front": (0.05, -0.3, 0.1)}
body = jf.rigid_body(60.0, [2.2, 3.0, 3.6], places, moves=["z", "theta_x", "theta_y"])  # kg, kg m^2
machine = jf.Substructure(body, exact=True)


def on_mounts(stiffness, **groups):
    """The machine on springs with a loss factor of 0.1."""
    joints = {
        foot: jf.PlacedJoint(jf.LawJoint({"z": jf.SpringLaw(k, h=0.1 * k)}), [f"machine/{foot}:z"])
        for foot, k in zip(feet, stiffness, strict=True)
    }
    return jf.Assembly.of_parts({"machine": machine}, joints, **groups)


# %%
# What stands for the measurement.
true = [2.8e5, 3.3e5, 3.0e5, 3.6e5]  # N/m
freq = np.arange(4.0, 40.0, 0.25)  # Hz
channels = ["machine/top:z", "machine/side:z", "machine/front:z"]
h = jf.pollute(on_mounts(true).receptance(freq, channels, channels[1:]), level=0.03, seed=4)

# %%
# Four joints at once. `alike` says that they scatter about one mean, by how much is found: what another machine on such
# mounts will have.
fit = jf.identify_model(freq, h, on_mounts([1e5] * 4, alike={"mounts": jf.Alike(list(feet))}), channels, channels[1:])
print(fit)

# %%
figure, axis = plt.subplots(figsize=(7, 3), layout="constrained")
rows = [*feet, "mounts"]
for i, name in enumerate(rows):
    low, high = fit.confidence_interval(0.95)[f"{name}.k_z"]
    axis.plot([low / 1e5, high / 1e5], [i, i], "C1" if name == "mounts" else "k", linewidth=5)
axis.plot(np.array(true) / 1e5, range(4), "C0|", markersize=22, label="true")
axis.set_yticks(range(5), [*feet, "their mean"])
axis.set_xlabel("k, 95 % interval, 100 kN/m")
axis.legend(loc="right")
plt.show()
