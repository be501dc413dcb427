"""Matrices, names of DOFs and coordinates of nodes as finite-element programs write them.

In reading order: `matrix_format` (what a format consists of), one module a format, `matrix_formats` (the table, and
`read_matrix`), `bulk` and `deck` (cards of Nastran; keywords of Abaqus and CalculiX), `dof_names`, `nodes`.
"""
