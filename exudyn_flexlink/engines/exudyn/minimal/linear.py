"""A tree's equations about one state, linearised: mass, damping and stiffness.

With ``M z'' = f`` for the independent coordinates z, the residual ``r = M a - f`` at the
accelerations a of the motion has the derivatives ``K = dr/dz`` and ``C = dr/dz'``. Central
differences of order 8 give them, for smooth forces to about ten digits. Several steps are tried,
each finer than the last. Each entry comes from the step that agrees best with the one before it.
(`scipy.differentiate` takes the last step, although its rounding may be the larger error.)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np

from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.engines.exudyn.minimal.contacts import ContactPush
from exudyn_flexlink.engines.exudyn.minimal.kinematics import motions
from exudyn_flexlink.engines.exudyn.minimal.model import TROUBLES, MinimalModel, TreeForces
from exudyn_flexlink.engines.touching import Change, Laws, Moment
from exudyn_flexlink.engines.track_follower import DeadCentreError
from exudyn_flexlink.linear import LinearModel, NotLinearError
from exudyn_flexlink.mechanism import Assembly, FaceContact
from exudyn_flexlink.mechanism.tree import ALONG_X, ALONG_Y, HINGE, tree_layout
from exudyn_flexlink.rounding import PLACE_ROUNDING, ROUNDING
from exudyn_flexlink.scene import Scene

LARGEST = 0.01  # of the mechanism's size: differences move no point further
LEAST_MOVED = 0.1  # of the largest motion by a unit of a coordinate: smaller ones count as this
OF_DEPTH = 0.2  # of a contact's depth: differences change the depth by less
# A central difference of order 8 (B. Fornberg, Math. Comput. 51 (1988) 699, table 1).
NODES = np.array([-4.0, -3.0, -2.0, -1.0, 1.0, 2.0, 3.0, 4.0])
WEIGHTS = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
FINER, MOST_STEPS = 0.25, 7  # each step is a quarter of the one before
LEAST_CHANGE = 2e-14  # of the changes of force in the first differences: less is rounding
AGREE = 1e-10  # of an entry: if two steps agree so well, no shorter one is tried
AT_ONCE = 4_000_000  # entries of mass matrices that are evaluated together
SLIDES = 5.0  # times the slip speed of a law: friction acts in full, to 1e-4; slower ones stick


def linear_model(
    scene: Scene, assembly: Assembly, touching: Mapping[int, float], time: float | None
) -> LinearModel:
    """Linearise about the state of an assembly, at time 0 of its drives.

    `touching` are the contacts that press, by their numbers among all contacts and pairs, with the
    speeds (m/s) at which they began.

    Raises:
        NotLinearError: a contact by impulse presses, friction holds, or nothing can move.

    """
    layout = tree_layout(assembly.mechanism)
    try:
        model = MinimalModel(assembly, layout, [])
        _let_press(model, touching)
        z = np.stack(model.coordinates.independent())
        if not z.size:
            raise NotLinearError("nothing can move: there are no independent coordinates")
        state = model.states(np.zeros(1), *z[:, None])
        if model.frictions.all:
            model.frictions.settle(model.without_reactions(np.zeros(1), state))
        tree = model.forces_at(np.zeros(1), state).pick(0)
        _refuse(model, tree.kept)
        residuals = partial(_residuals, model, z, tree.accelerations)
        slopes, errors = _slopes(residuals, _steps(model, tree.kept))
    except (DeadCentreError, *TROUBLES) as error:
        raise NotLinearError(f"no linear equations there: {error}") from error
    names, units, factors = zip(*_named(model), strict=True)
    scaled = np.outer(factors, factors)
    moving = tree.kept.state.transform.expanded(np.diag(factors))
    still = np.zeros_like(moving)
    moved = motions(layout, model.kinematics, still + tree.kept.state.x, moving, still)
    return LinearModel(
        scene,
        assembly,
        time,
        names,
        units,
        scaled * tree.mass,
        scaled * slopes[1],
        scaled * slopes[0],
        np.abs(scaled) * errors[1],
        np.abs(scaled) * errors[0],
        np.moveaxis(moved.rates, 0, -1),
        tuple(model.contacts.all[k].name for k in model.touches.pressing),
    )


def _let_press(model: MinimalModel, touching: Mapping[int, float]) -> None:
    """Let contacts press, also those of pins that a guide without clearance holds on its axis."""
    held = {k: 0.0 for k in _two_sided(model) if model.contacts.touch(k, *model.start).inside >= 0}
    for k, approach in (held | dict(touching)).items():
        model.touches.change(k, Change.CLOSES, Moment(0.0, 0.0, -approach))
        model.contacts.follow(k, model.start[0], presses=True)


def _two_sided(model: MinimalModel) -> list[int]:
    """Numbers of the contacts that hold a point on a line: their force goes through 0 smoothly."""
    faces = enumerate(model.contacts.all)
    return [k for k, face in faces if isinstance(face, FaceContact) and face.side == 0]


def _depths(model: MinimalModel, push: ContactPush) -> FloatArray:
    """Changes of depth (a,) up to which active contacts stay smooth; inf if there is no limit."""
    contacts = model.contacts
    walls = (
        np.arange(len(contacts.all)) >= contacts.count
    )  # linear ones are smooth through a gap of 0
    always = contacts.lets_go | (walls & (Laws([c.law for c in contacts.all]).exponents == 1))
    always[_two_sided(model)] = True
    return np.where(always[model.touches.pressing], np.inf, -push.look.gap)


def _refuse(model: MinimalModel, tree: TreeForces) -> None:
    """Refuse states without linear equations: those that friction, freewheels or impulses hold."""
    contacts = model.contacts.all
    for k in model.rigid.closed():
        why = "presses by impulse, which has no stiffness: give it a law that has one"
        raise NotLinearError(f"'{contacts[k].name}' {why}")
    driven = model.frictions.driven(tree.state)
    for k in model.frictions.held.tolist():
        name = model.frictions.all[k].name
        if model.frictions.one_way[k]:
            why = "is locked, and holds one way alone: take an instant at which it overruns"
            raise NotLinearError(f"freewheel '{name}' {why}")
        if not driven[k]:
            raise NotLinearError(f"dry friction of joint '{name}' holds it")
    if tree.push is None:
        return
    acting = [contacts[k] for k in model.touches.pressing]
    depths = _depths(model, tree.push).tolist()
    slips = tree.push.look.slip.tolist()
    for contact, depth, slip in zip(acting, depths, slips, strict=True):
        friction = contact.friction
        if friction is not None and abs(slip) < SLIDES * friction.slip_speed:
            raise NotLinearError(f"friction of '{contact.name}' holds it")
        if depth < PLACE_ROUNDING:
            why = "begins or ends to press then: take another instant"
            raise NotLinearError(f"'{contact.name}' {why}")


def _residuals(
    model: MinimalModel, z: FloatArray, accelerations: FloatArray, moved: FloatArray
) -> FloatArray:
    """Residuals (states, n) if coordinates and speeds z (2, n) are `moved` (states, 2, n)."""
    residuals = []
    parts = 1 + len(moved) * len(model.layout.links) ** 2 // AT_ONCE
    for part in np.array_split(z + moved, parts):
        time = np.zeros(len(part))
        evaluation = model.forces_at(time, model.states(time, part[:, 0], part[:, 1]))
        residuals.append(evaluation.mass @ accelerations - evaluation.force)
    return np.concatenate(residuals)


def _slopes(
    residuals: Callable[[FloatArray], FloatArray], steps: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Derivatives (2, n, n) of residuals by coordinates and speeds, and their errors.

    The first differences change coordinates and speeds by `steps` (n,). Entries that are no more
    than rounding of the forces become 0.
    """
    count = len(steps)
    ways = np.diag(np.tile(steps, 2))
    forces = np.abs(residuals(ways.reshape(-1, 2, count))).max(axis=0)
    forces = np.where(forces > 0, forces, 1.0)

    best = np.zeros((2 * count, count))
    error = np.full((2 * count, count), np.inf)
    larger = None
    for h in 0.25 * FINER ** np.arange(MOST_STEPS):
        moved = (h * NODES[:, None, None] * ways).reshape(-1, 2, count)
        slopes = (
            np.tensordot(WEIGHTS / h, residuals(moved).reshape(len(NODES), -1, count), 1) / forces
        )
        if larger is not None:
            apart = np.maximum(np.abs(slopes - larger), LEAST_CHANGE)
            better = apart < error
            best = np.where(better, slopes, best)
            error = np.where(better, apart, error)
            if (error <= np.maximum(AGREE * np.abs(best), ROUNDING)).all():
                break
        larger = slopes
    best = np.where(np.abs(best) > error, best, 0.0)
    slopes, errors = (
        np.swapaxes(column.reshape(2, count, count), 1, 2) * (forces[:, None] / steps)
        for column in (best, error)
    )
    return slopes, errors


