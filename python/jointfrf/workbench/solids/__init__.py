"""Solid bodies of eight-node bricks.

In reading order: `brick` (elements and their assembly), `mesh` (structured meshes, points between nodes), `solid` (a
model: supports and reference points), `brick_beam`; and for the bolted joint `bolted_lap` (the bolt, the mesh),
`contact` (one-sided, with friction), `preload` (the tightened state, its contact pressure, the linear model about it).
"""
