"""The runs of a work-precision study, the most useful first, within a budget of time.

The order is: the model's own settings, by its own method and by the judge; the tight reference; the
scene with more rods and with stiffer contacts; ever finer settings, from coarse ones on. The method
whose last run was the cheapest makes the next of these. A run that takes more than half of the time
left is stopped, and its method gets no finer setting.

A method is an engine, its formulation, and the setting that is varied. Besides time steps, errors
come from the number of rods and from contacts that give way. The scene is made finer in one of
these. The extrapolated shift of the judged points is the error of the scene.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import takewhile
from math import ceil, inf, isclose, isfinite, log10
from time import monotonic
from typing import Any, Literal

from exudyn_flexlink.mechanism import build_mechanism, end_of_run
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import DampedLaw, FlexibleBody, HertzLaw, ImpulseLaw, Joint, Run, Scene
from exudyn_flexlink.shipped import ENGINES, EXUDYN, LAGRANGIAN

MORE_RODS = 2
STIFFER = 4.0  # times the stiffness of a linear contact: it lasts half as long
MOST_RODS = 1000  # of a model
COMPLIANCE_ORDER = 0.5
"""A contact's effect on the motion goes as k^-1/2, like its duration."""

ORDERS = {"equal": 1, "half_ends": 2}
"""A rigid rod at the root shortens the beam by half a rod; hinges in the middle of cells don't."""


@dataclass(frozen=True)
class Finer:
    """A scene `ratio` times finer in one source of error, which falls with the power `order`."""

    kind: str
    scene: Scene
    ratio: float
    order: float


def finer_scenes(scene: Scene) -> list[Finer]:
    """Return the scene with more rods, and the scene with stiffer contacts, if it has any."""
    rods, stiffer = with_more_rods(scene), with_stiffer_contacts(scene)
    scenes = []
    if rods is not None:
        order = min(ORDERS[body.layout] for body in beams(scene).values())  # the slowest counts
        scenes.append(Finer("rods", rods, MORE_RODS, order))
    if stiffer is not None:
        scenes.append(Finer("contact", stiffer, STIFFER, COMPLIANCE_ORDER))
    return scenes


def extrapolated(ratio: float, order: float) -> float:
    """Error of a coarse result, over its distance from a result that is `ratio` times finer."""
    return 1 / (1 - float(ratio**-order))


def beams(scene: Scene) -> dict[str, FlexibleBody]:
    """Flexible bodies that converge to a beam with more rods: those with hinges 'beam'."""
    return {name: body for name, body in flexible(scene).items() if body.hinges.stiffness == "beam"}


def flexible(scene: Scene) -> dict[str, FlexibleBody]:
    """Flexible bodies that have hinges, by name."""
    return {
        name: body
        for name, body in scene.bodies.items()
        if isinstance(body, FlexibleBody) and (body.rods > 1 or body.hinges.stiffness == "beam")
    }


def with_more_rods(scene: Scene) -> Scene | None:
    """Return the scene with twice the rods in every 'beam'; None if there is none, or no room.

    The damping of a hinge is doubled like its stiffness, so that the beam has the same damping.
    """
    links = beams(scene)
    if not links or any(MORE_RODS * body.rods > MOST_RODS for body in links.values()):
        return None
    return scene.changed(bodies=dict(scene.bodies) | {n: _finer(b) for n, b in links.items()})


def _finer(body: FlexibleBody) -> FlexibleBody:
    hinges = body.hinges.model_copy(update={"damping": MORE_RODS * body.hinges.damping})
    return body.model_copy(update={"rods": MORE_RODS * body.rods, "hinges": hinges})


def stiffnesses(scene: Scene) -> dict[str, float]:
    """Stiffness of all contacts that give way, with joints and their stops, by name.

    Units are N/m, N/m^n, or N m/rad. A stiffness from materials is left out: it is physical, and
    does not stand for a rigid contact.
    """
    giving = {n: law for n, law in scene.laws.items() if not isinstance(law, ImpulseLaw)}
    return {n: law.stiffness for n, law in giving.items() if law.stiffness is not None}


