"""How a scene starts, how long it runs, how it is solved, to what error, and what is shown."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal

from pydantic import BeforeValidator, Field, Strict, model_validator

from exudyn_flexlink import quantities as si
from exudyn_flexlink.expressions import Expression
from exudyn_flexlink.scene.base import (
    REVOLUTE,
    SLIDING,
    XY,
    Condition,
    Flag,
    MovingPointName,
    Name,
    Named,
    Part,
    Point,
    Refers,
    Value,
    by_name,
    listed,
    refuse,
)

Velocity = Annotated[tuple[si.Speed, si.Speed], XY]
PartState = Annotated[
    tuple[si.Coordinate, si.Coordinate, si.Angle, si.Speed, si.Speed, si.AngularSpeed],
    listed("x", "y", "angle", "vx", "vy", "angular speed"),
]
PressedPair = Annotated[tuple[Annotated[int, Strict()], si.Speed], listed("pair", "approach speed")]
OfBodies = Annotated[Named[Value], Refers("bodies")]
INITIAL_OF_JOINTS = ("along", "speeds_along", "laps")
"""Keys of `initial` that map names of joints; the others map names of bodies."""
FEWEST_STEPS_PER_CONTACT = 3  # least number that a scene may give: fewer do not resolve a contact


class Initial(Part):
    """The state at time 0, where the joints leave it open."""

    at_rest: Flag = Field(
        False,
        description="true: starts where all forces balance, nothing moves and drives hold what "
        "they have at time 0; found downhill from where the other keys put the bodies",
    )
    positions: OfBodies[Point] = by_name(
        "[x, y] of bodies, metres: of a rod's start, of a rigid body's own origin; "
        "held while assembling"
    )
    angles: OfBodies[si.Angle] = by_name("of bodies from +x; held while assembling")
    guesses: OfBodies[si.Angle] = by_name("angles from which the assembly is searched")
    along: Annotated[Named[si.Coordinate], replace(SLIDING, play=True)] = by_name(
        "how far second points of prismatic joints are along their lines from the "
        "first, or starts of links along their sleeves; held while assembling"
    )
    speeds_along: Annotated[
        Named[si.Speed], replace(SLIDING, kinds=(*SLIDING.kinds, "slot"), play=True)
    ] = by_name(
        "how fast second points of prismatic joints move along their lines, away from "
        "the first, starts of links along their sleeves, or points of slots along their curves, "
        "seen from what carries these"
    )
    speeds: OfBodies[si.AngularSpeed] = by_name("angular speeds of bodies")
    velocities: OfBodies[Velocity] = by_name(
        "[x, y] of bodies: of a rod's start, of a rigid body's own origin"
    )
    states: OfBodies[tuple[PartState, ...]] = by_name(
        "state from which a run goes on, for every body: [x, y, angle, and the rates of these] of "
        "its part, or of each of its rods; in place of all keys above"
    )
    laps: Annotated[Named[Annotated[int, Strict()]], Refers("joints")] = by_name(
        "for slots on curves with laps: the lap in which the point is; left out: 1; "
        "laps backwards from the start of lap 1 are -1, -2, .."
    )
    pressing: Named[tuple[PressedPair, ...]] = by_name(
        "pairs that press as a run goes on from another one, by contact, stop or joint with walls: "
        "the number of each pair, and the speed at which it touched"
    )
    clock: si.NonNegativeDuration = Field(
        0.0, description="time t of drives as the run begins: more than 0 in a run that goes on"
    )

    @model_validator(mode="after")
    def _is_consistent(self) -> Initial:
        """Refuse states beside other keys, speeds beside `at_rest`, an angle held and guessed."""
        speeds = ("speeds", "velocities", "speeds_along")
        for key in ("positions", "angles", "guesses", "along", *speeds):
            if self.states and getattr(self, key):
                refuse("follow from 'states', which give everything", at=key)
        if self.laps and not self.states:
            refuse("belong to 'states'", "without these slots start in lap 1", at="laps")
        if self.pressing and not self.states:
            refuse("belongs to 'states'", "only what goes on from a run presses", at="pressing")
        for key in (*speeds, "states"):
            if self.at_rest and getattr(self, key):
                refuse("nothing moves where 'at_rest' starts", "leave out one of both", at=key)
        for body in self.guesses:
            if body in self.angles:
                refuse(f"the angle of '{body}' is already given in 'angles'", at=("guesses", body))
        return self


def _as_keys(value: Any) -> Any:
    """Replace the text 'at_rest' by a mapping with that key alone."""
    if value == "at_rest":
        return {"at_rest": True}
    if not isinstance(value, Initial | Mapping):
        hint = "'initial: at_rest' starts where all forces balance"
        refuse(f"expected a mapping or 'at_rest', got {si.in_words(value)}", hint)
    return value


InitialOrRest = Annotated[
    Initial, BeforeValidator(_as_keys, json_schema_input_type=Literal["at_rest"] | Initial)
]


class Run(Part):
    """How long to simulate: a duration, or turns of a joint, or until a formula comes to 0."""

    one_of = (("duration", "turns"),)
    belonging: ClassVar = {"turns": ("of", "at_most")}
    duration: si.PositiveDuration | None = Field(None, description="simulated time; or 'turns'")
    turns: Annotated[float, si.Number(above=0.0)] | None = Field(
        None, description="net turns of the joint 'of', either way; or 'duration'"
    )
    of: Annotated[Name, REVOLUTE] | None = Field(
        None, description="name of the revolute joint whose turns count"
    )
    at_most: si.PositiveDuration | None = Field(
        None, description="end of a run whose turns are never reached"
    )
    until: Annotated[Expression, Condition()] | None = Field(
        None,
        description="formula of time and state, of any unit; as it rises through 0 the run ends, "
        "if not before. Below 0 at the start. Beside angle, speed and place: force(joint), "
        "torque(joint)",
    )
    sample: si.PositiveDuration | None = Field(
        None, description="time between stored results; left out: chosen by the program"
    )

    @model_validator(mode="after")
    def _turns_of_a_joint(self) -> Run:
        if self.turns is not None and self.of is None:
            refuse("missing 'of'", "the revolute joint whose turns count")
        return self


class Accuracy(Part):
    """The error allowed, or the step that decides it."""

    one_of = (("tolerance", "step"),)
    tolerance: si.PositiveLength | None = Field(
        None, description="error that the run may make in positions; or 'step'"
    )
    step: si.PositiveDuration | None = Field(None, description="time step; or 'tolerance'")


class Solver(Part):
    """How an engine solves the scene: nothing here belongs to the mechanism."""

    formulation: Literal["auto", "minimal", "redundant", "beam"] = Field(
        "auto",
        description="how Exudyn represents the mechanism: minimal: as many coordinates as it "
        "has freedoms; redundant: rigid bodies held by joints; beam: redundant, with the link as "
        "a beam; auto: minimal where it fits and a tolerance is given, else redundant",
    )
    integrator: Literal["radau", "dop853"] = Field(
        "radau",
        description="method of the Lagrangian: radau: implicit, of order 13, or 9 with contacts at "
        "tolerances above 2 um; dop853: explicit, of order 8, which impulses always take",
    )
    steps_per_contact: Annotated[int, Strict()] = Field(
        60,
        ge=FEWEST_STEPS_PER_CONTACT,
        description="steps in half a period of the shortest strike; half as many in a touch of a "
        "wall; for formulations redundant and beam",
    )
    spectral_radius: Annotated[float, si.Number(at_least=0.0, at_most=1.0)] = Field(
        0.9,
        description="numerical damping: 1 none, 0 most; for formulations redundant and beam",
    )
    elements: Annotated[int, Strict()] | None = Field(
        None,
        ge=1,
        le=200,
        description="beam elements of each flexible body; for formulation beam; left out: 2",
    )

    @model_validator(mode="after")
    def _elements_of_a_beam(self) -> Solver:
        if self.elements is not None and self.formulation != "beam":
            refuse("only a beam has elements", "say formulation: beam, or leave it out", "elements")
        return self


class Outputs(Part):
    """What figures show, and of which points errors are told."""

    watch: MovingPointName | None = Field(
        None,
        description="the point 'body.point' that figures and tables show, and the only one by "
        "which errors are judged; left out: the point that strikes, else the end of a body, and "
        "errors are judged by all named points",
    )
