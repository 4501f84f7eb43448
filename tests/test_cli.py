"""The program at a terminal: exit codes, what is said where, and what is not imported.

Most runs here are made by closed form (`results`), so that they need no engine; those of the last
section are real.
"""

import json
import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from results import rigid_link, stopped

from exudyn_flexlink import cli
from exudyn_flexlink.cli import main
from exudyn_flexlink.engines import NotRepresentableError
from exudyn_flexlink.loading import load_scene
from exudyn_flexlink.result import Outcome, Result
from exudyn_flexlink.scene import Accuracy, Scene, json_schema

ROOT = Path(__file__).parents[1]
MODELS = ROOT / "models"
NO_CLEARANCE = str(MODELS / "no_clearance.yaml")
FRICTION = str(MODELS / "clearance_friction.yaml")
RIGID = str(MODELS / "rigid.yaml")
SPLINE = str(MODELS / "spline_track.yaml")
COMMANDS = ("simulate", "compare", "accuracy", "check", "plot", "schema")

Capture = pytest.CaptureFixture[str]
Fake = Callable[..., Result]


def python(*arguments: str, **options: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
        **options,  # type: ignore[call-overload]
    )


def row(text: str, first: str) -> list[str]:
    """Words of the first line of a text that begins with the word `first`."""
    return next(line.split() for line in text.splitlines() if line.split()[:1] == [first])


# --- what is not imported -------------------------------------------------------------------


@pytest.mark.parametrize("model", [NO_CLEARANCE, RIGID])
def test_check_imports_nothing_slow(model: str) -> None:
    code = (
        "import sys; from exudyn_flexlink.cli import main; main(['check', sys.argv[1]]);"
        "slow = {'scipy', 'matplotlib', 'exudyn', 'pint', 'rich'};"
        "print(*slow & set(sys.modules), file=sys.stderr)"
    )
    ran = python("-c", code, model)
    assert ran.stderr.strip() == ""
    assert ran.stdout.startswith(model)


def test_help_imports_not_even_numpy() -> None:
    code = (
        "import sys, exudyn_flexlink.cli as cli; cli._parser().format_help();"
        "print(*{'numpy', 'pydantic', 'yaml'} & set(sys.modules))"
    )
    assert python("-c", code).stdout.strip() == ""


# --- bad input ------------------------------------------------------------------------------


@pytest.mark.parametrize("command", ["check", "simulate"])
def test_a_mistake_is_shown_where_it_stands(command: str, tmp_path: Path, capsys: Capture) -> None:
    model = tmp_path / "wrong.yaml"
    text = Path(NO_CLEARANCE).read_text(encoding="utf-8")
    model.write_text(text.replace("clearance: 0", "clearance: 5 N"), encoding="utf-8")
    assert main([command, str(model)]) == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert shown.err.startswith(f"{model}:36:")
    assert "joints.sleeve.clearance: expected a length, got '5 N'" in shown.err
    assert "^^^" in shown.err
    assert "Traceback" not in shown.err
    assert not Path("runs/wrong").exists()


@pytest.mark.parametrize("command", ["check", "simulate"])
def test_a_missing_model_is_named(command: str, capsys: Capture) -> None:
    assert main([command, "models/nowhere.yaml"]) == 2
    assert capsys.readouterr().err.startswith(
        "models/nowhere.yaml: can't read the file: No such file"
    )


def test_a_wrong_setting_is_shown_as_given(capsys: Capture) -> None:
    assert main(["check", NO_CLEARANCE, "--set", "run.turs=2"]) == 2
    assert "--set run.turs=2: run.turs: unknown key 'turs'; did you mean 'turns'?" in (
        capsys.readouterr().err
    )


@pytest.mark.parametrize("arguments", [[], ["dance"], ["check"], ["check", RIGID, "--plots"]])
def test_wrong_arguments_are_bad_input(arguments: list[str], capsys: Capture) -> None:
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert "usage:" in capsys.readouterr().err


def test_files_outside_the_models_folder_need_leave(tmp_path: Path, capsys: Capture) -> None:
    model = tmp_path / "inner" / "model.yaml"
    model.parent.mkdir()
    text = Path(SPLINE).read_text(encoding="utf-8").replace("track_points", "../track_points")
    model.write_text(text, encoding="utf-8")
    (tmp_path / "track_points.csv").write_text((MODELS / "track_points.csv").read_text())
    assert main(["check", str(model)]) == 2
    assert "the file must be in the model's folder" in capsys.readouterr().err
    assert main(["check", str(model), "--allow-outside"]) == 0