def with_stiffer_contacts(scene: Scene) -> Scene | None:
    """Return the scene with contacts, walls and stops four times as stiff; None without any."""
    if not stiffnesses(scene):
        return None
    contacts = {name: _stiffer(part) for name, part in scene.contacts.items()}
    joints = {name: _stiffer_joint(joint) for name, joint in scene.joints.items()}
    return scene.changed(contacts=contacts, joints=joints)


def _stiffer_joint(joint: Joint) -> Joint:
    """Return a joint with stiffer walls, if these can press, and stiffer stops."""
    if getattr(joint, "acting", None) or getattr(joint, "backlash", 0.0) > 0:
        joint = _stiffer(joint)
    limits = getattr(joint, "limits", None)
    return joint.model_copy(update={"limits": _stiffer(limits)}) if limits else joint


def _stiffer(part: Any) -> Any:
    """Return a contact, joint or stop with a stiffer law, if its law has a stiffness."""
    law = part.law
    if isinstance(law, ImpulseLaw) or law.stiffness is None:
        return part
    # A contact's duration goes as K^(-1/(n + 1)): it falls by one ratio for every exponent n.
    exponent = law.exponent or 1.5 if isinstance(law, DampedLaw | HertzLaw) else 1.0
    update = {"stiffness": STIFFER ** ((exponent + 1) / 2) * law.stiffness}
    if getattr(law, "damping", None):  # so that a stop returns as much energy as before
        update["damping"] = STIFFER**0.5 * law.damping
    return part.model_copy(update={"law": law.model_copy(update=update)})


Knob = Literal["tolerance", "step"]

BEAM = "beam"  # the only formulation without rods
LEAST_TOLERANCE = 1e-9  # m: finer rungs only if the target needs them
COARSEST = 1e-3  # m: ladders begin near it, so that every method has cheap rungs
USUAL_TOLERANCE = 1e-4  # m: for a model that gives a step in place of a tolerance
RUNGS_OF_STEPS = 6
REFERENCE = 1e-12
"""Tolerance (m) of the reference run, at least 100 times finer than the finest rung. At 1e-12 m the
smooth method has an error of 2e-13 m over the paper's two turns."""

_METHOD_KEYS = ("formulation", "elements")  # of the solver


@dataclass(frozen=True)
class Method:
    """A way to solve a scene, up to one number: a tolerance (m) or a step (s).

    `settings` are the keys of the scene's solver that select this method.
    """

    name: str
    engine: str
    knob: Knob = "tolerance"
    settings: Mapping[str, Any] = field(default_factory=dict, hash=False)

    @property
    def of_rods(self) -> bool:
        """Whether links consist of rods, as in the scene; a beam converges to another motion."""
        return self.settings.get("formulation") != BEAM

    def at(self, scene: Scene, value: float) -> Scene:
        """Return the scene with this method's settings and a value of its knob."""
        given = scene.solver.model_dump(exclude_unset=True)
        solver = {key: item for key, item in given.items() if key not in _METHOD_KEYS}
        if not self.of_rods and "elements" in given:
            solver["elements"] = given["elements"]
        return scene.changed(
            accuracy=type(scene.accuracy).model_validate({self.knob: value}),
            solver=type(scene.solver).model_validate({**solver, **self.settings}),
        )

    def amount(self, value: float) -> str:
        """Say a value of the knob with its unit, such as '1e-05 m'."""
        return f"{value:.2g}{' s' if self.knob == 'step' else ' m'}"

    def set_to(self, value: float) -> str:
        """Say the knob at a value, such as 'tolerance 1e-05 m'."""
        return f"{self.knob} {self.amount(value)}"

    def label(self, value: float) -> str:
        """Say the method at a value, such as 'Exudyn, redundant, tolerance 1e-05 m'."""
        return f"{self.name.removesuffix(', fixed step')}, {self.set_to(value)}"


