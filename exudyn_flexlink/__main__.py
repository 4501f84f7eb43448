"""Run the program: ``python -m exudyn_flexlink``."""

import sys

from exudyn_flexlink.cli import main

if __name__ == "__main__":
    sys.exit(main())