# --- help, version, schema ------------------------------------------------------------------


@pytest.mark.parametrize("command", COMMANDS)
def test_help_gives_examples_that_parse(command: str, capsys: Capture) -> None:
    with pytest.raises(SystemExit) as ended:
        main([command, "--help"])
    assert ended.value.code == 0
    shown = capsys.readouterr().out
    lines = [line.split() for line in shown.split("examples:\n")[1].splitlines()]
    assert 2 <= len(lines) <= 5
    for line in lines:
        assert line[:2] == ["exudyn-flexlink", command]
        cli._parser().parse_args(line[1:])


def test_version(capsys: Capture) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["--version"])
    assert ended.value.code == 0
    assert capsys.readouterr().out.startswith("exudyn-flexlink")


def test_schema_is_printed_or_written(tmp_path: Path, capsys: Capture) -> None:
    assert main(["schema"]) == 0
    printed = capsys.readouterr().out
    assert json.loads(printed) == json_schema()
    assert main(["schema", "--out", str(tmp_path / "schema.json")]) == 0
    assert (tmp_path / "schema.json").read_text(encoding="utf-8") == printed


def test_a_schema_that_cant_be_written_is_bad_input(tmp_path: Path, capsys: Capture) -> None:
    assert main(["schema", "--out", str(tmp_path / "nowhere" / "schema.json")]) == 2
    assert "can't write" in capsys.readouterr().err


def test_a_reader_that_has_seen_enough_is_no_error() -> None:
    pytest.importorskip("fcntl")  # pipes of a shell
    command = f"'{sys.executable}' -m exudyn_flexlink schema | head -n 1"
    ran = subprocess.run(["bash", "-c", f"set -o pipefail; {command}"], cwd=ROOT, check=False,
                         capture_output=True, text=True)  # fmt: skip
    assert (ran.returncode, ran.stdout, ran.stderr) == (0, "{\n", "")


# --- simulate, with runs made by closed form --------------------------------------------------


