"""Other libraries that invert and solve many small systems, timed where they are there.

They compute in a process of their own (`process.py`, asked by `client.py`): their OpenMP, LAPACK and thread control do
not meet those of jointfrf. `eigen.py`, `mkl.py`, `torch_cpu.py` and `jax_cpu.py` each hold one library: what has to be
set before it is loaded, and `load`, which gives its peers or raises `NotThereError`.
"""
