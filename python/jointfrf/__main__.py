"""`python -m jointfrf`."""

import sys

from jointfrf.cli.main import main

if __name__ == "__main__":  # workers of MPI import this
    sys.exit(main())
