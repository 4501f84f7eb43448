"""Run a scene by the hand-written equations of motion.

A scene's `accuracy.tolerance` is the error that the whole run may make in positions, m: an implicit
method of order 9 keeps it (see `advance`). Where local tolerances are given, or with rigid
contacts, an explicit method runs, whose tolerances are those of one step (see `events`). Over the
paper's two laps their defaults leave about 1e-9 m in the motion without contact, and through a
strike less than the references themselves know (1e-7 m).
"""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

import numpy as np

from exudyn_flexlink.engines.coasting import coasting, keeping
from exudyn_flexlink.engines.extremes import ExtremeSeeker
from exudyn_flexlink.engines.interrupts import interrupts
from exudyn_flexlink.engines.lagrangian.advance import Control, advance
from exudyn_flexlink.engines.lagrangian.compiled import Compilation, compilation
from exudyn_flexlink.engines.lagrangian.events import EVENT_TIME, Loop, StuckError
from exudyn_flexlink.engines.lagrangian.marching import March
from exudyn_flexlink.engines.lagrangian.outcome import Prepared, finish
from exudyn_flexlink.engines.lagrangian.recording import Recorder
from exudyn_flexlink.engines.lagrangian.rig import Rig, build_rig
from exudyn_flexlink.engines.lagrangian.system import System
from exudyn_flexlink.engines.lagrangian.track import DeadCentreError
from exudyn_flexlink.engines.walls import resolving
from exudyn_flexlink.integrate.collocation import radau
from exudyn_flexlink.laws import Impulse
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import Mechanism, end_of_run, sample_times, turn_goal
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene

STAGES = 5  # order 9
# Measured over the shipped scenes without clearance, tolerances from 1e-3 to 1e-8 m: over two turns
# the error of S and of the tip is 0.02 to 0.8 of the tolerance, where that limits the steps.
SHARE = 0.2  # of the tolerance: error that one step may make
# The same with walls, where a touch multiplies errors.
WALLED_SHARE = 0.02
LONGEST_TURN = 0.4  # rad of the guide in one step: Newton's method for P stays local
EXPLICIT_NODES = np.array([0.0, 0.5, 1.0])  # at which an explicit step is looked at for extremes
RELATIVE = 1e-10
ABSOLUTE = 1e-12  # rad, rad/s, J, N s


def run(scene: Scene, progress: Callable[[float], None] | None = None) -> Result:
    """Simulate a scene; a run that fails is a Result with ``outcome.completed`` False.

    Raises:
        NotRepresentableError: the scene is not one guide, its link, and levers.
        SceneError: the scene can't be put together.

    """
    began = perf_counter()
    prepared = prepare(scene, progress)
    ready = perf_counter()
    complaint = solve(prepared)
    return finish(prepared, complaint, (began, ready, perf_counter()))


def prepare(scene: Scene, progress: Callable[[float], None] | None = None) -> Prepared:
    """Build the equations, the event loop and what records it."""
    assembly = assemble_scene(scene)
    rig = build_rig(scene, assembly)
    end = end_of_run(scene, assembly.mechanism)
    system = System(rig, turn_goal(scene, assembly))
    accuracy, mechanism = scene.accuracy, assembly.mechanism
    by_explicit, method = explicit(scene, mechanism), radau(STAGES)
    nodes = EXPLICIT_NODES if by_explicit else np.array([0.0, *method.nodes])
    seeker = ExtremeSeeker(scene, mechanism, mechanism.contacts, nodes)
    recorder = Recorder(system, sample_times(scene, mechanism, end), seeker, progress)
    recorder.explicit = by_explicit
    loop: Loop | March
    if by_explicit:
        loop = Loop(
            system,
            recorder,
            accuracy.relative_tolerance or RELATIVE,
            accuracy.absolute_tolerance or ABSOLUTE,
        )
    else:
        assert accuracy.tolerance is not None
        loop = March(system, recorder, method, control(rig, accuracy.tolerance, end))
    return Prepared(scene, rig, system, recorder, loop, end)


def explicit(scene: Scene, mechanism: Mechanism) -> bool:
    """Tell whether SciPy's explicit method is to solve a scene."""
    return scene.accuracy.tolerance is None or asks_for_local(scene) or not_smooth(mechanism)


def compiles(scene: Scene) -> Compilation:
    """Tell whether a run will begin by compiling the implicit method, which takes a minute.

    If so, whether the code is then kept for later runs.

    Raises:
        SceneError: the scene can't be put together.

    """
    implicit = not explicit(scene, assemble_scene(scene).mechanism)
    return compilation(advance) if implicit else "none"


def asks_for_local(scene: Scene) -> bool:
    """Tell whether the scene states a local tolerance."""
    accuracy = scene.accuracy
    return bool(accuracy.relative_tolerance or accuracy.absolute_tolerance)


def takes_tolerance(scene: Scene) -> bool:
    """Tell whether `accuracy.tolerance` decides the steps, where no local tolerance is stated.

    Raises:
        SceneError: the scene can't be put together.

    """
    return not not_smooth(assemble_scene(scene).mechanism)


def not_smooth(mechanism: Mechanism) -> bool:
    """Tell whether speeds jump, where the implicit method is no use.

    Bounces that get lower and lower need errors small against the bounce, not against a length.
    """
    return any(isinstance(contact.law, Impulse) for contact in mechanism.contacts)


def control(rig: Rig, tolerance: float, end: float) -> Control:
    """Error of one step so that the whole run, to `end` (s), keeps the tolerance (m)."""
    reaches = np.zeros(rig.layout.count)
    for pivot in (rig.layout.guide, *rig.layout.levers):
        part = rig.mechanism.parts[pivot.part]
        reaches[rig.layout.coordinate(pivot.part)] = part.reach
    tau = coasting(rig.mechanism, end)
    # An error a of the acceleration moves a driven mechanism by a tau^2, as it swings; one that
    # goes on as it was pushed by a end^2.
    lasts = end if rig.layout.motor is None else tau
    channels = rig.mechanism.channels
    share = resolving(tolerance, channels) * (WALLED_SHARE if channels else SHARE)
    lasting = max(tau, keeping(rig.mechanism, end))
    return Control(share, tau, lasting, np.inf, LONGEST_TURN, reaches, share / lasts**2)


def solve(prepared: Prepared) -> str:
    """Integrate to the end; return what went wrong, empty if nothing."""
    system, loop, recorder = prepared.system, prepared.loop, prepared.recorder
    complaint = ""
    stops = [t for t in _bends(prepared.rig.mechanism) if 0 < t < prepared.end]
    with interrupts(system.interrupt):
        try:
            system.begin()
            loop.state = loop.run(system.start, [*stops, prepared.end])
        except DeadCentreError as error:
            complaint = str(error)
        except StuckError as error:
            complaint = system.trouble or f"no step is short enough ({error}{_last(system, loop)})"
    recorder.keep_last(loop.time, loop.state)
    recorder.flush()
    return complaint


def _last(system: System, loop: Loop | March) -> str:
    """Name what happened last, where that was at the instant at which the run stands still."""
    event = system.events[-1] if system.events else None
    if event is None or loop.time - event.time > EVENT_TIME:
        return ""
    return f"; the last was '{event.kind}' of '{event.name}'"


def _bends(mechanism: Mechanism) -> list[float]:
    """Instants at which drives reach their values: derivatives jump there."""
    motors = (*mechanism.speed_motors, *mechanism.torque_motors)
    return sorted({motor.ramp.duration for motor in motors})
