"""The commands that solve nothing: `check`, `plot`, `schema`."""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from exudyn_flexlink.cli.copying import holds_schema
from exudyn_flexlink.cli.figures import look_of
from exudyn_flexlink.cli.keeping import why_not, write_figure
from exudyn_flexlink.cli.simulating import read_scene
from exudyn_flexlink.cli.sweeping import draw_sweep
from exudyn_flexlink.cli.terminal import BAD_INPUT, DONE, FAILED, complain, refuse, tell
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import Assembly, formulation_mistakes
from exudyn_flexlink.report import check_text
from exudyn_flexlink.scene import Scene, json_schema
from exudyn_flexlink.source import SceneError, did_you_mean
from exudyn_flexlink.storage import (
    StorageError,
    is_sweep,
    load,
    load_sweep,
    replace_file,
    staged_files,
)
from exudyn_flexlink.sweeps import SweepTable

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def check_command(options: argparse.Namespace) -> int:
    """Check a model without simulating it; returns the exit code."""
    try:
        scene = read_scene(options)
        assembly = assemble_scene(scene)
        refused = formulation_mistakes(scene)
        if refused:
            raise SceneError(scene.document, refused)
    except SceneError as error:
        return complain(str(error), BAD_INPUT)
    tell(f"{options.model}: no mistakes\n\n{check_text(scene, assembly)}")
    if options.figure is None:
        return DONE
    return write_figure(options.figure, lambda: _start(scene, assembly), force=options.force)


def _start(scene: Scene, assembly: Assembly) -> Figure:
    from exudyn_flexlink.plots import start

    return start(scene, assembly)


def plot_command(options: argparse.Namespace) -> int:
    """Draw the figures of a saved run, or of a sweep, again; returns the exit code."""
    folder: Path = options.out or options.run
    try:
        swept = load_sweep(options.run) if is_sweep(options.run) else None
        unknown = _unknown(options.of, swept)
        if unknown:
            return complain(unknown, BAD_INPUT)
        result = load(options.run) if swept is None else None
        with staged_files(folder, force=options.force) as staged:
            if result is not None:
                look_of(options).save_run(result, staged)
            if swept is not None:
                draw_sweep(swept, staged, options, options.of)
    except StorageError as error:
        return refuse(error)
    except Exception as error:  # a mistake of the program: the run itself is sound
        return complain(f"no figures: {why_not(error)}; please report it", FAILED)
    print(f"Figures written to {folder}{os.sep}")
    return DONE


def _unknown(names: Sequence[str], swept: SweepTable | None) -> str:
    """Say which names are no observables of a sweep; empty if all are."""
    if not names or swept is None:
        return "'--of' is for the folder of a sweep" if names else ""

    known = swept.observables
    wrong = [f"no column '{one}'{did_you_mean(one, known)}" for one in names if one not in known]
    return f"{'; '.join(wrong)}. There are: {', '.join(known)}" if wrong else ""


def schema_command(options: argparse.Namespace) -> int:
    """Print, or write, the JSON schema of model files; returns the exit code."""
    text = json.dumps(json_schema(), indent=2, ensure_ascii=False) + "\n"
    if options.out is None:
        print(text, end="")
        return DONE
    try:
        replace_file(options.out, text.encode(), holds_schema, force=options.force)
    except StorageError as error:
        return refuse(error)
    return DONE