@pytest.fixture
def run_of(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Callable[[Fake], None]:
    """Put a function in the engine's place, and the test into an empty folder."""
    monkeypatch.chdir(tmp_path)
    return lambda fake: monkeypatch.setattr("exudyn_flexlink.engines.simulate", fake)


def closed_form(scene: Scene, engine: str = "exudyn", progress: object = None) -> Result:
    return rigid_link(scene=scene)


def test_simulate_summarises_the_run(run_of: Callable[[Fake], None], capsys: Capture) -> None:
    run_of(closed_form)
    assert main(["simulate", NO_CLEARANCE, "--no-plots"]) == 0
    shown = capsys.readouterr()
    assert shown.out.startswith("Completed: Extensible flexible link")
    assert "solver time     1.50 s" in shown.out
    assert row(shown.out, "steps")[1] == "100,"
    first, third = row(shown.out, "1"), row(shown.out, "3")
    assert first[:9] == ["1", "0.31416", "s", "180.00", "deg", "0.9000", "m/s", "0.02800", "m"]
    assert third[:5] == ["3", "1.57080", "s", "180.00", "deg"]
    assert -0.16 < float(first[9]) < -0.13  # the swing made up begins downwards
    assert "% of the largest kinetic energy" in shown.out
    assert "open by 1e-12" in shown.out
    assert shown.err == "warning: made up\n"
    assert "Written to runs/no_clearance/: " in shown.out
    written = {path.name for path in Path("runs/no_clearance").iterdir()}
    assert {"result.npz", "summary.json"} <= written
    assert all(name in shown.out for name in written)


def test_quiet_says_no_more_than_warnings(run_of: Callable[[Fake], None], capsys: Capture) -> None:
    run_of(closed_form)
    assert main(["simulate", NO_CLEARANCE, "--no-plots", "--quiet", "--out", "here"]) == 0
    assert tuple(capsys.readouterr()) == ("", "warning: made up\n")
    assert Path("here/summary.json").is_file()


def test_settings_reach_the_engine(run_of: Callable[[Fake], None]) -> None:
    seen: list[float | None] = []

    def fake(scene: Scene, engine: str = "exudyn", progress: object = None) -> Result:
        seen.append(scene.run.turns)
        return rigid_link(scene=scene)

    run_of(fake)
    main(["simulate", NO_CLEARANCE, "--no-plots", "--quiet", "--set", "run.turns=2"])
    assert seen == [2.0]


@pytest.mark.parametrize("quiet", [[], ["--quiet"]])
def test_a_failed_run_is_kept_and_explained(
    run_of: Callable[[Fake], None], quiet: list[str], capsys: Capture
) -> None:
    run_of(lambda scene, engine, progress=None: stopped(rigid_link(scene=scene)))
    assert main(["simulate", NO_CLEARANCE, "--no-plots", *quiet]) == 1
    shown = capsys.readouterr()
    assert "the run stopped at 0.5 s: no convergence at the smallest step" in shown.err
    assert "try: allow a smaller step" in shown.err
    assert "runs/no_clearance/, marked as incomplete" in shown.err
    summary = json.loads(Path("runs/no_clearance/summary.json").read_text(encoding="utf-8"))
    assert summary["outcome"]["completed"] is False
    assert shown.out.startswith("" if quiet else "Stopped before its end: ")


def test_an_engine_that_stops_at_an_interrupt_keeps_its_part(
    run_of: Callable[[Fake], None], capsys: Capture
) -> None:
    def fake(scene: Scene, engine: str = "exudyn", progress: object = None) -> Result:
        return replace(rigid_link(scene=scene), outcome=Outcome(False, 0.5, "interrupted"))

    run_of(fake)
    assert main(["simulate", NO_CLEARANCE, "--no-plots", "--quiet"]) == 130
    assert "the run stopped at 0.5 s: interrupted" in capsys.readouterr().err
    assert Path("runs/no_clearance/summary.json").is_file()


def test_an_interrupt_leaves_nothing_behind(
    run_of: Callable[[Fake], None], capsys: Capture
) -> None:
    def fake(scene: Scene, engine: str = "exudyn", progress: object = None) -> Result:
        raise KeyboardInterrupt

    run_of(fake)
    assert main(["simulate", NO_CLEARANCE]) == 130
    assert capsys.readouterr().err == "interrupted; nothing was written\n"
    assert list(Path().iterdir()) == []


def test_what_an_engine_cant_represent_is_bad_input(
    run_of: Callable[[Fake], None], capsys: Capture
) -> None:
    def fake(scene: Scene, engine: str = "exudyn", progress: object = None) -> Result:
        raise NotRepresentableError(("joints", "pin"), "no such slot")

    run_of(fake)
    assert main(["simulate", NO_CLEARANCE]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"{NO_CLEARANCE}:37:")
    assert "joints.pin: no such slot" in said
    assert "hint: refused by the engine 'exudyn'" in said
    assert list(Path().iterdir()) == []


def test_a_folder_of_something_else_is_refused_before_the_run(
    run_of: Callable[[Fake], None], capsys: Capture
) -> None:
    def fake(scene: Scene, engine: str = "exudyn", progress: object = None) -> Result:
        raise AssertionError("must not run")

    run_of(fake)
    Path("thesis").mkdir()
    Path("thesis/chapter.txt").write_text("years of work")
    assert main(["simulate", NO_CLEARANCE, "--out", "thesis"]) == 2
    assert "thesis holds files that are no run of this program" in capsys.readouterr().err
    assert Path("thesis/chapter.txt").read_text() == "years of work"


# --- effects left out -------------------------------------------------------------------------


def keeper(seen: list[Scene]) -> Fake:
    """Closed form in place of an engine; it keeps the scenes that it is asked for."""

    def fake(scene: Scene, engine: str = "exudyn", progress: object = None) -> Result:
        seen.append(scene)
        return rigid_link(scene=scene, samples=101)

    return fake


QUIET = ["--no-plots", "--quiet", "--out", "here"]


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
def test_the_horizon_is_where_a_finer_run_parts(
    quiet: list[str], run_of: Callable[[Fake], None], capsys: Capture
) -> None:
    seen: list[Accuracy] = []
    run_of(parting(1.0, seen))
    assert main(["simulate", NO_CLEARANCE, "--no-plots", "--horizon", *quiet]) == 0
    assert [accuracy.tolerance for accuracy in seen] == [1e-6, 5e-7]
    shown = capsys.readouterr().out
    assert "link.end can be trusted pointwise up to t = 1" in shown
    assert shown.startswith("link.end" if quiet else "Completed: ")
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
    assert "No horizon known: the second run did not end. There the run stopped at 0.5 s" in (
        capsys.readouterr().out
    )
    assert Path("here/summary.json").is_file()


# --- progress -------------------------------------------------------------------------------

PROGRESS = """
import sys, time
from pathlib import Path
sys.path.insert(0, 'tests')
from results import rigid_link
import exudyn_flexlink.engines as engines
from exudyn_flexlink import cli

def fake(scene, engine='exudyn', progress=None):
    for i in range(11):
        time.sleep(float(sys.argv[1]))
        if progress:
            progress(i / 10)
    return rigid_link(scene=scene)

cli.terminal.SOON = 0.2
engines.simulate = fake
sys.exit(cli.main(['simulate', sys.argv[2], '--no-plots', '--out', *sys.argv[3:]]))
"""


def on_a_terminal(*arguments: str) -> str:
    """What the program writes to stderr if that is a terminal."""
    pty = pytest.importorskip("pty")
    ours, theirs = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", PROGRESS, *arguments],
        cwd=ROOT,
        stdout=subprocess.DEVNULL,
        stderr=theirs,
        env=os.environ | {"TERM": "xterm", "PYTHONPATH": str(ROOT)},
    ) as process:
        os.close(theirs)
        seen = b""
        while True:
            try:
                chunk = os.read(ours, 4096)
            except OSError:  # how Linux says that the other side is closed
                break
            if not chunk:
                break
            seen += chunk
    os.close(ours)
    assert process.returncode == 0, seen
    return seen.decode()


