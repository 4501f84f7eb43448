"""A beam as Exudyn items: nodes with a slope, and cubic elements between them.

Exudyn has geometrically exact elements as well (``ObjectBeamGeometricallyExact2D``). They are
linear between their nodes, so that errors fall with the square of their number, those of the cubic
ones with the fourth power. Measured on a cantilever of the paper's link, its end pushed by 4.7 mm
in 10 ms and left to ring for 40 ms, in m and us per step:

========  =============  ====================
elements  cubic          geometrically exact
========  =============  ====================
1         4.8e-4   19    1.5e-3   14
2         4.8e-5   27    1.8e-3   19
4         3.4e-6   43    6.3e-4   27
8         2.2e-7   75    1.7e-4   44
16        1.7e-8   142   3.7e-5   77
========  =============  ====================

Nor can they do without reference coordinates, which the native slot constraints must not have.
"""

from __future__ import annotations

from typing import Any

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.engine import items
from exudyn_flexlink.engines.exudyn.redundant.beam import BeamLink

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
