"""The hand-written equations against differentiation of positions alone (paper, eq. 1).

Kinetic energy, mass matrix and quadratic terms follow here from the positions of the bodies' ends,
written anew, and from complex steps and central differences of the track's own points; nothing of
the engine's equations is used for them. P depends on the guide's angle, or with play between link
and guide on its own place on the track, which is a coordinate.
"""

import numpy as np
import pytest
from cli_runs import MODELS
from scipy.optimize import brentq

from exudyn_flexlink.engines.lagrangian.model import frame_of, mass_and_force
from exudyn_flexlink.engines.lagrangian.run import prepare
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.mechanism import approach

CASES = {
    "ellipse": ("no_clearance.yaml", "bodies.link.rods=4"),
    "circle": ("no_clearance.yaml", "joints.pin.curve=ring", "bodies.link.layout=half_ends"),
    "spline": ("spline_track.yaml", "bodies.link.rods=3", "bodies.link.slender=false"),
    "rigid link": ("rigid.yaml",),
}
PLAY = {
    "play": ("clearance.yaml", "bodies.link.rods=4"),
    "play, half ends": ("clearance.yaml", "joints.pin.curve=egg", "bodies.link.layout=half_ends"),
}
EXTRA = "curves.ring={type: circle, centre: [0, 0], radius: 0.03}"
STEP = 1e-3  # rad, of central differences of order 6


def prepared(case, *settings):
    name, *own = (CASES | PLAY)[case]
    extra = [EXTRA] if "joints.pin.curve=ring" in own else []
    return prepare(load_scene(MODELS / name, [*extra, *own, *settings]))


def track_point(run, theta):
    """P at a guide angle, by a search of its own on the smooth piece the run is on."""
    piece = run.system.track.curve.pieces[run.system.track.piece]
    centre = np.array(run.model.layout.guide.at)

    def aside(u):
        x, y = piece.point(u) - centre
        return np.cos(theta) * y - np.sin(theta) * x

    near = run.system.track.u
    u = brentq(aside, near - 0.02, near + 0.02, xtol=1e-16, rtol=1e-15)
    return piece.point(u)


def crossing_at(run, theta):
    """The engine's own P at a guide angle, from where it was last: gamma, gamma', gamma''."""
    track, centre = run.system.track, complex(*run.model.layout.guide.at)
    u, places = track.crossed(centre, np.exp(1j * np.array([theta])))
    track.u = float(u[0])
    return [np.array([place[0].real, place[0].imag]) for place in places]


def frame_at(run, q, v):
    """The engine's own frame at all coordinates and speeds."""
    track, layout = run.system.track, run.model.layout
    if layout.play:
        places = track.at(q[None, layout.track_coordinate])
    else:
        places = track.crossed(complex(*layout.guide.at), np.exp(1j * q[None, 0]))[1]
    return frame_of(run.model.numbers, q[None], v[None], places)


def derivatives(run, value):
    """P and its first two derivatives by its coordinate, by central differences of order 6."""
    track = run.system.track
    if run.model.layout.play:
        at = [track.curve.pieces[track.piece].point(value + k * STEP) for k in range(-3, 4)]
    else:
        crossing_at(run, value)
        at = [track_point(run, value + k * STEP) for k in range(-3, 4)]
    one = np.array([-1, 9, -45, 0, 45, -9, 1]) / 60
    two = np.array([2, -27, 270, -490, 270, -27, 2]) / 180
    return at[3], np.tensordot(one, at, 1) / STEP, np.tensordot(two, at, 1) / STEP**2


def lumps(run, q, point):
    """Centres of mass of all bodies (complex), their masses and inertias, from positions alone.

    Near that point P moves as its Taylor polynomial.
    """
    mechanism, layout = run.model.mechanism, run.model.layout
    turned = q[layout.track_coordinate] - run.at
    p, p1, p2 = point
    at = p + p1 * turned + p2 * turned**2 / 2
    found = []
    # Without play rod 1 has the guide's angle; the order of the coordinates is the engine's.
    first = 1 if layout.play else 0
    for i, part in enumerate(layout.rods, start=first):
        rod = mechanism.parts[part]
        along = np.array([np.cos(q[i]), np.sin(q[i])])
        found.append((at + rod.centre[0] * along, q[i], rod))
        at = at + 2 * rod.centre[0] * along
    levers = enumerate(layout.levers, start=first + len(layout.rods))
    for i, pivot in [(0, layout.guide), *levers]:
        body = mechanism.parts[pivot.part]
        x, y = body.centre[0] - pivot.pin[0], body.centre[1] - pivot.pin[1]
        c, s = np.cos(q[i]), np.sin(q[i])
        found.append((np.array(pivot.at) + np.array([c * x - s * y, s * x + c * y]), q[i], body))
    return found


def jacobians(run, q, point):
    """Rows of velocities of centres and angles by the speeds, weighted, by complex steps."""
    columns = []
    for j in range(len(q)):
        step = np.zeros(len(q), dtype=complex)
        step[j] = 1e-30j
        column = []
        for centre, angle, body in lumps(run, q + step, point):
            column += [*(np.sqrt(body.mass) * centre.imag), np.sqrt(body.inertia) * angle.imag]
        columns.append(np.array(column) / 1e-30)
    return np.array(columns).T


