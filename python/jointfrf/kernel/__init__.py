"""The way into the compiled kernel: the only room that imports `jointfrf._kernel`.

`arguments` checks what a caller passes, in memory or in a file; `call` runs a routine over the frequency lines and
chooses the engine; `status` turns its status into exceptions and warnings; `linear_algebra` holds what has no physics.
"""
