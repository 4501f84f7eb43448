"""What the program does in the process that it starts for the second run of a scene.

See `engines.beside`: the folder that is its argument holds what is asked for, and gets the result.
"""

from __future__ import annotations

import os
import pickle
import sys
from pathlib import Path

from exudyn_flexlink.cli.keeping import ends_runs
from exudyn_flexlink.engines import LateInterruptError, second_run
from exudyn_flexlink.engines.interrupts import ASKED, DONE, MADE


def main(folder: Path) -> None:
    """Make the run; one that goes wrong is told by its exception."""
    parent = os.getppid()

    def note(done: float) -> None:
        if os.getppid() != parent:  # nobody waits for it any more
            os._exit(1)
        (folder / DONE).write_text(f"{done:.4f}")

    scene, engine = pickle.loads((folder / ASKED).read_bytes())
    made: object
    try:
        with ends_runs():
            made = second_run(scene, engine, note)
    except (LateInterruptError, MemoryError) as error:
        made = error
    part = folder / f"{MADE}.part"
    part.write_bytes(pickle.dumps(made))
    part.replace(folder / MADE)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