def methods_of(scene: Scene, formulations: Mapping[str, Sequence[str]]) -> list[Method]:
    """List the methods to try; the method of the model's own settings is first.

    `formulations` names, for each engine, the formulations that represent the scene, beginning with
    the engine's own choice; empty for an engine without a choice.
    """
    methods: list[Method] = []
    for engine, names in formulations.items():
        title = ENGINES[engine].title
        ways = ({"formulation": name} for name in names)
        methods += [Method(f"{title}, {w['formulation']}", engine, settings=w) for w in ways]
        methods += [] if names else [Method(title, engine)]
    if EXUDYN in formulations:  # equal steps, as in a script by hand
        settings = {"formulation": "redundant"} if "redundant" in formulations[EXUDYN] else {}
        methods.append(Method("Exudyn, fixed step", EXUDYN, "step", settings))
    first = model_method(scene, methods)
    return sorted(methods, key=lambda method: method is not first)


def model_method(scene: Scene, methods: Sequence[Method]) -> Method:
    """Return the method of the model's settings: Exudyn, as `simulate` uses it."""
    knob = "tolerance" if scene.accuracy.step is None else "step"
    asked = scene.solver.formulation
    fitting = [m for m in methods if m.engine == EXUDYN and m.knob == knob]
    named = [m for m in fitting if m.settings.get("formulation") == asked]
    return (named or fitting or list(methods))[0]


def model_value(scene: Scene, method: Method) -> float | None:
    """Value of the method's knob in the model, or a usual value; None if unknown."""
    if method.knob == "step":
        return scene.accuracy.step
    return model_tolerance(scene)


def model_tolerance(scene: Scene) -> float:
    """Tolerance of the model, or a usual one, m."""
    return scene.accuracy.tolerance or USUAL_TOLERANCE


def ladder(knob: Knob, value: float, target: float) -> list[float]:
    """Values of a knob, the finest last: `value` times powers of 10; for steps, of sqrt(10).

    `target` (m) is the error that the user wants; the tolerances cover values above and below it.
    """
    if knob == "step":
        return [value * 10 ** (-k / 2) for k in range(-1, RUNGS_OF_STEPS)]
    top = max(1, ceil(log10(target / value) - 1e-9), round(log10(COARSEST / value)))
    least = min(LEAST_TOLERANCE, target / 10)
    count = top + max(0, int(log10(value / least) + 1e-9))
    return [value * 10.0 ** (top - k) for k in range(count + 1)]


class RefusedError(Exception):
    """A method can't represent the scene; the message says why."""


@dataclass(frozen=True)
class Solved:
    """A run, and the processor time of its solution, s; `given_up` if it exceeded its time."""

    result: Result
    processor: float
    given_up: bool = False


Solve = Callable[[Scene, str, str, float], Solved]
"""Runs a scene in an engine; arguments: scene, engine, a label, and the allowed time (s).

Raises RefusedError, and KeyboardInterrupt when the user stops the study.
"""


@dataclass
class Trial:
    """A method at one value of its knob: the first result, and processor times (s) of all runs."""

    method: Method
    value: float
    result: Result
    times: list[float]

    @property
    def label(self) -> str:
        """The trial in words."""
        return self.method.label(self.value)

    @property
    def processor(self) -> float:
        """The least processor time, s."""
        return min(self.times)


@dataclass(frozen=True)
class Varied:
    """A run of the scene made finer in one source of error, and a run of the scene itself."""

    finer: Finer
    result: Result
    base: Trial
    processor: float


