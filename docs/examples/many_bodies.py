"""
Many bodies, rigid and flexible connections, a loop
===================================================

Three free chains in a ring, one connection rigid, two flexible, and a spring to the ground: all coupled at once (dual
assembly).
"""

import matplotlib.pyplot as plt
import numpy as np

import jointfrf as jf

freq = np.linspace(5.0, 200.0, 800)  # Hz
chain = jf.chain([1.0] * 4, [2e5] * 3, [6.0] * 3, ground="none")
bodies = {name: jf.FreeBody(chain.receptance(freq), ["1", "2", "3", "4"]) for name in "ABC"}

# %%
# A rigid connection is a joint with a rigid DOF; without a second DOF a connection goes to the ground.
mount = jf.Joint([5e4], [4.0], ["x"])
links = [
    jf.BodyLink(jf.LawJoint({}, rigid=["x"]), ["A/4"], ["B/1"]),
    jf.BodyLink(mount, ["B/4"], ["C/1"]),
    jf.BodyLink(mount, ["C/4"], ["A/1"]),
    jf.BodyLink(jf.Joint([2e4], [1.0], ["x"]), ["A/1"]),
]
h = jf.couple_bodies(freq, bodies, links, ["A/1", "C/3"], ["A/1"])
print(h.shape)

# %%
figure, axis = plt.subplots(figsize=(7, 3.5), layout="constrained")
for row, name, style in ((0, "A/1, driven", "k"), (1, "C/3", "C0--")):
    axis.semilogy(freq, np.abs(h[:, row, 0]), style, label=name)
axis.set(xlabel="frequency, Hz", ylabel="|H|, m/N")
axis.legend()
plt.show()
