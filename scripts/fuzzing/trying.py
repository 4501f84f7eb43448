"""Handing one input to the loader, and what is a finding: anything but a scene or a SceneError."""

from __future__ import annotations

import traceback
import warnings
from pathlib import Path

from exudyn_flexlink.loading import assemble_scene, load_scene
from exudyn_flexlink.report import check_text
from exudyn_flexlink.source import SceneError
from fuzzing.inputs import Input
from fuzzing.limits import TooLongError, limited

LONGEST = 20.0  # s of processor time that an input may take


def loads(given: Input, folder: Path) -> bool:
    """Load an input and say what it means, as the command `check` does; False if it is refused.

    Raises whatever the loader lets out that is no SceneError: warnings, too.
    """
    path = given.write(folder)
    with warnings.catch_warnings(), limited(LONGEST):
        warnings.simplefilter("error")
        try:
            scene = load_scene(path, given.settings)
            check_text(scene, assemble_scene(scene))
        except SceneError as error:
            str(error)  # it can be shown
            return False
    return True


def signature(error: BaseException) -> str:
    """Tell one finding from another: the kind of error and the package's line that it came by."""
    frames = traceback.extract_tb(error.__traceback__)
    own = [f for f in frames if "exudyn_flexlink" in f.filename] or list(frames)
    last = own[-1]
    # Where time ran out is chance: the outermost line tells more.
    if isinstance(error, TooLongError):
        last = own[min(3, len(own) - 1)]
    return f"{type(error).__name__} at {Path(last.filename).name}:{last.lineno}"
