"""Solid bodies of eight-node bricks.

In reading order: `brick` (elements and their assembly), `mesh` (structured meshes), `solid` (a model: supports and
reference points), `brick_beam`, `interpolation` (points between nodes); and for the bolted joint `bolt`, `bolted_lap`
(its mesh), `contact_pairs`, `contact` (one-sided, with friction), `preload` (the tightened state, its contact
pressure, the linear model about it).
"""
