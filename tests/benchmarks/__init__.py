"""How fast the operations are: against the limits of the machine, numpy, and a loop over LAPACK."""

import os
import sys

# Before numpy loads its BLAS; afterwards these would only change programs that this process starts.
if "numpy" not in sys.modules:
    # At these orders threads within a line do harm, to numpy most of all.
    for _name in ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[_name] = "1"
    # Every BLAS chooses its own kernels.
    os.environ.pop("OPENBLAS_CORETYPE", None)
