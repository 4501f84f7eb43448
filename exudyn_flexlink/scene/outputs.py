"""What is told of a run."""

from __future__ import annotations

from pydantic import Field

from exudyn_flexlink.scene.base import MovingPointName, Part


class Outputs(Part):
    """What figures show, and of which points errors are told."""

    watch: MovingPointName | None = Field(
        None,
        description="the point 'body.point' that figures and tables show, and the only one by "
        "which errors are judged; left out: the point that strikes, else the end of a body, and "
        "errors are judged by all named points",
    )
