"""The command `stability`: does a motion repeat itself, do neighbours part, and how fast."""

from __future__ import annotations

import argparse
from functools import partial

from exudyn_flexlink import stability
from exudyn_flexlink.cli.keeping import written
from exudyn_flexlink.cli.placing import Place
from exudyn_flexlink.cli.running import read_scene, refuse_idle_integrator, studying
from exudyn_flexlink.cli.terminal import BAD_INPUT, FAILED, INTERRUPTED, complain
from exudyn_flexlink.loading import require_length
from exudyn_flexlink.report import stability_text
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.storage import save_stability

IMPOSSIBLE = stability.ImpossibleLapsError, stability.NoRhythmError, stability.TooShortError
UNTOLD = "interrupted before the exponent was known; nothing was written"


def stability_command(options: argparse.Namespace) -> int:
    """Study a model's motion, write and print how stable it is; returns the exit code."""
    place = Place(options, "-stability", "stability")
    refuse_idle_integrator(options, options.engine)
    scene = read_scene(options)
    require_length("--tolerance", options.tolerance, scene)
    try:
        # The folder is staged first: one that can't be written is no news for the end of a study.
        with place.written() as folder:
            found = _studied(scene, options)
            told = stability_text(found)
            code = written(
                found, folder, options, partial(save_stability, sentence=told), "stability"
            )
    except IMPOSSIBLE as error:
        return complain(f"{error}\n{_advice(error, options)}", BAD_INPUT)
    except stability.StoppedError as error:
        return complain(str(error), FAILED)
    except KeyboardInterrupt:
        return complain(UNTOLD, INTERRUPTED)
    place.tell(told)
    return place.ended(code, "the study is whole")


def _advice(error: Exception, options: argparse.Namespace) -> str:
    if isinstance(error, stability.TooShortError):
        return f"hint: more than '--laps {options.laps}', or less than '--after {options.after}'"
    if isinstance(error, stability.ImpossibleLapsError):
        return "hint: '--laps' says how many, '--lap' how many seconds each takes"
    return "hint: '--lap SECONDS'"


def _studied(scene: Scene, options: argparse.Namespace) -> stability.Stability:
    asked = stability.Asked(
        options.laps, options.after, options.lap, options.at, options.tolerance, options.twice
    )
    with studying(scene, options, "stability") as (simulate, bar):
        return stability.study(scene, simulate, asked, bar)
