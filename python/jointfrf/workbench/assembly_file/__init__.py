"""`assembly.toml`: an assembly, its unknowns, and the DOFs of the channels of a measurement.

In reading order: `modes` (a part known by its modes), `keys` (keys of the file), `read` (from keys to an assembly),
`measured` (with FRFs of a test), `side_part` (one part as the model of a flexible side), `template` (a file to begin
with).
"""
