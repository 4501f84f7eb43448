"""Where results go by default: no run replaces one of other options, or in silence."""

from dataclasses import replace
from itertools import combinations
from pathlib import Path

import pytest
from cli_runs import NO_CLEARANCE
from results import rigid_link

from exudyn_flexlink.cli import main, program_parser
from exudyn_flexlink.cli.placing import run_name
from exudyn_flexlink.measured_error import MeasuredError

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


def closed_form(scene, engine="exudyn", progress=None):
    return rigid_link(scene=scene)


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
