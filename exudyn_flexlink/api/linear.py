"""A mechanism's linear equations about one state, as a notebook asks for them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from exudyn_flexlink import engines, linear
from exudyn_flexlink.api import with_methods
from exudyn_flexlink.api.figures import Shown
from exudyn_flexlink.api.scenes import given_scene
from exudyn_flexlink.arguments import among, instance_of, number, takes, values
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.quantities import Dimension
from exudyn_flexlink.report import linear_text
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Scene

POINT = among(lambda model: model.assembly.mechanism.points, "point")
AXIS = among(lambda _: ("x", "y"), "axis")
RUN = instance_of(Result, "load_scene(..) gives a scene, simulate(..) a run")


def _hertz(value: Any, _: Any = None) -> FloatArray:
    """Take frequencies."""
    read = number(Dimension.FREQUENCY, above=0.0)
    return np.array([read(frequency, None) for frequency in values(value)])


@dataclass(frozen=True, repr=False)
class Response(Shown, linear.Response):
    """How a point answers a force that oscillates: `x`, `y` (F,) m/N over `frequency` (F,) Hz."""

    _figure, _text = "response", repr

    def __repr__(self) -> str:
        """Return one line: from where to where."""
        low, high = self.frequency[[0, -1]]
        return f"<Response of {self.at} to {self.force}: {low:.4g} Hz to {high:.4g} Hz>"


@dataclass(frozen=True, repr=False)
class LinearModel(Shown, linear.LinearModel):
    """``M z'' + C z' + K z = f`` about one state; SI units, n independent coordinates z.

    `coordinates` are their names, `units` rad or m: angles and lengths of joints, ``link hinge 2``
    of a flexible link, ``ball.x`` of what nothing holds; places along curves of points in slots.
    `mass`, `damping` and `stiffness` are (n, n); `damping_error` and `stiffness_error` tell how far
    entries may be off. `eigenvalues` (2 n,) are in 1/s, `modes` motions of one of them each, with
    `frequency` (Hz), `damping_ratio`, and complex amplitudes: `coordinates` (n,), `poses` (parts,
    3) and `points` by name. `motions` (parts, 3, n) are slopes of poses by z. Contacts `pressing`
    go on pressing. `time` (s) is that of the run, None about a rest.
    """

    _figure, _text = "modes", linear_text

    @takes(force=POINT, at=POINT, frequency=_hertz, along=AXIS)
    def response(
        self,
        force: str,
        at: str,
        frequency: FloatArray | None = None,
        along: str = "y",
    ) -> Response:
        """Return how the point `at` answers 1 N along x or y at the point `force`.

        Over the `frequency` (Hz), by default about all of the modes.
        """
        response = linear.LinearModel.response(self, force, at, frequency, along)
        return with_methods(Response, response)

    def __repr__(self) -> str:
        """Return one line: about what, and how many coordinates there are."""
        about = "its rest" if self.time is None else f"t = {self.time:.6g} s"
        return f"<Linear model of '{self.scene.title}' about {about}: {len(self.mass)} coordinates>"


def _scene_or_run(value: Any, _: Any = None) -> Any:
    """Take a scene, or a run."""
    return given_scene(value) if isinstance(value, Scene) else RUN(value, None)


@takes(of=_scene_or_run, at=number(Dimension.TIME, at_least=0.0))
def linearised(of: Scene | Result, at: float | None = None) -> LinearModel:
    """Linearise a scene about its rest, or a run about its sample next to `at` (s), or its end.

    Mass, damping and stiffness of the independent coordinates, with eigenvalues, modes, and answers
    to forces. Drives hold at a rest what they have at time 0, and prescribe in a run what they do;
    contacts that press then go on pressing. A rest is where ``equilibrium`` finds it.

    Raises:
        CannotContinueError: the run has no such instant.
        NotLinearError: friction holds a joint or a contact, or a contact by impulse presses.
        NotRepresentableError: a link is a beam of Exudyn.
        SceneError: nothing balances.
        ValueError: `at` is given, and there is no run.

    """
    if at is not None and isinstance(of, Scene):
        raise ValueError("'at' is an instant of a run; a scene is linearised about its rest")
    return with_methods(LinearModel, engines.linear_model(of, at))
