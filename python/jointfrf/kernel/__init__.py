"""Interface to the compiled kernel: the only package that imports `jointfrf._kernel`.

`arguments` checks the arguments of a caller, in memory or in a file; `call` runs a routine over the frequency lines,
turns their status into exceptions and warnings, and chooses the engine; `linear_algebra` contains functions without
physics.
"""
