"""Plane curves for slot joints: arcs, lines, splines, joined pieces, other curves each lap."""

from exudyn_flexlink.curves.base import Curve, CurveError, Knots
from exudyn_flexlink.curves.closest import Closest
from exudyn_flexlink.curves.joined import Joined, Laps, lap_number, pieces_of_laps
from exudyn_flexlink.curves.pieces import Arc, CircleArc, EllipseArc, LineSegment
from exudyn_flexlink.curves.rays import intersect_ray, ray_crossings
from exudyn_flexlink.curves.scalar import Evaluator, evaluator, foot
from exudyn_flexlink.curves.spline import Spline, SplinePiece