def _steps(model: MinimalModel, tree: TreeForces) -> FloatArray:
    """Largest differences (n,) of the coordinates, limited by motions and by depths of contacts."""
    state = tree.state
    model.look(state.x, state.transform)
    moved = np.array([model.size(way) for way in np.eye(len(model.coordinates.numbers))])
    size = max(part.reach for part in model.assembly.mechanism.parts)
    steps = LARGEST * size / np.maximum(moved, LEAST_MOVED * moved.max())
    if tree.push is not None:
        across = np.abs(state.transform.reduced_rows(tree.push.rows.across))
        depths = _depths(model, tree.push)[:, None]
        deep = OF_DEPTH * depths / np.maximum(across, np.finfo(float).tiny)
        steps = np.minimum(steps, deep.min(axis=0))
    return np.asarray(steps)


def _named(model: MinimalModel) -> Iterator[tuple[str, str, float]]:
    """Name, unit, and change of the tree's coordinate per unit, of each independent coordinate."""
    layout, parts = model.layout, model.assembly.mechanism.parts
    joints = {link: (name, sign) for name, (link, sign) in layout.joints.items()}
    for number in model.coordinates.numbers.tolist():
        slot = number - len(layout.links)
        if slot >= 0:  # a place on a curve
            point = model.coordinates.points[slot]
            yield point.slot.name, "m", 1 / abs(complex(*point.at(point.u)[2:4]))
            continue
        kind = layout.links[number].kind
        unit = "rad" if kind == HINGE else "m"
        if number in joints:
            name, sign = joints[number]
            yield name, unit, sign
            continue
        # A body that no joint holds hangs on two slides and a hinge; the hinge carries it.
        after, axis = {ALONG_X: (2, "x"), ALONG_Y: (1, "y"), HINGE: (0, "angle")}[kind]
        body = parts[layout.links[number + after].parts[0]].body
        yield f"{body}.{axis}", unit, 1.0
