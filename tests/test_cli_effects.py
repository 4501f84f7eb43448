"""Effects left out."""

import pytest
from cli_runs import FRICTION, NO_CLEARANCE, QUIET, code_of, keeper

from exudyn_flexlink.cli import main
from exudyn_flexlink.loading import load_scene

# --- effects left out -------------------------------------------------------------------------


@pytest.mark.parametrize(
    "without",
    [["friction, clearance,friction"], ["friction", "--without", "clearance"]],
)
def test_effects_are_left_out(without, run_of, capsys):
    seen = []
    run_of(keeper(seen))
    assert main(["simulate", FRICTION, *QUIET, "--without", *without]) == 0
    (scene,) = seen
    ideal = load_scene(NO_CLEARANCE)
    assert scene.joints == ideal.joints
    assert scene.contacts == ideal.contacts
    assert scene.title.endswith("striking a sprung lever (without friction, clearance)")
    assert capsys.readouterr().err == "warning: made up\n"


def test_an_effect_that_is_not_there_is_hinted_at(run_of, capsys):
    seen = []
    run_of(keeper(seen))
    assert main(["simulate", NO_CLEARANCE, *QUIET, "--without", "clearance"]) == 0
    assert seen == [load_scene(NO_CLEARANCE)]
    assert capsys.readouterr().err.startswith(
        "hint: '--without clearance' changes nothing: the scene has no clearance\n"
    )


@pytest.mark.parametrize("name", ["frction", "", "friction,", "Friction"])
def test_an_effect_that_does_not_exist_is_bad_input(name, capsys):
    assert code_of("check", FRICTION, f"--without={name}") == 2
    assert (
        "; there is: clearance, flexibility, impact, friction, damping" in capsys.readouterr().err
    )


def test_a_scene_that_cant_be_without_an_effect_is_bad_input(tmp_path, capsys):
    """A link askew in its guide can't be in one without clearance."""
    tilted = ["--set", "initial={angles: {link: 2 deg, guide: 0}}"]
    assert main(["check", FRICTION, *tilted]) == 0
    capsys.readouterr()
    assert main(["check", FRICTION, *tilted, "--without", "clearance"]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "joints.sleeve: the link can't lie in its guide at the start: 2 deg" in shown.err
