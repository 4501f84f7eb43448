"""Run the program: ``python -m exudyn_flexlink``, or ``exudyn-flexlink`` where it is installed."""

import os
import sys

# Figures are written and never shown: a backend that a notebook left behind has no say in them.
os.environ["MPLBACKEND"] = "agg"

# With "-m" Python looks for modules in the current folder first. There a random.py of the user's
# stands for Python's own, but not behind all others. A clone needs its folder first for itself.
if __name__ == "__main__" and sys.path[0] != os.path.dirname(os.path.dirname(__file__)):
    sys.path.append(sys.path.pop(0))

try:
    from exudyn_flexlink.cli import main
except KeyboardInterrupt:  # while it was read
    sys.exit(130)

if __name__ == "__main__":
    sys.exit(main())
