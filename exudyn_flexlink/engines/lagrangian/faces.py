"""Points against faces of levers: gaps, places, their rates and gradients."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.lagrangian.compiled import compiled
from exudyn_flexlink.engines.lagrangian.constants import Constants
from exudyn_flexlink.engines.lagrangian.track_point import TrackPoint

LAW = 7  # of a row of `Constants.faces`: where the numbers of `penalty` begin


@compiled
def touches(
    q: FloatArray, v: FloatArray, point: TrackPoint, c: Constants
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Contacts as rows of gap, place, their rates, b = g'' - G q''; gradients (c, N) of gap, place.

    With d from the lever's pivot to the point, t along the face and ``n = side t^`` normal to it:
    ``g = n.d - offset``, ``g' = n.d' - side psi' t.d``, and
    ``g'' = n.d'' - 2 side psi' t.d' - side psi'' t.d - side psi'^2 t^.d``.
    """
    faces, rods, arms = c.faces, c.rods, c.arms
    n, count, p = len(rods), len(faces), int(c.track_coordinate)
    states, gradients = np.zeros((count, 5)), np.zeros((count, len(q)))
    slides = np.zeros((count, len(q)))
    for k in range(count):
        lever = int(faces[k, 0])
        side, psi_rate = faces[k, 4], v[lever]
        angle = q[lever] + faces[k, 3]
        tx, ty = np.cos(angle), np.sin(angle)
        nx, ny = -side * ty, side * tx
        dx, dy = point[0] - faces[k, 1], point[1] - faces[k, 2]
        ux, uy = point[2] * v[p], point[3] * v[p]
        bx, by = point[4] * v[p] * v[p], point[5] * v[p] * v[p]
        for i in range(n):
            j = int(rods[i])
            x, y = arms[k, i] * np.cos(q[j]), arms[k, i] * np.sin(q[j])
            dx, dy = dx + x, dy + y
            ux, uy = ux - y * v[j], uy + x * v[j]
            bx, by = bx - x * v[j] * v[j], by - y * v[j] * v[j]
            gradients[k, j] = ny * x - nx * y
            slides[k, j] = ty * x - tx * y
        along, across = tx * dx + ty * dy, nx * dx + ny * dy
        slide = tx * ux + ty * uy
        gradients[k, p] += nx * point[2] + ny * point[3]
        slides[k, p] += tx * point[2] + ty * point[3]
        gradients[k, lever] = -side * along
        slides[k, lever] = side * across
        states[k, 0] = across - faces[k, 5]
        states[k, 1] = along - faces[k, 6]
        states[k, 2] = nx * ux + ny * uy - side * psi_rate * along
        states[k, 3] = slide + side * psi_rate * across
        states[k, 4] = nx * bx + ny * by - 2 * side * psi_rate * slide - psi_rate**2 * across
    return states, gradients, slides
