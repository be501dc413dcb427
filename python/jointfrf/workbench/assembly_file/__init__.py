"""`assembly.toml`: an assembly, what is unknown of it, and which channel of a measurement is which of its DOFs.

In reading order: `modes` (a part known by its modes), `keys` (what the file may say), `read` (from keys to an
assembly), `measured` (with FRFs of a test), `side_part` (one part as the model of a side that bends); `template` (a
file to begin with).
"""
