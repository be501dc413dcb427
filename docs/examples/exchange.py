"""
Arrays and tables of other tools
================================

FRFs as pyFBS and SDynPy hold them, tables of sensors and impacts as pyFBS reads them from a spreadsheet, and the way
back. Nothing of these tools is needed here: arrays and columns are what goes to and fro.
"""

import numpy as np

import jointfrf as jf

# %%
# pyFBS and FRF matrices of sdypy have shape (lines, responses, forces): it is the shape of jointfrf, and nothing is
# copied. An array of MATLAB or SDynPy has the lines last.
rng = np.random.default_rng(1)
lines_last = rng.standard_normal((6, 6, 200)) + 1j * rng.standard_normal((6, 6, 200))
lines_first = np.moveaxis(lines_last, -1, 0)
print(lines_first.shape)

# %%
# A table of channels of pyFBS: a row each, position in metres, direction as a vector. The same columns of impacts.
df_chn = {  # what `pandas.read_excel("test.xlsx", sheet_name="Channels_AB").to_dict("list")` gives
    "Name": ["S1", "S1", "S1", "S2", "S2", "S2"],
    "Position_1": [-0.02, -0.02, -0.02, 0.02, 0.02, 0.02],
    "Position_2": [0.01, 0.01, 0.01, -0.01, -0.01, -0.01],
    "Position_3": [0.0, 0.0, 0.0, 0.02, 0.02, 0.02],
    "Direction_1": [1, 0, 0, 1, 0, 0],
    "Direction_2": [0, 1, 0, 0, 1, 0],
    "Direction_3": [0, 0, 1, 0, 0, 1],
}
positions = np.column_stack([df_chn[f"Position_{i}"] for i in (1, 2, 3)])
directions = np.column_stack([df_chn[f"Direction_{i}"] for i in (1, 2, 3)])

# %%
# The virtual point of one side: what pyFBS calls `VPT` with `Ru` and `Tu` is here the geometry of the point, and its
# transform.
point = jf.virtual_point(positions, directions, [0, 0, 0], ["x", "y", "z", "theta_x", "theta_y"])
print(point.dofs, point.transform.shape)

# %%
# Back: FRFs with names and coordinates as a file that all of them read. `write_frfs` takes the format from the suffix:
# a Universal File for SDynPy and test systems, a `.mat` or `.npz` with named arrays for MATLAB and Python.
channels = tuple(jf.io.Channel(1 + i // 3, "xyz"[i % 3]) for i in range(6))
places = {1: tuple(positions[0]), 2: tuple(positions[3])}
frfs = jf.io.FrfSet(np.arange(1.0, 201.0), channels, channels, lines_first, "accelerance", places)
print(frfs.receptance().matrix(channels, channels).shape)

# %%
# In MATLAB: ``[m, n, l] = size(H)`` has the lines last, so ``permute(H, [3 1 2])`` before ``save``, or the same with
# `numpy.moveaxis` after `scipy.io.loadmat`.
