"""Run a scene in Exudyn: index-3 generalised-alpha with the steps of `stepping`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from math import ceil, inf
from time import perf_counter
from typing import Any

import numpy as np

from exudyn_flexlink.engines import NotRepresentableError
from exudyn_flexlink.engines.exudyn.channels import ChannelItems
from exudyn_flexlink.engines.exudyn.contact_log import ContactLog
from exudyn_flexlink.engines.exudyn.contacts import ContactItem, Pace
from exudyn_flexlink.engines.exudyn.engine import Engine
from exudyn_flexlink.engines.exudyn.outcome import finish
from exudyn_flexlink.engines.exudyn.recording import Multipliers, Recorder
from exudyn_flexlink.engines.exudyn.slots import SlotItems
from exudyn_flexlink.engines.exudyn.stepping import (
    ErrorControl,
    FixedStep,
    Loop,
    StepChooser,
)
from exudyn_flexlink.engines.exudyn.system import System, build_system
from exudyn_flexlink.engines.exudyn.tree import run as tree_run
from exudyn_flexlink.engines.interrupts import interrupts
from exudyn_flexlink.loading import assemble_scene
from exudyn_flexlink.mechanism import (
    Assembly,
    FaceContact,
    Mechanism,
    contact_step,
    end_of_run,
    formulation,
    half_period,
    is_tree,
    pairs,
    sample_times,
    turn_goal,
    wall_half_period,
)
from exudyn_flexlink.result import Event, Result
from exudyn_flexlink.scene import ImpulseLaw, Scene


@dataclass
class Prepared:
    """Everything a solve needs, and what is left of it afterwards."""

    scene: Scene
    assembly: Assembly
    system: System
    slots: list[SlotItems]
    recorder: Recorder
    loop: Loop
    contact_step: float
    fixed: bool


def run(scene: Scene, progress: Callable[[float], None] | None = None) -> Result:
    """Simulate a scene; a run that fails is a Result with ``outcome.completed`` False.

    Raises:
        NotRepresentableError: a contact's law is an impulse, or the scene asks for a formulation
            that can't represent it.
        SceneError: the scene can't be put together.

    """
    began = perf_counter()
    _refuse_impulses(scene)
    assembly = assemble_scene(scene)
    if formulation(scene, assembly.mechanism) == "tree":
        tree = tree_run.prepare(scene, assembly, progress)
        ready = perf_counter()
        complaint = tree_run.solve(tree)
        solved = perf_counter()
        result = tree_run.finish(tree, complaint)
    else:
        prepared = _prepare(scene, assembly, progress)
        ready = perf_counter()
        error, iterations = _solve(prepared)
        solved = perf_counter()
        if prepared.loop.time < prepared.loop.end * (1 - 1e-9):
            prepared.recorder.mark(prepared.loop.time)  # stopped early: its last state is kept
        prepared.recorder.flush()
        result = finish(prepared, error, iterations)
    timings = {
        "prepare": ready - began,
        "solve": solved - ready,
        "process": perf_counter() - solved,
    }
    return replace(result, timings=timings)


def formulations(scene: Scene) -> tuple[str, ...]:
    """Formulations that can represent a scene, the one that `auto` means first.

    Raises:
        SceneError: the scene can't be put together.

    """
    assembly = assemble_scene(scene)
    joints = ("joints",)
    if not is_tree(assembly.mechanism):
        return joints
    return ("tree", *joints) if scene.accuracy.step is None else (*joints, "tree")


def _refuse_impulses(scene: Scene) -> None:
    for name, contact in scene.contacts.items():
        if isinstance(contact.law, ImpulseLaw):
            raise NotRepresentableError(
                ("contacts", name, "law"),
                "the Exudyn engine needs a penalty law; speeds that jump are for the engine "
                "'lagrangian'",
            )


def _prepare(
    scene: Scene, assembly: Assembly, progress: Callable[[float], None] | None
) -> Prepared:
    end = end_of_run(scene, assembly.mechanism)
    system = build_system(assembly)
    shortest = contact_step(scene, assembly)
    fixed = scene.accuracy.step is not None
    events: list[Event] = []
    count = len(assembly.mechanism.slots)
    slots = [SlotItems(system, i, events) for i in range(count)]
    all_contacts = _all_contacts(assembly.mechanism)
    log = ContactLog(np.zeros(len(all_contacts), dtype=bool))
    contacts, channels = _contact_items(scene, system, log)
    system.mbs.Assemble()
    motor_rows = [system.multipliers(item)[0] for item in system.motors.values()]
    recorder = Recorder(
        assembly.mechanism,
        all_contacts,
        sample_times(scene, end),
        Multipliers(len(system.mbs.systemData.GetAECoordinates()), motor_rows),
        scene.accuracy.spectral_radius,
    )
    chooser, goal = _chooser(scene, assembly, end), turn_goal(scene, assembly)
    loop = Loop(chooser, slots, contacts, channels, log, events, recorder, end, goal, progress)
    return Prepared(scene, assembly, system, slots, recorder, loop, shortest, fixed)


def _all_contacts(mechanism: Mechanism) -> list[FaceContact]:
    """Those of the scene, then the pairs of its channels: the order of all arrays of contacts."""
    channels = mechanism.channels
    return [*mechanism.contacts, *(pair for channel in channels for pair in pairs(channel))]


def _contact_items(
    scene: Scene, system: System, log: ContactLog
) -> tuple[list[ContactItem], list[ChannelItems]]:
    assembly, accuracy = system.assembly, scene.accuracy

    def pace(half: float) -> Pace:
        return Pace(half, inf if accuracy.step is not None else half / accuracy.steps_per_contact)

    contacts = [
        ContactItem(system, contact, i, pace(half_period(assembly, contact)), log)
        for i, contact in enumerate(assembly.mechanism.contacts)
    ]
    channels: list[ChannelItems] = []
    first = len(contacts)
    for channel in assembly.mechanism.channels:
        half = wall_half_period(assembly, channel)
        channels.append(ChannelItems(system, channel, first, pace(half), log))
        first += len(channels[-1].contacts)
    return contacts, channels


def _chooser(scene: Scene, assembly: Assembly, end: float) -> StepChooser:
    if scene.accuracy.step is not None:
        return FixedStep(scene.accuracy.step)
    weights = np.array([(1.0, 1.0, part.reach) for part in assembly.mechanism.parts]).ravel()
    return ErrorControl(scene.accuracy.tolerance or 0.0, end, weights)


def _solve(prepared: Prepared) -> tuple[str, int]:
    """Run the solver; return its complaint (empty if there is none) and its Newton iterations."""
    system, loop, state = prepared.system, prepared.loop, prepared.assembly.state
    data = system.mbs.systemData
    # Exudyn's own initial accelerations miss what depends on time explicitly and are wrong for
    # quadratic constraints: these come from the mechanism's equations.
    data.SetODE2Coordinates_tt(state.a.ravel(), Engine.ConfigurationType.Initial)
    multipliers = np.zeros(len(data.GetAECoordinates()))
    first = loop.start(state.q.ravel(), state.v.ravel(), multipliers)
    system.mbs.SetPostStepUserFunction(loop.after_step)
    settings = _settings(prepared, first)
    complaint = ""
    try:
        with interrupts(loop.interrupt):
            system.mbs.SolveDynamic(settings, showHints=False)
    except Exception as error:
        complaint = str(system.mbs.sys["dynamicSolver"].GetErrorString() or error)
    if loop.error is not None:
        raise loop.error
    return complaint, int(system.mbs.sys["dynamicSolver"].it.newtonStepsCount)


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
    time.generalizedAlpha.spectralRadius = prepared.scene.accuracy.spectral_radius
    time.generalizedAlpha.computeInitialAccelerations = False
    time.newton.useModifiedNewton = True
    time.newton.modifiedNewtonJacUpdatePerStep = True
    time.newton.relativeTolerance = 1e-8
    time.newton.absoluteTolerance = 1e-10
    time.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.active = False
    settings.linearSolver.solverType = Engine.LinearSolverType.EigenSparse
    settings.linearSolver.reuseAnalyzedPattern = True
    return settings
