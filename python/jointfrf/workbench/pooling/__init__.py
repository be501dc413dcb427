"""Fits of the same joint in several assemblies: mean, spread, what the next one will be; one joint in two structures.

`random_effects` is the statistics of one parameter, `pool` the door for fits, `transfer` the comparison of structures.
"""
