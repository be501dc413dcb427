"""`python -m jointfrf`."""

import sys

from jointfrf.cli import main

sys.exit(main())
