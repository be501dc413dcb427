"""Matrices, names of DOFs and coordinates of nodes as finite-element programs write them.

In reading order: `matrix_format` (what a format consists of), one module a format or program, `matrix_formats` (the
table, and `read_matrix`), `bulk` (cards of Nastran), `nodes` (coordinates, and names of DOFs).
"""
