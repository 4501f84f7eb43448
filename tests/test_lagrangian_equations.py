"""The hand-written equations against differentiation of positions alone (paper, eq. 1).

Kinetic energy, mass matrix and quadratic terms follow here from the positions of the bodies' ends,
written anew, and from complex steps and central differences of the track's own points; nothing of
the engine's equations is used for them. P depends on the guide's angle, or with play between link
and guide on its own place on the track, which is a coordinate.
"""

from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from exudyn_flexlink.engines.lagrangian import equations, faces
from exudyn_flexlink.engines.lagrangian.compiled import PREFIX, compiled, fingerprint
from exudyn_flexlink.engines.lagrangian.dense import eliminate
from exudyn_flexlink.engines.lagrangian.mass import mass_matrix
from exudyn_flexlink.engines.lagrangian.mode import state_rate
from exudyn_flexlink.engines.lagrangian.run import prepare
from exudyn_flexlink.engines.lagrangian.track_point import cross, place_on
from exudyn_flexlink.loading import load_scene

MODELS = Path(__file__).parent.parent / "models"
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
crossing = compiled(cross)
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


def engine_point(run, q):
    """The engine's own gamma, gamma', gamma'' at coordinates."""
    track, layout = run.system.track, run.model.layout
    if layout.play:
        return place_on(track.numbers, q[layout.track_coordinate])
    return crossing_at(run, q[0])


def crossing_at(run, theta):
    """The engine's own P at a guide angle, from where it was last."""
    track = run.system.track
    u, point, ended = crossing(track.numbers, run.model.layout.guide.at, theta, track.home)
    track.found(u, ended)
    return point


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
        point = crossing_at(run, theta)
        assert point[:2] == pytest.approx(p, abs=1e-15)
        assert point[2:4] == pytest.approx(p1, rel=1e-8, abs=1e-11)
        assert point[4:] == pytest.approx(p2, rel=1e-8, abs=2e-9)


@pytest.mark.parametrize("case", [*CASES, *PLAY])
@pytest.mark.parametrize("seed", range(3))
def test_mass_matrix_and_kinetic_energy(case, seed):
    run = prepared(case)
    q, v, point = random_state(run, seed)
    rows = jacobians(run, q, point)
    engine = mass_matrix(q, engine_point(run, q), run.model.constants)
    assert engine == pytest.approx(rows.T @ rows, rel=1e-8, abs=1e-8 * engine.max())
    assert engine == pytest.approx(engine.T, abs=0)
    assert 0.5 * v @ engine @ v == pytest.approx(0.5 * np.sum((rows @ v) ** 2), rel=1e-8)


@pytest.mark.parametrize("case", [*CASES, *PLAY])
@pytest.mark.parametrize("seed", range(3))
def test_quadratic_terms(case, seed):
    """h = J^T d(J)/dt v, the bias accelerations projected on the speeds."""
    run = prepared(case)
    q, v, point = random_state(run, seed)
    rows = jacobians(run, q, point)
    h = 3e-3 / np.abs(v).max()
    rates = [jacobians(run, q + k * h * v, point) @ v for k in (-3, -2, -1, 1, 2, 3)]
    bias = np.array([-1, 9, -45, 45, -9, 1]) / 60 @ np.array(rates) / h
    terms = rows.T @ bias
    # Where it is compiled, it is part of what calls it: its Python text is asked here.
    take = getattr(equations.take_quadratic_terms, "py_func", equations.take_quadratic_terms)
    found = np.zeros(len(q))
    take((np.cos(q), np.sin(q)), v, engine_point(run, q), run.model.constants, found)
    found = -found
    summands = np.abs(rows).T @ np.abs(bias)  # they cancel; differences are as exact as these are
    assert (abs(found - terms) < 1e-8 * summands).all()


def test_p_on_the_next_piece_is_another():
    """Beyond the top of the egg the ellipse goes on at another place than the circle."""
    run = prepared("ellipse", "joints.pin.curve=egg")
    track = run.system.track
    for theta in np.linspace(0, 2.2, 50):
        there = crossing_at(run, theta)
        track.settle()
    assert (there[0] / 0.04) ** 2 + (there[1] / 0.03) ** 2 == pytest.approx(1, rel=1e-12)
    track.next_piece(1, 0.0)
    assert track.u == track.curve.pieces[track.piece].start
    circle = crossing_at(run, theta)
    assert np.hypot(*circle[:2]) == pytest.approx(0.03, rel=1e-12)
    assert circle[:2] != pytest.approx(there[:2], abs=1e-6)


@pytest.mark.parametrize("case", ["ellipse", *PLAY])
def test_contact_gap_place_gradients_and_acceleration(case):
    run = prepared(case)
    q, v, _ = random_state(run, 5)
    c = run.model.constants

    def touch(coordinates, column):
        point = engine_point(run, coordinates)
        return faces.touches(coordinates, v, point, c)[0][0, column]

    states, gradients, slides = faces.touches(q, v, engine_point(run, q), c)
    one, six = np.array([-1, 9, -45, 45, -9, 1]) / 60, (-3, -2, -1, 1, 2, 3)
    for column, rows in ((0, gradients), (1, slides)):
        numeric = [
            one @ [touch(q + k * 1e-4 * row, column) for k in six] / 1e-4 for row in np.eye(len(q))
        ]
        assert rows[0] == pytest.approx(numeric, rel=1e-8, abs=1e-11)
        assert states[0, column + 2] == pytest.approx(rows[0] @ v, rel=1e-12)
    h = 1e-5
    rates = [touch(q + k * h * v, 2) for k in six]
    assert states[0, 4] == pytest.approx(one @ rates / h, rel=1e-7)


def test_elimination_solves():
    random = np.random.default_rng(1)
    matrix = random.uniform(size=(6, 6))
    matrix = matrix @ matrix.T + np.eye(6)
    vector = random.uniform(size=6)
    expected = np.linalg.solve(matrix, vector)
    eliminate(matrix, vector)
    assert vector == pytest.approx(expected, rel=1e-12)


def test_compiled_code_is_dropped_when_any_of_its_sources_changes(tmp_path):
    """`equations` contains `walls`: numba alone would keep running the walls of before."""
    sources = {"one.py": "x\n@compiled\ny", "two.py": "x\n@compiled\nz", "three.py": "x"}
    for name, text in sources.items():
        (tmp_path / name).write_text(text)
    before = fingerprint(tmp_path)
    (tmp_path / "three.py").write_text("nothing compiled here")
    assert fingerprint(tmp_path) == before
    (tmp_path / "two.py").write_text("x\n@compiled\nanother z")
    assert fingerprint(tmp_path) != before
    beside = tmp_path / "beside"
    beside.write_text("another constant")
    assert fingerprint(tmp_path, [beside]) != fingerprint(tmp_path)
    if hasattr(state_rate, "stats") and state_rate.stats.cache_path:
        assert PREFIX in state_rate.stats.cache_path
