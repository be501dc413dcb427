"""Solid bodies of eight-node bricks.

In reading order: `brick` (elements and their assembly), `mesh` (structured meshes, points between nodes), `solid` (a
model: supports and reference points), `brick_beam`.
"""
