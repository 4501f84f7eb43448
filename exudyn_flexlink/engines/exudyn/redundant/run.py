"""Run a scene as rigid bodies with joints: index-3 generalised-alpha, the steps of `stepping`."""

from __future__ import annotations

from collections.abc import Callable
from math import ceil
from typing import Any

import numpy as np

from exudyn_flexlink.engines import NotRepresentableError
from exudyn_flexlink.engines.extremes import HERMITE, ExtremeSeeker
from exudyn_flexlink.engines.exudyn.engine import Engine
from exudyn_flexlink.engines.exudyn.redundant.beam import beams_of
from exudyn_flexlink.engines.exudyn.redundant.contacts import ContactItem, Contacts
from exudyn_flexlink.engines.exudyn.redundant.events import Kinks
from exudyn_flexlink.engines.exudyn.redundant.loads import add_loads, sense
from exudyn_flexlink.engines.exudyn.redundant.outcome import Prepared
from exudyn_flexlink.engines.exudyn.redundant.pressing import add_joint_friction
from exudyn_flexlink.engines.exudyn.redundant.recording import Recorder
from exudyn_flexlink.engines.exudyn.redundant.slots import SlotItems
from exudyn_flexlink.engines.exudyn.redundant.stepping import ErrorControl, Loop
from exudyn_flexlink.engines.exudyn.redundant.system import System, build_system
from exudyn_flexlink.engines.interrupts import interrupts
from exudyn_flexlink.engines.seeding import seeded
from exudyn_flexlink.expressions import NoValueError
from exudyn_flexlink.integrate.solve import ProgressMeter
from exudyn_flexlink.mechanism import (
    Assembly,
    CurveContact,
    FlatContact,
    TurnStop,
    beyond_redundant,
    end_of_run,
    pairs,
    resolutions,
    sample_times,
    turn_goal,
)
from exudyn_flexlink.observables import Watched
from exudyn_flexlink.result import Event
from exudyn_flexlink.scene import Scene


def prepare(
    scene: Scene,
    assembly: Assembly,
    progress: Callable[[float], None] | None,
    limits: float = 1.0,
    *,
    seed: bool = False,
) -> Prepared:
    """Build the system, the loop and what records it.

    Raises:
        NotRepresentableError: as of `built`.

    """
    end = end_of_run(scene, assembly.mechanism)
    events: list[Event] = []
    system, slots, contacts = built(scene, assembly, events, limits)
    system.mbs.Assemble()
    watched = Watched(scene, assembly.mechanism, assembly.state.q)
    pressing = [own.contact for own in contacts.all]
    recorder = Recorder(
        system,
        sample_times(scene, assembly.mechanism, end),
        scene.solver.spectral_radius,
        ExtremeSeeker(watched, pressing, HERMITE),
        contacts.touches,
    )
    chooser = ErrorControl(scene.accuracy, end, system.coordinates.weights, limits)
    goal = turn_goal(scene, assembly)
    knots, window = assembly.mechanism.knots(end), system.window
    meter = ProgressMeter(progress, end)
    kinks = Kinks(assembly.mechanism, window)
    loop = Loop(chooser, slots, contacts, kinks, events, recorder, end, goal, knots, window, meter)
    return Prepared(scene, assembly, system, loop, seed)


def built(
    scene: Scene, assembly: Assembly, events: list[Event], limits: float = 1.0
) -> tuple[System, list[SlotItems], Contacts]:
    """Create all items of a scene, not yet assembled; slots will tell `events` of new laps.

    Raises:
        NotRepresentableError: the scene asks for a beam that can't be, or for contacts that
            Exudyn's own solver does not know.

    """
    for mistake in beyond_redundant(scene):
        raise NotRepresentableError(tuple(map(str, mistake.path)), mistake.message)
    as_beam = scene.solver.formulation == "beam"
    beams = beams_of(scene, assembly.mechanism) if as_beam else ()
    system = build_system(assembly, beams)
    for friction in system.mechanism.frictions:
        add_joint_friction(system, friction)
    add_loads(system)
    count = len(assembly.mechanism.slots)
    slots = [SlotItems(system, i, events, limits) for i in range(count)]
    return system, slots, _contacts(scene, system)