@dataclass
class Runs:
    """All that was run: `trials` of methods, `varied` in sources of error.

    `left_out` has the reason of each run that did not finish: refused, failed, or too long.
    """

    scene: Scene
    target: float
    methods: list[Method]
    trials: list[Trial] = field(default_factory=list)
    reference: Trial | None = None
    varied: list[Varied] = field(default_factory=list)
    left_out: dict[str, str] = field(default_factory=dict)
    interrupted: bool = False
    spent: float = 0.0

    def of(self, method: Method) -> list[Trial]:
        """Trials of a method, finest first."""
        return sorted((t for t in self.trials if t.method == method), key=lambda t: t.value)

    def has(self, method: Method, value: float) -> bool:
        """Whether a method was run at a value, but for rounding."""
        return any(isclose(value, trial.value) for trial in self.of(method))

    @property
    def model_trial(self) -> Trial | None:
        """The trial at the model's own settings; None if it could not be made."""
        method = model_method(self.scene, self.methods)
        value = model_value(self.scene, method)
        return next((t for t in self.of(method) if t.value == value), None)


JUDGE = LAGRANGIAN  # the engine whose tight run judges all others
SHARE = 0.5  # of the time left: the most that a run may take
NO_TIME = "no time"
REPEATS = 3
AT_ONCE = 1.0  # s: a run is repeated if all repetitions together take less
WARM_UP = 0.01  # of a run
COARSER = (1.0, 10.0, 100.0)  # times the model's own setting, tried if that takes too long
SECOND_ORDER = 3.0  # fixed steps for each step under error control: a similar first error
LEFT_FOR_FILES = 4.0  # s of the budget, for figure and tables


