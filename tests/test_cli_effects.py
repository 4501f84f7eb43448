"""Effects left out, and the horizon."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from cli_runs import FRICTION, NO_CLEARANCE, QUIET, Capture, Fake, keeper
from results import rigid_link, stopped

from exudyn_flexlink.cli import main
from exudyn_flexlink.engines.diagnostics.neighbour import HIGH_ORDER
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.result import Result
from exudyn_flexlink.scene import Accuracy, Scene

# --- effects left out -------------------------------------------------------------------------


@pytest.mark.parametrize(
    "without",
    [
        ["--without", "friction,clearance"],
        ["--without", "friction, clearance,friction"],
        ["--without", "friction", "--without", "clearance"],
    ],
)
def test_effects_are_left_out(
    without: list[str], run_of: Callable[[Fake], None], capsys: Capture
) -> None:
    seen: list[Scene] = []
    run_of(keeper(seen))
    assert main(["simulate", FRICTION, *QUIET, *without]) == 0
    (scene,) = seen
    ideal = load_scene(NO_CLEARANCE)
    assert scene.joints == ideal.joints
    assert scene.contacts == ideal.contacts
    assert scene.title.endswith("striking a sprung lever (without friction, clearance)")
    assert capsys.readouterr().err == "warning: made up\n"


def test_an_effect_that_is_not_there_is_hinted_at(
    run_of: Callable[[Fake], None], capsys: Capture
) -> None:
    seen: list[Scene] = []
    run_of(keeper(seen))
    assert main(["simulate", NO_CLEARANCE, *QUIET, "--without", "clearance"]) == 0
    assert seen == [load_scene(NO_CLEARANCE)]
    assert capsys.readouterr().err.startswith(
        "hint: '--without clearance' changes nothing: the scene has no clearance\n"
    )


@pytest.mark.parametrize("command", ["simulate", "check", "compare"])
@pytest.mark.parametrize("name", ["frction", "", "friction,", "Friction"])
def test_an_effect_that_does_not_exist_is_bad_input(
    command: str, name: str, capsys: Capture
) -> None:
    with pytest.raises(SystemExit) as ended:
        main([command, FRICTION, f"--without={name}"])
    assert ended.value.code == 2
    assert (
        "; there is: clearance, flexibility, impact, friction, damping" in capsys.readouterr().err
    )


def test_a_scene_that_cant_be_without_an_effect_is_bad_input(
    tmp_path: Path, capsys: Capture
) -> None:
    """A link askew in its guide can't be in one without clearance."""
    tilted = ["--set", "initial={angles: {link: 2 deg, guide: 0}}"]
    assert main(["check", FRICTION, *tilted]) == 0
    capsys.readouterr()
    assert main(["check", FRICTION, *tilted, "--without", "clearance"]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "joints.sleeve: the link can't lie in its guide at the start: 2 deg" in shown.err


# --- the horizon ------------------------------------------------------------------------------


def parting(at: float, accuracies: list[Accuracy]) -> Fake:
    """Every run but the first goes another way from `at` (s) on."""

    def fake(scene: Scene, engine: str = "exudyn", progress: object = None) -> Result:
        made = rigid_link(scene=scene, samples=801)
        poses = made.poses.copy()
        if accuracies:
            poses[made.time >= at, :, 0] += 0.01
        accuracies.append(scene.accuracy)
        return replace(made, poses=poses, settings={"tolerance": scene.accuracy.tolerance or 0.0})

    return fake


@pytest.mark.parametrize("quiet", [[], ["--quiet"]])
def test_the_horizon_is_where_a_neighbouring_run_parts(
    quiet: list[str], run_of: Callable[[Fake], None], capsys: Capture
) -> None:
    seen: list[Accuracy] = []
    run_of(parting(1.0, seen))
    assert main(["simulate", NO_CLEARANCE, "--no-plots", "--horizon", *quiet]) == 0
    assert [accuracy.tolerance for accuracy in seen] == [1e-6, pytest.approx(HIGH_ORDER * 1e-6)]
    shown = capsys.readouterr().out
    assert "points can be trusted instant by instant up to t = 1" in shown
    assert shown.startswith("All 8 named" if quiet else "Completed: ")
    assert Path("runs/no_clearance/summary.json").is_file()


def test_no_second_run_for_one_that_fails(run_of: Callable[[Fake], None], capsys: Capture) -> None:
    calls: list[Scene] = []
    fake = keeper(calls)
    run_of(lambda scene, engine, progress=None: stopped(fake(scene, engine)))
    assert main(["simulate", NO_CLEARANCE, *QUIET, "--horizon"]) == 1
    assert len(calls) == 1
    assert capsys.readouterr().out == ""


def test_a_second_run_that_fails_takes_nothing_away(
    run_of: Callable[[Fake], None], capsys: Capture
) -> None:
    seen: list[Accuracy] = []
    fake = parting(9.0, seen)
    run_of(
        lambda scene, engine, progress=None: (
            stopped(fake(scene, engine)) if seen else fake(scene, engine)
        )
    )
    assert main(["simulate", NO_CLEARANCE, *QUIET, "--horizon"]) == 0
    said = capsys.readouterr()
    assert "where a run stopped" in said.out
    assert "s only, where the neighbouring run stopped" in said.err
    assert Path("here/summary.json").is_file()
