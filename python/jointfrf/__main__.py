"""The command `jointfrf`, and `python -m jointfrf`; its modules are imported after Ctrl-C is handled."""

import os
import sys
from pathlib import Path

# `python -m` puts the working directory first in the search path of modules; the script of the command does not.
_HERE = os.getcwd()
if (
    __name__ != "jointfrf.__main__"
    and not sys.flags.safe_path
    and sys.path[:1] == [_HERE]
    and Path(__file__).resolve().parents[1] != Path(_HERE).resolve()
):
    del sys.path[0]


def main() -> int:
    """Run the command line; return the exit status, 130 after Ctrl-C."""
    try:
        from jointfrf.workbench.cli.main import main as run
    except KeyboardInterrupt:
        print("jointfrf: error: interrupted", file=sys.stderr)
        return 130
    return run()


if __name__ == "__main__":  # workers of MPI import this
    sys.exit(main())
