"""The way into the compiled kernel: the only room that imports `jointfrf._kernel`.

`arguments` checks what a caller passes, `call` runs a routine over the frequency lines, `status` turns its status into
exceptions and warnings, `memory_maps` works on arrays in files chunk by chunk; `engine` chooses the engine, and
`linear_algebra` holds what has no physics.
"""
