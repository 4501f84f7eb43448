"""Run the program: ``python -m exudyn_flexlink``, or ``exudyn-flexlink`` where it is installed."""

import os
import sys

# Figures are written and never shown: a backend that a notebook left behind has no say in them.
os.environ["MPLBACKEND"] = "agg"

try:
    from exudyn_flexlink.cli import main
except KeyboardInterrupt:  # while it was read
    sys.exit(130)

if __name__ == "__main__":
    sys.exit(main())