class StudyRunner:
    """Makes the runs of a study; `run` returns them, also if the user stops the study."""

    def __init__(
        self, runs: Runs, solve: Solve, budget: float, clock: Callable[[], float] = monotonic
    ) -> None:
        self.runs = runs
        self._solve = solve
        self._clock = clock
        self._budget = budget - min(LEFT_FOR_FILES, budget / 10)
        self._deadline = inf

    @property
    def _allowed(self) -> float:
        """Time that a run may take, s."""
        return SHARE * max(self._deadline - self._clock(), 0.0)

    def run(self) -> Runs:
        """Make all runs that the time allows."""
        began = self._clock()
        try:
            self._warm_up()
            self._deadline = self._clock() + self._budget
            self._model_settings()
            self._refer()
            self._vary()
            self._climb()
        except KeyboardInterrupt:
            self.runs.interrupted = True
        self.runs.spent = self._clock() - began
        return self.runs

    def _methods(self) -> list[Method]:
        """Methods that did not refuse the scene so far, the model's own first."""
        return [m for m in self.runs.methods if m.name not in self.runs.left_out]

    def _warm_up(self) -> None:
        """Run the beginning of the motion by every method, to find at once which ones refuse it.

        This also imports the engines, before the budget begins.
        """
        scene = self.runs.scene
        end = end_of_run(scene, build_mechanism(scene))
        part = WARM_UP * end if isfinite(end) else WARM_UP
        short = scene.changed(run=Run(duration=part, sample=part))
        for method in self.runs.methods:
            begun = method.at(short, model_value(scene, method) or part / 10)
            try:
                self._solve(begun, method.engine, f"{method.name}, warming up", inf)
            except RefusedError as error:
                self.runs.left_out[method.name] = str(error)

    def _model_settings(self) -> None:
        """Run the model's own settings, or coarser ones if these take too long, also by the judge.

        Other methods are tried only if no run exists yet.
        """
        usual = model_method(self.runs.scene, self.runs.methods)
        for method in self._methods():
            value = model_value(self.runs.scene, method)
            if value is None or (method != usual and method.engine != JUDGE and self.runs.trials):
                continue
            for factor in COARSER:
                if self._try(method, factor * value) or self.runs.trials:
                    break

    def _try(self, method: Method, value: float) -> Trial | None:
        """Run a method at a value; None if it failed, or there was no time."""
        label, scene = method.label(value), method.at(self.runs.scene, value)
        solved = self._solved(scene, method, label)
        if solved is None:
            return None
        trial = Trial(method, value, solved.result, [solved.processor])
        self.runs.trials.append(trial)
        if REPEATS * solved.processor < AT_ONCE:  # the least of several times is the best estimate
            for _ in range(REPEATS - 1):
                again = self._solve(scene, method.engine, f"{label}, again", self._allowed)
                trial.times += [] if again.given_up else [again.processor]
        return trial

    def _solved(self, scene: Scene, method: Method, label: str) -> Solved | None:
        """Run a scene; None if it was refused, failed, or takes too long."""
        try:
            solved = self._solve(scene, method.engine, label, self._allowed)
        except RefusedError as error:
            self.runs.left_out[label] = str(error)
            return None
        outcome = solved.result.outcome
        if solved.given_up or not outcome.completed:
            self.runs.left_out[label] = NO_TIME if solved.given_up else outcome.ending
            return None
        return solved

    def _refer(self) -> None:
        """Run the tight reference, if an independent engine can."""
        for method in self._methods():
            if method.engine == JUDGE:
                scene = method.at(self.runs.scene, REFERENCE)
                solved = self._solved(scene, method, f"{method.label(REFERENCE)}, reference")
                if solved is not None:
                    times = [solved.processor]
                    self.runs.reference = Trial(method, REFERENCE, solved.result, times)

    def _vary(self) -> None:
        """Run the scene with more rods and with stiffer contacts, by the cheapest method.

        Each is compared with the finest run of that method, which is one rung finer than the
        model's own setting if there is time for it.
        """
        known = [t for t in self.runs.trials if t.method.of_rods and t.method.knob == "tolerance"]
        scenes = finer_scenes(self.runs.scene)
        if not known or not scenes:
            return
        method = min(known, key=lambda t: t.processor).method
        value = model_tolerance(self.runs.scene)
        if self.runs.has(method, value):
            self._try(method, value / 10)
        base = self.runs.of(method)[0]
        for finer in scenes:
            label = f"{method.name}, varying: {finer.kind}"
            solved = self._solved(method.at(finer.scene, base.value), method, label)
            if solved is not None:
                self.runs.varied.append(Varied(finer, solved.result, base, solved.processor))

    def _climb(self) -> None:
        """Run ever finer settings; the method whose last run was the cheapest is always next."""
        waiting = {method: self._rungs(method) for method in self._methods()}
        last = dict.fromkeys(waiting, 0.0)
        while ready := [method for method, rungs in waiting.items() if rungs]:
            method = min(ready, key=lambda m: last[m])
            value = waiting[method].pop(0)
            trial = self._try(method, value)
            if trial is not None:
                last[method] = trial.processor
            elif (out := self.runs.left_out)[method.label(value)] == NO_TIME:
                finer = waiting.pop(method)
                out |= {f"{method.label(x)}, and what is finer": NO_TIME for x in finer[:1]}

    def _rungs(self, method: Method) -> list[float]:
        """Rungs of a method's ladder that were not run yet, up to the first that took too long."""
        value = self._begin(method)
        rungs = [] if value is None else ladder(method.knob, value, self.runs.target)
        out = self.runs.left_out
        short = takewhile(lambda rung: out.get(method.label(rung)) != NO_TIME, rungs)
        return [rung for rung in short if not self.runs.has(method, rung)]

    def _begin(self, method: Method) -> float | None:
        """Value of the knob in the model, or a step (s) from the mean step of a run; else None."""
        model_trial, value = self.runs.model_trial, model_value(self.runs.scene, method)
        if value is not None or model_trial is None or model_trial.result.checks.steps < 1:
            return value
        mean = model_trial.result.time[-1] / model_trial.result.checks.steps
        return float(f"{mean / SECOND_ORDER:.1g}")


def study(scene: Scene, methods: Sequence[Method], target: float, solve: Solve,
          budget: float) -> Runs:  # fmt: skip
    """Make all runs that a budget (s) allows; `target` (m) is the error that the user wants."""
    return StudyRunner(Runs(scene, target, list(methods)), solve, budget).run()
