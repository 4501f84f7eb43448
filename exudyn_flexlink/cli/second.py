"""The program of the process that makes the second run of a scene.

See `engines.interrupts`: the argument is a folder, which holds the request and gets the result.
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
    """Make the run; write its result, or an error that the caller expects, into the folder."""
    parent = os.getppid()

    def note(done: float) -> None:
        if os.getppid() != parent:  # nobody waits for the result any more
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
