"""How work grows with the size of a model, counted in operations: never by the clock."""

from collections.abc import Callable
from cProfile import Profile

import numpy as np
import pytest
from cli_runs import MODELS

from exudyn_flexlink.chain import Beam, discretise
from exudyn_flexlink.effects import with_impact
from exudyn_flexlink.engines import diagnostics, simulate
from exudyn_flexlink.engines.diagnostics import Bounces
from exudyn_flexlink.loading import assemble_scene, load_scene, scene_of
from exudyn_flexlink.mechanism import equilibrium
from exudyn_flexlink.report import check_text
from exudyn_flexlink.source import SceneError, parse_document

SOLVERS = ("cholesky", "cond", "eigh", "eigvalsh", "inv", "lstsq", "matrix_rank", "pinv", "qr",
           "solve", "svd")  # fmt: skip


BENT = """title: a strip too long between its pins
materials:
  steel: {density: 7850, youngs_modulus: 200 GPa}
bodies:
  strip: {type: flexible, length: 0.2, material: steel, section: {width: 10 mm, thickness: 2 mm},
          rods: COUNT, hinges: {stiffness: beam}}
joints:
  a: {type: revolute, points: [ground, strip.start], at: [0, 0]}
  b: {type: revolute, points: [ground, strip.end], at: [0.19, 0]}
run: {duration: 1}
accuracy: {tolerance: 1.0e-5}
"""


def check(model: str, rods: int, *settings: str) -> str:
    scene = load_scene(MODELS / f"{model}.yaml", [f"bodies.link.rods={rods}", *settings])
    return check_text(scene, assemble_scene(scene))


def checks(model: str, *settings: str) -> Callable[[int], object]:
    return lambda rods: check(model, rods, *settings)


def bent(rods: int) -> object:
    return assemble_scene(scene_of(parse_document(BENT.replace("COUNT", str(rods)), "test")))


WORK = {
    "the paper": checks("no_clearance"),
    "with walls": checks("clearance"),
    "supported": checks("supported"),
    "turned link": checks("no_clearance", "initial={angles: {link: 60 deg}}"),
    "spinning link": checks("clearance", "initial.speeds.link=3"),
    "bent": bent,
}


@pytest.fixture
def two_searches(monkeypatch: pytest.MonkeyPatch):
    """Make two of the 24 searches for other ways to close: each works as any other does."""
    monkeypatch.setattr(equilibrium, "STARTS", 2)


