"""Fits of the same joint in several assemblies: mean, spread and prediction interval; one joint in two structures.

`random_effects` is the statistics of one parameter, `pool` the public function, `transfer` compares structures.
"""