def test_a_long_run_shows_its_progress_and_the_time_left(tmp_path: Path) -> None:
    seen = on_a_terminal("0.1", NO_CLEARANCE, str(tmp_path / "out"))
    assert "simulating" in seen
    assert "%" in seen
    assert "left" in seen


@pytest.mark.parametrize(("pause", "quiet"), [("0", []), ("0.1", ["--quiet"])])
def test_a_short_or_quiet_run_shows_no_progress(
    pause: str, quiet: list[str], tmp_path: Path
) -> None:
    seen = on_a_terminal(pause, NO_CLEARANCE, str(tmp_path / "out"), *quiet)
    assert seen.strip() == "warning: made up"


def test_a_piped_run_shows_no_progress(tmp_path: Path) -> None:
    ran = python("-c", PROGRESS, "0.05", NO_CLEARANCE, str(tmp_path / "out"))
    assert ran.returncode == 0
    assert ran.stderr == "warning: made up\n"


# --- real runs ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def real_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Run of the program as a user starts it, with figures: one strike."""
    target = tmp_path_factory.mktemp("runs") / "short"
    command = ["-m", "exudyn_flexlink", "simulate", RIGID, "--set", "run.turns=0.75"]
    ran = python(*command, "--out", str(target))
    assert ran.returncode == 0, ran.stderr
    assert "Traceback" not in ran.stderr
    assert ran.stdout.startswith("Completed: Extensible rigid link")
    # The track brings S to the lever at 180 deg; the tolerance of 2e-5 m is 0.01 deg of S's path.
    assert float(row(ran.stdout, "1")[3]) == pytest.approx(180, abs=0.02)
    return target


def test_a_real_run_writes_results_and_figures(real_run: Path) -> None:
    assert (real_run / "summary.json").is_file()
    assert list(real_run.rglob("*.png"))


def test_plot_draws_the_figures_again(real_run: Path, tmp_path: Path, capsys: Capture) -> None:
    assert main(["plot", str(real_run), "--out", str(tmp_path / "figures")]) == 0
    assert "Figures written to" in capsys.readouterr().out
    first = {path.name for path in real_run.rglob("*.png")}
    assert {path.name for path in (tmp_path / "figures").rglob("*.png")} == first


def test_plot_of_no_run_is_bad_input(tmp_path: Path, capsys: Capture) -> None:
    assert main(["plot", str(tmp_path)]) == 2
    assert "Traceback" not in capsys.readouterr().err
