"""What it takes to make a run again: its scene as a model file, and a command."""

from __future__ import annotations

import json

import yaml

from exudyn_flexlink.measured_error import NOT_ASKED
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene
from exudyn_flexlink.source import LARGEST_FILE

MODEL = "model.yaml"
"""Name under which the page offers the model file."""

WIDTH = 100  # columns of the model file


def model_text(scene: Scene) -> str | None:
    """Return the scene as a model file, in SI units; None if it is too long to be read as one.

    Points of splines, and tables, that came from files of their own are in it.
    """
    data = scene.to_data()
    if len(json.dumps(data, ensure_ascii=False).encode("utf-8")) > LARGEST_FILE // 2:
        return None  # YAML takes more room, and its reader some seconds
    text: str = yaml.safe_dump(
        data, sort_keys=False, allow_unicode=True, default_flow_style=None, width=WIDTH
    )
    return text


def command_of(result: Result) -> str:
    """Return the command that makes the run again from its model file."""
    words = ["python -m exudyn_flexlink simulate", MODEL]
    if result.engine != "exudyn":
        words.append(f"--engine {result.engine}")
    if result.error == NOT_ASKED:
        words.append("--no-measure")
    return " ".join(words)
