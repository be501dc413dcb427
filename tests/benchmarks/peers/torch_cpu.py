"""torch.linalg on complex128 batches, one thread."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..data import Array, Data
from .peer import NotThereError, Peer


def load() -> list[Peer]:
    """Import it and hold it to one thread."""
    try:
        import torch
    except ImportError as error:
        raise NotThereError(f"{error} (see --help)") from None
    torch.set_num_threads(1)
    torch.set_num_interop_threads(1)
    linalg = torch.linalg

    def timed(function: Callable[..., torch.Tensor], *names: str) -> Callable[[Data], Callable[[], Array]]:
        def prepare(data: Data) -> Callable[[], Array]:
            arrays = [torch.from_numpy(np.ascontiguousarray(data[name])) for name in names]

            def call() -> Array:
                with torch.inference_mode():
                    result: Array = function(*arrays).numpy()
                return result

            return call

        return prepare

    def ismm(alpha: torch.Tensor, gamma: torch.Tensor, k: torch.Tensor) -> torch.Tensor:
        n = k.shape[1]
        columns = (alpha - gamma) @ linalg.inv(gamma)[:, :, n:]
        return k - linalg.inv(alpha)[:, :n] @ columns

    capability = torch.backends.cpu.get_cpu_capability()
    blas = "MKL" if torch.backends.mkl.is_available() else "its own LAPACK"
    operations = {
        "invert": timed(linalg.inv, "a"),
        "solve_1": timed(linalg.solve, "a", "b"),
        "solve_n": timed(linalg.solve, "a", "b"),
        "ismm": timed(ismm, "alpha", "gamma", "k"),
    }
    return [Peer("torch", f"torch {torch.__version__} with {blas}, {capability}", operations)]
