"""The one place that imports Exudyn, and how its console and item types are reached."""

from __future__ import annotations

import sys
from contextlib import redirect_stdout
from io import StringIO
from typing import Any

# The range-checked build is meant for writing models by hand; ours are checked before they get
# here. Whoever has loaded Exudyn already keeps the build they chose.
if "exudyn" not in sys.modules:
    sys.exudynFast = True  # type: ignore[attr-defined]

with redirect_stdout(StringIO()):  # it announces that build on standard output
    import exudyn
    from exudyn import advancedUtilities, itemInterface

exudyn.config.printToConsole = False

Engine: Any = exudyn
items: Any = itemInterface
utilities: Any = advancedUtilities
