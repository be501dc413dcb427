"""`python -m jointfrf`."""

import sys

from jointfrf.cli.main import main

sys.exit(main())
