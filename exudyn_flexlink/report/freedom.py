"""What `check` says of a mechanism's freedoms: who drives them, and what is left to forces."""

from __future__ import annotations

from exudyn_flexlink.mechanism import Assembly, moved_by_forces
from exudyn_flexlink.report.text import listed, table
from exudyn_flexlink.scene import FlexibleBody, Scene


def freedom_lines(scene: Scene, assembly: Assembly) -> list[str]:
    """Return the degrees of freedom, what decides each, and joints that hold twice."""
    drives = [motor.name for motor in assembly.mechanism.speed_motors]
    left = assembly.degrees_of_freedom
    rows = []
    if drives:
        rows.append(["prescribed", f"{len(drives)}, by {listed(drives)}"])
    if left:
        rows.append(["left to forces", f"{left}: {_moved(scene, assembly)}"])
    if assembly.surplus:
        rows.append(["held twice", _held_twice(assembly)])
    count = left + len(drives)
    fixed = "" if count else ", nothing can move"
    return [f"Degrees of freedom: {count}{fixed}", *table(rows)]


def _moved(scene: Scene, assembly: Assembly) -> str:
    """What forces move, and what they bend."""
    moved = moved_by_forces(assembly)
    bodies = scene.bodies.items()
    bent = [name for name, body in bodies if isinstance(body, FlexibleBody) and body.rods > 1]
    told = [f"they move {listed(moved)}"] if moved else []
    told += [f"they bend {listed(bent)}"] if bent else []
    return "; ".join(told)


def _held_twice(assembly: Assembly) -> str:
    """Joints whose share others hold already, in minimal coordinates, which leave it out."""
    names = listed(list(assembly.surplus))
    return f"what {names} would hold, other joints hold already, in every position"
