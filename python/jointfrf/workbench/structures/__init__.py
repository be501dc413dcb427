"""Structures as tables of TOML, which cases and assembly files share.

keys           keys of several tables: a material, a file of FRFs with its map and unit
structure      one of the structures that a joint connects: a model or FRFs
substructures  all kinds of structures: chains, beams, plates, bricks, files of matrices, FRFs
"""
