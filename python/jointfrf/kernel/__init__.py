"""The way into the compiled kernel: the only room that imports `jointfrf._kernel`.

`arguments` checks what a caller passes, in memory or in a file; `call` runs a routine over the frequency lines, turns
their status into exceptions and warnings, and chooses the engine; `linear_algebra` holds what has no physics.
"""