def random_state(run, seed):
    random = np.random.default_rng(seed)
    q = run.model.start[0] + random.uniform(-0.3, 0.3, len(run.model.start[0]))
    run.at = q[run.model.layout.track_coordinate] = random.uniform(0.2, 0.25)
    v = random.uniform(-20, 20, len(q))
    return q, v, derivatives(run, run.at)


@pytest.mark.parametrize("case", CASES)
def test_place_of_p_and_its_derivatives(case):
    run = prepared(case)
    for theta in np.linspace(0.1, 0.4, 7):
        p, p1, p2 = derivatives(run, theta)
        place, first, second = crossing_at(run, theta)
        assert place == pytest.approx(p, abs=1e-15)
        assert first == pytest.approx(p1, rel=1e-8, abs=1e-11)
        assert second == pytest.approx(p2, rel=1e-8, abs=2e-9)


@pytest.mark.parametrize("case", [*CASES, *PLAY])
def test_mass_matrix_and_quadratic_terms(case):
    """Those are h = J^T d(J)/dt v, the bias accelerations projected on the speeds."""
    run = prepared(case)
    q, v, point = random_state(run, 1)
    rows = jacobians(run, q, point)
    engine = mass_and_force(run.model.numbers, frame_at(run, q, v))[0][0]
    assert engine == pytest.approx(rows.T @ rows, rel=1e-8, abs=1e-8 * engine.max())
    assert engine == pytest.approx(engine.T, abs=1e-15 * engine.max())
    assert 0.5 * v @ engine @ v == pytest.approx(0.5 * np.sum((rows @ v) ** 2), rel=1e-8)
    h = 3e-3 / np.abs(v).max()
    rates = [jacobians(run, q + k * h * v, point) @ v for k in (-3, -2, -1, 1, 2, 3)]
    bias = np.array([-1, 9, -45, 45, -9, 1]) / 60 @ np.array(rates) / h
    terms = rows.T @ bias
    # Springs, dampers and weight alone are left where nothing moves.
    by = run.model.numbers
    still, moving = (mass_and_force(by, frame_at(run, q, own))[1][0] for own in (0 * v, v))
    found = still - moving - v @ by.damping
    summands = np.abs(rows).T @ np.abs(bias)  # they cancel; differences are as exact as these are
    assert (abs(found - terms) < 1e-8 * summands).all()


def test_p_on_the_next_piece_is_another():
    """Beyond the top of the egg the ellipse goes on at another place than the circle."""
    run = prepared("ellipse", "joints.pin.curve=egg")
    track = run.system.track
    for theta in np.linspace(0, 2.2, 50):
        there = crossing_at(run, theta)[0]
    assert (there[0] / 0.04) ** 2 + (there[1] / 0.03) ** 2 == pytest.approx(1, rel=1e-12)
    track.next_piece(1, 0.0)
    assert track.u == track.curve.pieces[track.piece].start
    circle = crossing_at(run, theta)[0]
    assert np.hypot(*circle) == pytest.approx(0.03, rel=1e-12)
    assert circle != pytest.approx(there, abs=1e-6)


@pytest.mark.parametrize("case", ["ellipse", *PLAY])
def test_contacts_are_those_of_the_mechanism_and_gradients_those_of_differences(case):
    """Gaps and places of levers' faces and of walls by `mechanism.approach`; then by the engine."""
    run = prepared(case)
    q, v, _ = random_state(run, 5)
    contacts, every = run.system.contacts, np.arange(len(run.model.contacts))
    frame = frame_at(run, q, v)
    seen, pushed = contacts.look(frame), contacts.push(frame, every, np.zeros(len(every)))
    poses, rates = run.model.poses(frame)
    for k, contact in enumerate(run.model.contacts):
        at = approach(contact, poses[0], rates[0], 0.0)
        own = [float(column[0, k]) for column in seen]
        there = [float(part) for part in at[:4]]
        assert own == pytest.approx(there, rel=1e-12, abs=1e-13)
        if at.gap < 0:
            press = float(contact.law.force(-at.gap, -at.gap_rate, 0.0))
            assert max(pushed.press[0, k], 0.0) == pytest.approx(press, rel=1e-9, abs=1e-9)
    one, six = np.array([-1, 9, -45, 45, -9, 1]) / 60, (-3, -2, -1, 1, 2, 3)
    for column, rows in ((0, pushed.rows[0]), (1, pushed.slides[0])):
        at = [
            [contacts.look(frame_at(run, q + k * 1e-4 * row, v))[column][0] for k in six]
            for row in np.eye(len(q))
        ]
        numeric = np.einsum("k,jkc->cj", one, np.array(at)) / 1e-4
        assert rows == pytest.approx(numeric, rel=1e-8, abs=1e-11)
        assert rows @ v == pytest.approx(seen[column + 2][0], rel=1e-12, abs=1e-13)
    h = 1e-5
    rates = [contacts.look(frame_at(run, q + k * h * v, v)).gap_rate[0, 0] for k in six]
    assert contacts.bend(frame, every[:1])[0, 0] == pytest.approx(one @ rates / h, rel=1e-7)
