"""Gears, racks and belts in redundant coordinates: one constraint of Exudyn for each."""

from __future__ import annotations

import numpy as np

from exudyn_flexlink.engines import NotRepresentableError
from exudyn_flexlink.engines.exudyn.engine import items
from exudyn_flexlink.engines.exudyn.redundant.system import System
from exudyn_flexlink.mechanism import GROUND, Gear, constraints_at


def add_gear(system: System, gear: Gear) -> int:
    """Hold a sum of coordinates of up to three parts, as large as it is at the start.

    Exudyn's constraint has two ends: one is the ground, the other a body without mass that has the
    coordinates of all parts.

    Raises:
        NotRepresentableError: the sum is none that stays one, or a part is in a beam.

    """
    q, places = system.assembly.state.q, system.assembly.state.places
    rows = constraints_at(system.mechanism, q, places)
    first = rows.first_rows[rows.names.index(gear.name)]
    parts = sorted({part for part in rows.parts[first].tolist() if part != GROUND})
    carried = any(tie.slide and tie.near.part != GROUND for tie in gear.ties)
    if carried or system.in_beams & set(parts):
        what = "no gear of a beam" if system.in_beams & set(parts) else "no rack on a moving body"
        message = f"Exudyn's own solver has {what}: take 'formulation: minimal'"
        raise NotRepresentableError(("joints", gear.name), message)
    row = rows.jacobian(np.array([first])).reshape(-1, 3)[parts].reshape(1, -1)
    whole = items.ObjectGenericODE2(
        nodeNumbers=[system.nodes[part] for part in parts],
        massMatrix=np.zeros((row.size, row.size)),
    )
    ground = items.MarkerNodeCoordinates(nodeNumber=system.ground_node)
    body = items.MarkerObjectODE2Coordinates(objectNumber=system.mbs.AddObject(whole))
    item = items.ObjectConnectorCoordinateVector(
        markerNumbers=[system.mbs.AddMarker(ground), system.mbs.AddMarker(body)],
        scalingMarker0=[],
        scalingMarker1=row,
        offset=[float(row[0] @ q[parts].ravel())],
    )
    return int(system.mbs.AddObject(item))
