"""What `check` says of drives."""

from __future__ import annotations

from exudyn_flexlink.expressions import Expression
from exudyn_flexlink.report.text import number, table
from exudyn_flexlink.scene import Drive, ForceDrive, RevoluteJoint, Scene, Table, Value

WIDEST = 40  # letters of an expression that are shown


def drive_lines(scene: Scene) -> list[str]:
    """A line for each drive: where it acts, and what it does; nothing without drives."""
    rows = []
    for name, drive in scene.drives.items():
        rows.append([name, drive.type, *_drive(scene, drive)])
    return ["Drives", *table(rows)] if rows else []


def _drive(scene: Scene, drive: Drive) -> tuple[str, str]:
    """Where a drive acts, and what it does."""
    if isinstance(drive, ForceDrive):
        axes = f" in the axes of {drive.axes}" if drive.axes in scene.bodies else ""
        x, y = (_value(value, "N") for value in drive.value)
        return f"at {drive.point}", f"x: {x}, y: {y}{axes}"
    turns = isinstance(scene.joints[drive.joint], RevoluteJoint)
    units = {"speed": ("m/s", "rad/s"), "motion": ("m", "rad"), "torque": ("", "N m")}
    unit = units[drive.type][turns]
    ramp = getattr(drive, "ramp", 0.0)
    within = f", reached within {number(ramp)} s" if ramp else ""
    return f"at {drive.joint}", f"{_value(drive.value, unit)}{within}"


def _value(value: Value, unit: str) -> str:
    if isinstance(value, Expression):
        text = str(value) if len(str(value)) <= WIDEST else str(value)[: WIDEST - 3] + "..."
        return f"{text} ({unit})"
    if isinstance(value, Table):
        return f"table of {len(value.points or ())} rows, {value.rule} ({unit})"
    return f"{number(value)} {unit}"
