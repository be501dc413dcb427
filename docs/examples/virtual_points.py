"""
From a measured file to a joint, in Python
==========================================

A hammer test, channel by channel: read the file, look at the data, put the channels of both sides together into the
DOFs of the joint, fit, and write the page and the card of an FE program.
"""

import jointfrf as jf

frfs = jf.io.read_frfs("../../cases/hammer-test/two_bars.uff")
print(frfs.quantity, frfs.h.shape, "from", frfs.freq_hz[0], "to", frfs.freq_hz[-1], "Hz")

# %%
# Which channels are on which side: by node here, or by a table of channels (`jointfrf.io.read_channel_table`). The
# joint lies 0.49 m along the bars; what is sought are its deflection and its rotation.
places = jf.places_of_nodes(frfs, [101, 102], [201, 202])
channels = jf.joint_channels(frfs, places, at=[0.49, 0, 0], dofs=["y", "rz"])
print(channels.dofs)

# %%
# Before the fit: is anything wrong with a channel? Findings are sentences, and say what cures it.
receptance = frfs.receptance()
gamma = channels.gamma(receptance)
seen = jf.check_frfs(receptance.freq_hz, gamma, joint=channels)
print(seen.ok, [str(finding) for finding in seen.findings])

# %%
# `transform` hands the geometry to the fit, which works on the channels as they were measured.
fit = jf.identify(receptance.freq_hz, gamma, transform=channels.transform)
print(fit)

# %%
# A function of the parameters has an interval, too; the card goes into the FE model.
print(fit.derived("k_theta_z / k_y"))
print(jf.cards(fit, "nastran", (9001, 9002)))
