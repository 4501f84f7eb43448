"""Curves of a scene: from their description in the model file to their geometry."""

from __future__ import annotations

from collections.abc import Mapping
from math import pi

import numpy as np

from exudyn_flexlink.curves import (
    CircleArc,
    Curve,
    CurveError,
    EllipseArc,
    Joined,
    Laps,
    LineSegment,
    Spline,
)
from exudyn_flexlink.scene import (
    CircleSpec,
    CurveSpec,
    EllipseSpec,
    JoinedSpec,
    LapsSpec,
    LineSpec,
    Scene,
    SplineSpec,
)
from exudyn_flexlink.source import Mistake


def build_curves(scene: Scene) -> tuple[dict[str, Curve], list[Mistake]]:
    """Build every curve of a scene; those that can't be are left out, with a mistake each."""
    curves: dict[str, Curve] = {}
    mistakes: list[Mistake] = []
    for name, spec in scene.curves.items():
        try:
            curves[name] = build_curve(spec, scene.curves)
        except CurveError as error:
            mistakes.append(_mistake(name, spec, error))
    return curves, mistakes


def build_curve(  # noqa: PLR0911 - one return for each type
    spec: CurveSpec | str, named: Mapping[str, CurveSpec]
) -> Curve:
    """Build one curve; names in it are looked up in `named`.

    Raises:
        CurveError: the curve can't be: a gap or kink between pieces, laps that do not meet.

    """
    if isinstance(spec, str):
        return build_curve(named[spec], named)
    if isinstance(spec, EllipseSpec):
        first, last = _angles(spec)
        return EllipseArc(spec.centre, spec.semi_axes, spec.rotation, first, last)
    if isinstance(spec, CircleSpec):
        return CircleArc(spec.centre, spec.radius, *_angles(spec))
    if isinstance(spec, LineSpec):
        return LineSegment(spec.from_, spec.to)
    if isinstance(spec, SplineSpec):
        return Spline(np.asarray(spec.points, dtype=float), closed=spec.closed)
    if isinstance(spec, JoinedSpec):
        return Joined(tuple(build_curve(piece, named) for piece in spec.pieces))
    return Laps(tuple(build_curve(lap, named) for lap in spec.curves), meet=spec.meet)


def _angles(spec: EllipseSpec | CircleSpec) -> tuple[float, float]:
    if spec.from_ is None or spec.to is None:
        return 0.0, 2 * pi
    return spec.from_, spec.to


def _mistake(name: str, spec: CurveSpec, error: CurveError) -> Mistake:
    path: tuple[str | int, ...] = ("curves", name)
    if error.piece is not None and isinstance(spec, JoinedSpec):
        path = (*path, "pieces", error.piece)
    elif error.piece is not None and isinstance(spec, LapsSpec):
        path = (*path, "curves", error.piece)
    return Mistake(path, error.message, error.hint)
