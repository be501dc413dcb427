"""`python -m jointfrf`."""

import os
import sys
from pathlib import Path

# Python has put the working directory first among the places of modules.
_HERE = os.getcwd()
if not sys.flags.safe_path and sys.path[:1] == [_HERE] and Path(__file__).resolve().parents[1] != Path(_HERE).resolve():
    del sys.path[0]

from jointfrf.cli.main import main  # noqa: E402

if __name__ == "__main__":  # workers of MPI import this
    sys.exit(main())
