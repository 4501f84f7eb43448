"""Curves of a scene: from their description in the model file to their geometry."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from math import pi

import numpy as np

from exudyn_flexlink.curves import (
    Arc,
    Curve,
    CurveError,
    Joined,
    Laps,
    LineSegment,
    Spline,
    circle_arc,
    closing,
    is_convex,
)
from exudyn_flexlink.scene import (
    CircleSpec,
    CurveSpec,
    EllipseSpec,
    JoinedSpec,
    LapsSpec,
    LineOnCurve,
    LineSpec,
    Scene,
    SplineSpec,
)
from exudyn_flexlink.source import KeyPath, Mistake


def build_curves(
    specs: Mapping[str, CurveSpec | None],
) -> tuple[dict[str, Curve], list[Mistake]]:
    """Build every named curve that can be; the others are left out, with a mistake each.

    Only mistakes of geometry are reported: a curve that has none of its own, but contains one that
    is invalid (None), unknown, cyclic or can't be built, is left out in silence.
    """
    builder = _CurveBuilder(specs)
    built = {name: builder.named(name) for name in specs}
    return {name: curve for name, curve in built.items() if curve is not None}, builder.mistakes


def hollow_mistakes(scene: Scene, curves: Mapping[str, Curve]) -> Iterator[Mistake]:
    """Refuse curves on which a straight face would have no one place, or an end."""
    for name, contact in scene.contacts.items():
        if isinstance(contact, LineOnCurve) and contact.curve in curves:
            path, curve = ("contacts", name, "curve"), curves[contact.curve]
            if not curve.closed:
                yield Mistake(path, f"'{contact.curve}' is open: a face lies on a closed curve")
            elif not is_convex(curve):
                message = f"'{contact.curve}' is not convex everywhere, or straight somewhere"
                hint = "a face touches hollows nowhere, and straight stretches all along"
                yield Mistake(path, message, f"{hint}; 'point_on_curve' is for them")


class _CurveBuilder:
    """Builds every curve once; one under construction counts as None, which ends a cycle."""

    def __init__(self, specs: Mapping[str, CurveSpec | None]) -> None:
        self.specs = specs
        self.built: dict[str, Curve | None] = {}
        self.mistakes: list[Mistake] = []

    def named(self, name: str) -> Curve | None:
        if name not in self.built:
            self.built[name] = None
            self.built[name] = self._build(("curves", name), self.specs.get(name))
        return self.built[name]

    def _inner(self, path: KeyPath, spec: CurveSpec | str) -> Curve | None:
        """Curve that is a piece or a lap of another, written there or named."""
        curve = self.named(spec) if isinstance(spec, str) else self._build(path, spec)
        return None if isinstance(curve, Laps) else curve  # laps have no inner laps

    def _build(self, path: KeyPath, spec: CurveSpec | None) -> Curve | None:
        if spec is None or (isinstance(spec, SplineSpec) and spec.points is None):
            return None  # invalid, or its file of points can't be read
        if not isinstance(spec, (JoinedSpec, LapsSpec)):
            return self._try(path, lambda: _simple(spec), "points")
        key = "pieces" if isinstance(spec, JoinedSpec) else "curves"
        inner = spec.pieces if isinstance(spec, JoinedSpec) else spec.curves
        curves = [self._inner((*path, key, i), each) for i, each in enumerate(inner)]
        whole = tuple(curve for curve in curves if curve is not None)
        if len(whole) < len(curves):
            return None
        if isinstance(spec, JoinedSpec):
            return self._try(path, lambda: Joined(whole), key)
        return self._try(path, lambda: Laps(whole, meet=spec.meet), key)

    def _try(self, path: KeyPath, make: Callable[[], Curve], key: str = "") -> Curve | None:
        """Make a curve, or note its mistake: at the entry of the list `key` at fault."""
        try:
            return make()
        except CurveError as error:
            at = (*path, key, error.piece) if key and error.piece is not None else path
            self.mistakes.append(Mistake(at, error.message, error.hint))
            return None


def _simple(spec: EllipseSpec | CircleSpec | LineSpec | SplineSpec) -> Curve:
    """Build a curve that contains no other.

    Raises:
        CurveError: the curve can't be.

    """
    if isinstance(spec, EllipseSpec):
        return Arc(spec.centre, spec.semi_axes, spec.rotation, *_angles(spec))
    if isinstance(spec, CircleSpec):
        return circle_arc(spec.centre, spec.radius, *_angles(spec))
    if isinstance(spec, LineSpec):
        return LineSegment(spec.from_, spec.to)
    points, closed = closing(np.reshape(np.array(spec.points, dtype=float), (-1, 2)), spec.closed)
    return Spline(points, closed=closed)


def _angles(spec: EllipseSpec | CircleSpec) -> tuple[float, float]:
    if spec.from_ is None or spec.to is None:
        return 0.0, 2 * pi
    return spec.from_, spec.to