def _contacts(scene: Scene, system: System) -> Contacts:
    """Those of the scene and its bearings, then pairs of its channels: the order of all arrays."""
    mechanism = system.mechanism
    found = resolutions(scene, system.assembly, system.coordinates.half_period)
    count = len(mechanism.touching)
    contacts = []
    for i, (contact, resolution) in enumerate(zip(mechanism.touching, found, strict=False)):
        # `prepare` refuses them
        assert not isinstance(contact, (CurveContact, FlatContact, TurnStop))
        contacts.append(ContactItem(system, contact, i, resolution))
    for channel, resolution in zip(mechanism.channels, found[count:], strict=True):
        for pair in pairs(channel):
            contacts.append(ContactItem(system, pair, len(contacts), resolution, channel))
    return Contacts(contacts)


def solve(prepared: Prepared) -> str:
    """Run the solver; return its complaint, empty if there is none."""
    system, loop = prepared.system, prepared.loop
    q, v, a = system.coordinates.start()
    data = system.mbs.systemData
    if prepared.seed:
        q, v = seeded(system.assembly, (q, v), system.coordinates.weights)
        data.SetODE2Coordinates(q, Engine.ConfigurationType.Initial)
        data.SetODE2Coordinates_t(v, Engine.ConfigurationType.Initial)
    # Exudyn's own initial accelerations miss what depends on time explicitly and are wrong for
    # quadratic constraints: these come from the mechanism's equations.
    data.SetODE2Coordinates_tt(a, Engine.ConfigurationType.Initial)
    multipliers = np.zeros(len(data.GetAECoordinates()))
    first = loop.start(q, v, multipliers)
    system.mbs.SetPostStepUserFunction(loop.after_step)
    settings = _settings(prepared, first)
    complaint = ""
    try:
        with interrupts(loop.interrupt):
            system.mbs.SolveDynamic(settings, showHints=False)
    except Exception as error:
        complaint = str(system.mbs.sys["dynamicSolver"].GetErrorString() or error)
    if isinstance(loop.error, NoValueError):  # of a drive, as it goes on past a knot
        system.errors.append(loop.error)
        complaint = str(loop.error)
    elif loop.error is not None:
        raise loop.error
    if system.errors and complaint:
        complaint = str(system.errors[-1])
    if loop.time < loop.end * (1 - 1e-9):
        loop.recorder.keep_last()  # stopped early
    loop.recorder.flush()
    return complaint


def _settings(prepared: Prepared, first: float) -> Any:
    settings = Engine.SimulationSettings()
    time = settings.timeIntegration
    time.endTime = prepared.loop.end
    # The solver returns to steps of endTime/numberOfSteps after a failed one: no more than ours.
    largest = prepared.loop.chooser.largest
    time.numberOfSteps = max(1, ceil(prepared.loop.end / largest))
    time.initialStepSize = first
    time.minimumStepSize = min(1e-10, first / 10)
    # Left alone, the solver doubles a step that is shorter than its own every few steps.
    time.adaptiveStepRecoverySteps = 10**9
    time.generalizedAlpha.spectralRadius = prepared.scene.solver.spectral_radius
    time.generalizedAlpha.computeInitialAccelerations = False
    time.newton.useModifiedNewton = True
    time.newton.modifiedNewtonJacUpdatePerStep = True
    time.computeLoadsJacobian = int(sense(prepared.system))
    time.newton.relativeTolerance, time.newton.absoluteTolerance = prepared.system.newton
    time.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.active = False
    settings.linearSolver.solverType = Engine.LinearSolverType.EigenSparse
    settings.linearSolver.reuseAnalyzedPattern = True
    return settings
