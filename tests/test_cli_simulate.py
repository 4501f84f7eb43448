"""The command `simulate`: runs made by closed form, and a real one."""

import json
from dataclasses import replace
from itertools import combinations
from pathlib import Path

import pytest
from cli_runs import FRICTION, NO_CLEARANCE, QUIET, RIGID, code_of, keeper, row
from results import rigid_link, stopped

from exudyn_flexlink.cli import main, program_parser
from exudyn_flexlink.cli.keeping import run_name
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.result import MeasuredError

# --- simulate, with runs made by closed form --------------------------------------------------


def closed_form(scene, engine="exudyn", progress=None):
    return rigid_link(scene=scene)


def test_simulate_summarises_the_run(run_of, capsys):
    run_of(closed_form)
    assert main(["simulate", NO_CLEARANCE, "--no-plots"]) == 0
    shown = capsys.readouterr()
    assert shown.out.startswith("Completed: Extensible flexible link")
    assert "solver time     1.50 s" in shown.out
    assert row(shown.out, "steps")[1] == "100,"
    first, third = row(shown.out, "1"), row(shown.out, "3")
    assert first[:9] == ["1", "180.00", "deg", "0.31416", "s", "0.9000", "m/s", "0.02800", "m"]
    assert third[:5] == ["3", "180.00", "deg", "1.57080", "s"]
    assert -0.16 < float(first[9]) < -0.13  # the swing made up begins downwards
    assert "% of the largest kinetic energy" in shown.out
    assert "open by 1e-12" in shown.out
    assert shown.err == "warning: made up\n"
    assert "Written to runs/no_clearance/:\n  " in shown.out
    written = {path.name for path in Path("runs/no_clearance").iterdir()}
    assert {"result.nc", "summary.json"} <= written
    assert all(name in shown.out for name in written)


@pytest.mark.parametrize(
    ("command", "option", "instead"),
    [
        ("simulate", "--horizon", "leave the option out"),
        ("simulate", "--no-horizon", "'--no-measure'"),
        ("sweep", "--no-horizon", "'--no-measure'"),
        ("simulate", "--retries=2", "accuracy.tolerance"),
        ("sweep", "--retries", "accuracy.tolerance"),
    ],
)
def test_an_option_that_went_is_told_with_what_to_do_instead(command, option, instead, capsys):
    assert code_of(command, RIGID, option) == 2
    told, hint = capsys.readouterr().err.splitlines()
    assert told.endswith(f"there is no '{option.partition('=')[0]}' any more")
    assert instead in hint


@pytest.mark.parametrize("quiet", [[], ["--quiet"]])
def test_a_failed_run_is_kept_and_explained(run_of, quiet, capsys):
    run_of(lambda scene, engine, progress=None: stopped(rigid_link(scene=scene)))
    assert main(["simulate", NO_CLEARANCE, "--no-plots", *quiet]) == 1
    shown = capsys.readouterr()
    assert "the run stopped at 0.5 s: no convergence at the smallest step" in shown.err
    assert "try: allow a smaller step" in shown.err
    assert "runs/no_clearance/, marked as incomplete" in shown.err
    summary = json.loads(Path("runs/no_clearance/summary.json").read_text(encoding="utf-8"))
    assert summary["outcome"]["completed"] is False
    assert shown.out.startswith("" if quiet else "Stopped before its end: ")


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


