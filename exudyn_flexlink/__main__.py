"""Run the program: ``python -m exudyn_flexlink``."""

import os
import sys

from exudyn_flexlink.cli import main

# The Lagrangian's code runs as fast with the compiler's lowest level, and is there a third sooner.
os.environ.setdefault("NUMBA_OPT", "1")

if __name__ == "__main__":
    sys.exit(main())
