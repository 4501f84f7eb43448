"""A beam as Exudyn items: nodes with a slope, and cubic elements between them."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from exudyn_flexlink.engines.exudyn.beam import BeamLink
from exudyn_flexlink.engines.exudyn.engine import items

FloatArray = NDArray[np.float64]

# Strain at three points of Lobatto, curvature at two of Gauss: see `beam_shape`.
REDUCED_INTEGRATION = 2


def add_beam(
    mbs: Any, beam: BeamLink, positions: FloatArray, velocities: FloatArray
) -> tuple[list[int], list[int]]:
    """Add nodes and elements; their numbers. `positions` and `velocities` are (controls, 2)."""
    shape, elastic = beam.shape, beam.shape.elastic
    nodes = [
        int(
            mbs.AddNode(
                items.NodePoint2DSlope1(
                    referenceCoordinates=[0.0] * 4,
                    initialCoordinates=at.tolist(),
                    initialVelocities=moved.tolist(),
                )
            )
        )
        for at, moved in zip(positions.reshape(-1, 4), velocities.reshape(-1, 4), strict=True)
    ]
    elements = [
        int(
            mbs.AddObject(
                items.ObjectANCFCable2D(
                    nodeNumbers=[nodes[i], nodes[i + 1]],
                    length=shape.element,
                    massPerLength=elastic.mass,
                    axialStiffness=elastic.axial,
                    bendingStiffness=elastic.bending,
                    axialDamping=elastic.lag * elastic.axial,
                    bendingDamping=elastic.lag * elastic.bending,
                    useReducedOrderIntegration=REDUCED_INTEGRATION,
                )
            )
        )
        for i in range(shape.elements)
    ]
    return nodes, elements


def add_beam_weight(mbs: Any, elements: list[int], gravity: tuple[float, float]) -> None:
    """Let every element weigh."""
    for element in elements:
        marker = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=element))
        mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=[*gravity, 0.0]))
