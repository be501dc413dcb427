"""jax.numpy.linalg, compiled by XLA for the processor, complex128, one thread."""

from __future__ import annotations

import os
from collections.abc import Callable

import numpy as np

from ..data import Array, Data
from .peer import NotThereError, Peer


def load() -> list[Peer]:
    """Import it and hold it to one thread."""
    # Read when XLA makes its threads: the processors that it sees, and Eigen's use of them.
    os.environ["NPROC"] = "1"
    os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false"
    os.environ["JAX_PLATFORMS"] = "cpu"
    try:
        import jax
        import jax.numpy as jnp
    except ImportError as error:
        raise NotThereError(f"{error} (see --help)") from None
    jax.config.update("jax_enable_x64", True)

    def timed(function: Callable[..., jax.Array], *names: str) -> Callable[[Data], Callable[[], Array]]:
        compiled = jax.jit(function)

        def prepare(data: Data) -> Callable[[], Array]:
            arrays = [jax.block_until_ready(jnp.asarray(data[name])) for name in names]
            return lambda: np.asarray(compiled(*arrays))

        return prepare

    def ismm(alpha: jax.Array, gamma: jax.Array, k: jax.Array) -> jax.Array:
        n = k.shape[1]
        columns = (alpha - gamma) @ jnp.linalg.inv(gamma)[:, :, n:]
        return k - jnp.linalg.inv(alpha)[:, :n] @ columns

    operations = {
        "invert": timed(jnp.linalg.inv, "a"),
        "solve_1": timed(jnp.linalg.solve, "a", "b"),
        "solve_n": timed(jnp.linalg.solve, "a", "b"),
        "ismm": timed(ismm, "alpha", "gamma", "k"),
    }
    return [Peer("JAX", f"JAX {jax.__version__}, jit, with the LAPACK of scipy", operations)]