def test_a_scene_that_cant_be_without_an_effect_is_bad_input(capsys):
    """A link askew in its guide can't be in one without clearance."""
    tilted = ["--set", "initial={angles: {link: 2 deg, guide: 0}}"]
    assert main(["check", FRICTION, *tilted]) == 0
    capsys.readouterr()
    assert main(["check", FRICTION, *tilted, "--without", "clearance"]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "joints.sleeve: the link can't lie in its guide at the start: 2 deg" in shown.err


# --- where results go -----------------------------------------------------------------------------

NAMES = {
    "": "no_clearance",
    "--engine exudyn": "no_clearance",
    "--engine lagrangian": "no_clearance-lagrangian",
    "--engine lagrangian --impact impulse": "no_clearance-lagrangian-impulse",
    "--set run.turns=2": "no_clearance-turns=2",
    "--set run.turns=2 --set run.turns=3": "no_clearance-turns=3",
    "--set bodies.link.rods=20 --set accuracy.tolerance=1e-7": (
        "no_clearance-tolerance=1e-7-link.rods=20"
    ),
    "--set drives.motor.value=15_rad/s": "no_clearance-motor.value=15rad_s",
    "--set bodies.link.hinges.damping=2e-5_N_m_s/rad": (
        "no_clearance-link.hinges.damping=2e-5N.m.s_rad"
    ),
    "--set initial.angles.guide=-30_deg": "no_clearance-angles.guide=-30deg",
    "--watch link.start": "no_clearance-watch=link.start",
    "--without friction,clearance --without friction": "no_clearance-without_clearance_friction",
}


def name_of(line, command="simulate", suffix=""):
    """Return the folder's name; underscores of values stand for spaces."""
    words = [word.replace("_", " ") if "=" in word else word for word in line.split()]
    return run_name(program_parser().parse_args([command, NO_CLEARANCE, *words]), suffix)


@pytest.mark.parametrize(("line", "name"), NAMES.items())
def test_what_changes_the_motion_is_in_the_name(line, name):
    assert name_of(line) == name


def test_commands_have_folders_of_their_own_and_the_order_of_settings_does_not_matter():
    one, other = "--set run.turns=1", "--set bodies.link.rods=5"
    assert name_of(f"{one} {other}") == name_of(f"{other} {one}")
    for command in ("compare", "accuracy"):
        assert name_of(one, command, f"-{command}") == f"no_clearance-{command}-turns=1"
    assert run_name(program_parser().parse_args(["compare", "."])) == Path.cwd().name


LONG = [
    "--set joints.crank.at=[0.02,0]",
    "--set joints.crank.at=[0.02;0]",
    "--set joints.crank.at=0.02,0",
    "--set curves.track.file=../a/b.csv",
    "--set curves.track.file=../a:b.csv",
    "--set bodies.link.hinges.damping=2_N_m_s/rad",
    "--set bodies.link.hinges.damping=2_N_ms/rad",
    "--set title=" + "x" * 300,
    "--set title=" + "x" * 301,
]


def test_every_name_is_safe_short_and_its_own():
    found = [name_of(line) for line in LONG]
    for name in found:
        assert len(name) <= 80
        assert not set(name) & set("/\\:*?\"<>|[]{}$&;'`! \t\n")
        assert name.startswith("no_clearance-")
    assert all(one != other for one, other in combinations(found, 2))
    assert found[0].startswith("no_clearance-crank.at=0.02,0-")


def test_a_run_by_another_engine_or_setting_stands_beside(run_of, capsys):
    run_of(closed_form)
    for more in ([], ["--engine", "lagrangian"], ["--set", "run.turns=2"]):
        assert main(["simulate", NO_CLEARANCE, "--no-plots", *more]) == 0
    stand = sorted(path.name for path in Path("runs").iterdir())
    assert stand == ["no_clearance", "no_clearance-lagrangian", "no_clearance-turns=2"]
    assert "in place of" not in capsys.readouterr().out


def test_an_earlier_run_is_not_replaced_in_silence(run_of, capsys):
    run_of(closed_form)
    for told in ("Written to runs/no_clearance/:\n  ",
                 "Written to runs/no_clearance/ in place of an earlier run:\n  "):  # fmt: skip
        assert main(["simulate", NO_CLEARANCE, "--no-plots"]) == 0
        assert told in capsys.readouterr().out


def test_a_second_run_replaces_no_earlier_one(run_of, capsys):
    run_of(closed_form, lambda run: replace(run, error=MeasuredError(("a.b",), largest=1e-7)))
    assert main(["simulate", NO_CLEARANCE, "--no-plots"]) == 0
    said = capsys.readouterr().out
    assert "in place of" not in said
    assert "a.b within 1e-07 m" in said
