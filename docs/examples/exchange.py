"""
To and from pyFBS, SDynPy and MATLAB
====================================

A test as pyFBS holds it, tables of sensors and impacts and an array of FRFs, goes into the fit channel by channel; the
joint, virtual points and FRFs go back as the arrays that pyFBS, SDynPy and MATLAB hold. None of these needs to be
installed: where pyFBS or SDynPy is, the last steps are done by it, too.
"""

import importlib.util
import tempfile
from pathlib import Path

import numpy as np

import jointfrf as jf

# %%
# What stands for the measurement: two free blocks, a joint in six DOFs, at each block three sensors of three axes and
# nine hits. The tables have the columns that pyFBS reads from a spreadsheet; what
# ``pandas.read_excel("test.xlsx", sheet_name="Channels_AB").to_dict("records")`` gives looks the same.
freq = np.arange(20.0, 1200.0, 4.0)  # Hz
dofs = ["x", "y", "z", "theta_x", "theta_y", "theta_z"]
stiffness, damping = [2e7, 2e7, 3e7, 6e3, 8e3, 7e3], [90.0, 90.0, 120.0, 0.03, 0.04, 0.03]
joint = jf.Joint(stiffness, damping, dofs)
where = {1: [(-0.03, 0.02, 0.01), (-0.03, -0.02, 0.0), (-0.05, 0.0, 0.02)],
         2: [(0.03, 0.02, -0.01), (0.04, -0.02, 0.0), (0.05, 0.01, 0.02)]}  # fmt: skip


def table(letter):
    """Rows of a table of channels or of impacts: three directions at each place of both sides."""
    return [
        {"Name": f"{letter}{3 * (side - 1) + i + 1}{axis}", "Quantity": "Acceleration", "Grouping": side,
         **{f"Position_{a + 1}": float(x) for a, x in enumerate(place)},
         **{f"Direction_{a + 1}": float(axis == "xyz"[a]) for a in range(3)}}
        for side, places in where.items() for i, place in enumerate(places) for axis in "xyz"
    ]  # fmt: skip


df_chn, df_imp = table("S"), table("H")


def vectors(rows, what):
    """Three columns of a table as an array."""
    return np.array([[row[f"{what}_{a}"] for a in (1, 2, 3)] for row in rows])


blocks = [jf.rigid_body(m, [m / 900] * 3, {"joint": at}) for m, at in ((1.4, (0.04, 0, 0)), (0.9, (-0.04, 0.01, 0)))]
h_a, h_b = (block.receptance(freq, block.ports(*(f"joint:{dof}" for dof in dofs))) for block in blocks)
at_joint = jf.couple(h_a, h_b, joint.dynamic_stiffness(freq), range(6), range(6))
side = np.array([row["Grouping"] for row in df_chn])
arms = np.hstack([vectors(df_chn, "Direction"), np.cross(vectors(df_chn, "Position"), vectors(df_chn, "Direction"))])
r = np.hstack([arms * (side == 1)[:, None], arms * (side == 2)[:, None]])  # rigid motion of every channel
accelerance = -((2 * np.pi * freq) ** 2)[:, None, None] * (r @ at_joint @ r.T)
y = jf.pollute(accelerance, 0.01, seed=1)  # (lines, responses, forces), as pyFBS has it
print(y.shape, df_chn[0])

# %%
# From pyFBS
# ----------
# `jf.io.from_pyfbs` takes the array and both tables. ``Grouping`` tells the sides apart; the tables do not state
# the unit of their positions. An array of SDynPy or MATLAB has its lines last: ``axes="out,in,freq"``.
test = jf.io.from_pyfbs(freq, y, df_chn, df_imp, unit="m/s^2/N", position_unit="m", sides={1: "j", 2: "k"})
frfs, places = test
print(frfs)

# %%
# Virtual points, FRFs of their channels, a look at them, the fit: all of the path in four lines.
channels = jf.joint_channels(frfs, places, at=[0, 0, 0], dofs=dofs)
gamma = channels.gamma(frfs.receptance())
print(jf.check_frfs(freq, gamma, joint=channels).ok)
fit = jf.identify(freq, gamma, transform=channels.transform)
for name, true in zip((f"k_{dof}" for dof in dofs), stiffness, strict=True):
    low, high = fit.confidence_interval(0.95)[name]
    print(f"{name:10} {fit.value[name]:.4g}, 95 % {low:.4g} .. {high:.4g}, true {true:.4g}")

# %%
# To pyFBS
# --------
# ``tu`` and ``tf`` of pyFBS are here the transforms of both sides, one for responses and one for forces. The FRFs of
# the virtual points are an array of its shape, and the joint is the one that its decoupling gives line by line, without
# the scatter of single lines.
t_u, t_f = channels.responses.transform, channels.forces.transform
y_vp = jf.transform(gamma, t_u, t_f)
print(y_vp.shape, fit.k_joint(freq).shape)

if importlib.util.find_spec("pyfbs"):
    import pandas as pd
    from pyfbs.interface.vpt import VPT

    def virtual(words):
        rows = [
            {"Grouping": side, "Description": word, **{f"Position_{a}": 0.0 for a in (1, 2, 3)},
             **{f"Direction_{a}": 0.0 for a in (1, 2, 3)}}
            for side in (1, 2) for word in words.split()
        ]  # fmt: skip
        return pd.DataFrame(rows)

    vpt = VPT(pd.DataFrame(df_chn), pd.DataFrame(df_imp), virtual("ux uy uz rx ry rz"), virtual("fx fy fz mx my mz"))
    vpt.apply_vpt(freq, gamma)
    print(f"differs from pyFBS by {abs(vpt.frf - y_vp).max() / abs(y_vp).max():.0e} of the largest")
else:
    print("pyFBS is not installed")

# %%
# To and from SDynPy
# ------------------
# SDynPy has coordinates as records of node and direction, and the lines last. `jf.io.to_sdynpy` returns its structured
# array, `jf.io.from_sdynpy` takes one; `jf.io.to_escdf` and `jf.io.from_escdf` do the same for ESCDF.
array = jf.io.to_sdynpy(frfs)
print(array.shape, array["coordinate"][0, 0].tolist())

if importlib.util.find_spec("sdynpy"):
    import sdynpy as sdpy

    array = array.view(sdpy.data.TransferFunctionArray)
    print("held by SDynPy:", type(array).__name__, array.shape)
else:
    print("SDynPy is not installed")

back = jf.io.from_sdynpy(array, unit="m/s^2/N")
print(back.responses == frfs.responses, back.excitations == frfs.excitations, np.array_equal(back.h, frfs.h))

# %%
# To and from MATLAB, and to any other program
# --------------------------------------------
# ``jf.io.write_frfs`` takes the format from the suffix: a Universal File for SDynPy and test systems, ``.npz``.
# A ``.mat`` of MATLAB is read whatever its fields are called (``mapping=``), with its lines first or last.
with tempfile.TemporaryDirectory() as folder:
    paths = [Path(folder) / f"test.{suffix}" for suffix in ("mat", "uff", "npz")]
    for path in paths:
        jf.io.write_frfs(path, frfs)
        again = jf.io.read_frfs(path)
        error = abs(again.matrix(frfs.responses, frfs.excitations) - frfs.h).max() / abs(frfs.h).max()
        print(path.suffix, again.quantity, again.h.shape, f"{error:.0e}")