@pytest.fixture
def solved(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Shorter sides of all matrices that are factorised."""
    sides: list[int] = []

    def watched(solver: Callable[..., object]) -> Callable[..., object]:
        def call(matrix: np.ndarray, *others: object, **options: object) -> object:
            sides.append(min(np.shape(matrix)[-2:]))
            return solver(matrix, *others, **options)

        return call

    for name in SOLVERS:
        monkeypatch.setattr(np.linalg, name, watched(getattr(np.linalg, name)))
    return sides


@pytest.mark.usefixtures("two_searches")
@pytest.mark.parametrize("work", WORK.values(), ids=WORK)
def test_no_matrix_of_all_rods_is_factorised(work: Callable[[int], object], solved: list[int]):
    work(32)  # the half of them is more than is allowed
    assert solved
    assert max(solved) <= 15  # joints that close loops, slots, drives; a block of frequencies


def calls_of(work: Callable[[], object]) -> int:
    """Number of calls, in Python and of what is written in C."""
    profile = Profile()
    profile.runcall(work)
    return sum(entry.callcount for entry in profile.getstats())


@pytest.mark.usefixtures("two_searches")
@pytest.mark.parametrize("name", ["the paper", "with walls"])
def test_work_grows_with_the_number_of_rods(name: str):
    work = WORK[name]
    work(10)  # whatever is imported or cached
    few, many, more = (calls_of(lambda rods=rods: work(rods)) for rods in (10, 20, 30))
    assert more - many < 1.05 * (many - few)


@pytest.mark.parametrize("count", [1, 4, 9])
def test_frequencies_are_those_of_the_matrices(count):
    """By the angles of the rods: the centre of rod k is at sum_i arms[k, i] e(angle_i)."""
    chain = discretise(Beam(0.07, 0.04, 0.01, 5e-4), 10, "equal", "beam")
    lengths, masses, inertias = np.array([(r.length, r.mass, r.inertia) for r in chain.rods[1:]]).T
    arms = (np.tri(9, 9, -1) + 0.5 * np.eye(9)) * lengths
    mass = (arms.T * masses) @ arms + np.diag(inertias)
    bend = np.eye(9) - np.eye(9, k=-1)
    stiffness = (bend.T * [hinge.stiffness for hinge in chain.hinges]) @ bend
    squares = np.sort(np.linalg.eigvals(np.linalg.solve(mass, stiffness)).real)[:count]
    assert chain.cantilever_frequencies(count) == pytest.approx(np.sqrt(squares), rel=1e-9)


# --- samples ----------------------------------------------------------------------------------


def refused(*settings):
    with pytest.raises(SceneError) as caught:
        load_scene(MODELS / "smooth.yaml", settings)
    return str(caught.value)


def test_samples_are_limited_by_the_memory_they_take():
    end = 4 * np.pi / 5  # four turns at 10 rad/s
    few, many = "bodies.link.rods=5", "bodies.link.rods=100"
    load_scene(MODELS / "smooth.yaml", [few, f"run.sample={end / 5e5}"])
    told = refused(many, f"run.sample={end / 5e5}")
    assert "run.sample: would keep 5e+05 samples, 13 GB; 149532 of 26750 bytes fit" in told
    assert "a run.sample of at least 1.7e-05 s, or a smaller run.turns" in told


def test_a_step_that_no_clock_shows_is_refused():
    told = refused("run={duration: 1}", "accuracy={step: 1e-30}")
    assert "accuracy.step: 1e-30 s is less than a clock shows that runs to 1 s" in told


# --- mistakes ---------------------------------------------------------------------------------


def many_mistakes(count):
    bodies = "".join(f"  b{i}: {{type: rod, lenght: 5 N}}\n" for i in range(count))
    joints = "".join(
        f"  j{i}: {{type: revolute, points: [ground, c{i}.start], at: [0, 0]}}\n"
        for i in range(count)
    )
    return f"title: t\nbodies:\n{bodies}joints:\n{joints}run: {{duration: 1}}\n"


def told_of(count):
    with pytest.raises(SceneError) as caught:
        scene_of(parse_document(many_mistakes(count), "test"))
    return str(caught.value)


def test_of_many_mistakes_the_first_are_shown_and_all_are_counted():
    lines = told_of(100).splitlines()
    assert lines[-1] == "401 mistakes; the first 50 are shown"
    assert sum(line.startswith("test:") for line in lines) == 50


# --- runs that can't go on ----------------------------------------------------------------------


def test_slow_elastic_impacts_without_end_are_a_thousand():
    bounces = Bounces("strike", restitution=1)
    assert bounces.endless(0.0, 1.0) == ""
    told = [bounces.endless(1 + k * 1e-3, 2e-3) for k in range(1000)]
    assert set(told[:-1]) == {""}
    assert told[-1].startswith("contact 'strike' bounces on the spot: 1000 impacts within 1 s")


def test_elastic_bounces_without_end_stop_with_the_contact(monkeypatch):
    """After 30 slow impacts in a row here: a thousand take most of a minute."""
    monkeypatch.setattr(diagnostics, "MOST_SUNK", 30)
    settings = [
        "contacts.strike.law.restitution=1",
        "run.turns=0.3",
        "initial.angles.guide=179 deg",
    ]
    scene = with_impact(load_scene(MODELS / "no_clearance.yaml", settings), "impulse")
    result = simulate(scene, "lagrangian")
    told = result.outcome.reason
    assert not result.outcome.completed
    assert told.startswith("contact 'strike' bounces on the spot: 30 impacts within")
    assert "restitution" in result.outcome.advice
    assert len(result.time) > 100
    assert len(result.events) < 150


def test_a_run_that_gets_nowhere_is_a_result_of_its_start():
    result = simulate(load_scene(MODELS / "smooth.yaml", ["gravity=[0, -1e20]"]))
    assert not result.outcome.completed
    assert result.outcome.advice
    assert result.time[-1] < 1e-9  # of 2.5 s
    assert np.isfinite(result.poses).all()
    assert result.energy.kinetic.shape == result.time.shape


@pytest.mark.parametrize("tolerance", [1e4, 1e10])
def test_a_state_that_diverges_ends_a_run_with_what_came_before(tolerance):
    """By tolerances that no model file may ask for: told the same way wherever it diverges."""
    scene = load_scene(MODELS / "no_clearance.yaml", ["solver.integrator=dop853"])
    accuracy = scene.accuracy.model_copy(update={"tolerance": tolerance})
    result = simulate(scene.changed(accuracy=accuracy), "lagrangian")
    assert not result.outcome.completed
    assert "beyond all bounds: the tolerance is too loose" in result.outcome.reason
    assert np.isfinite(result.poses).all()
