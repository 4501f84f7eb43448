"""Measured series: how files are read, and how runs are held against them."""

from dataclasses import replace

import numpy as np
import pytest
import results
from cli_runs import code_of
from results import block
from scipy.io import loadmat, savemat
from test_fitting import DATA

import exudyn_flexlink as fl
from exudyn_flexlink.fitting import NoOverlapError, against, read_series
from exudyn_flexlink.observables import signals
from exudyn_flexlink.quantities import Dimension
from exudyn_flexlink.result import MeasuredError
from exudyn_flexlink.source import SceneError
from exudyn_flexlink.storage import lever_columns, trajectory_columns
from exudyn_flexlink.storage.documents import write_csv


def fades(t):
    return 0.2 * np.exp(-t) * np.sin(9 * t)


def swinging(**options):
    """A block that fades: only one shift of its motion fits."""
    return block(
        fades,
        lambda t: 0.2 * np.exp(-t) * (9 * np.cos(9 * t) - np.sin(9 * t)),
        samples=801, end=4.0, **options,
    )  # fmt: skip


RUN = swinging()
POINT = next(name for name in signals(RUN.scene) if name.endswith(".x"))
OFF = signals(RUN.scene)[POINT].at(RUN, np.zeros(1))[0]  # of the point from the block's origin


def series(text, tmp_path, columns=None):
    (tmp_path / "m.csv").write_text(text, encoding="utf-8")
    return read_series(RUN.scene, tmp_path / "m.csv", columns)


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        ("t,x\n0,0.1\n0.5,0.2\n1,0.3\n", {"x": POINT}),
        ("t (ms);x (mm);note\n0;100;a\n500,0;200;b\n1000;300;c\n", {"x": POINT}),
        ("# by hand\n# time_ms\tplace_mm\n0\t100\n500\t200\n1000\t300\n", {"place_mm": POINT}),
        ("place,time\n(cm),(s)\n10,0\n20,0.5\n30,1\n", {"place": POINT}),
        ("0 0.1\n0.5 0.2\n1 0.3", {"2": POINT}),
        (f"{POINT}_m,t_s\n0.1,0\n0.2,0.5\n0.3,1", None),
        ("t_s,x_m\n0,0.1\n0.5,0.2\n1,0.3", None),  # as the table of the watched point has it
    ],
)
def test_columns_by_their_names_in_their_units(text, columns, tmp_path):
    found = series(text, tmp_path, columns)
    (values,) = found.values.values()
    assert found.time == pytest.approx([0, 0.5, 1])
    assert values == pytest.approx([0.1, 0.2, 0.3])
    assert found.left_out == (("note",) if "note" in text else ())


@pytest.mark.parametrize(
    ("text", "columns", "words"),
    [
        ("t,x\n0,0.1\n1,abc\n2,inf", {"x": POINT},
         ["m.csv:3:3: 'x': expected a finite number, got 'abc'", "m.csv:4:3", "2 mistakes"]),
        ("t,x\n0,1\n1,2\n0.9,3", {"x": POINT}, ["m.csv:4:1: 't': times must not fall"]),
        ("t,x\n0,1,2\n1,2,3", {"x": POINT}, ["line 1: expected 3 names of columns"]),
        ("t,x\n0,1\n1,2,3", {"x": POINT}, ["line 3: 3 cells, where the first row has 2"]),
        ("t,x (deg)\n0,1\n1,2", {"x": POINT}, ["'deg' is no unit of a length"]),
        ("n,x\n0,1\n1,2", {"x": POINT}, ["no column of time"]),
        ("t,x,y\n0,1,2", {"z": POINT, "y": "bloc.angle"},
         ["no column 'z'", "y: the scene has no quantity 'bloc.angle'; did you mean"]),
        ("t,x,y\n0,1,2", {"x": POINT, "y": POINT}, [f"'{POINT}' is another column already"]),
        ("t,a\n0,1\n1,2", None, ["no column is named as a quantity", "'t', 'a'"]),
        ("", None, ["no rows of two numbers"]),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_file(text, columns, words, tmp_path):
    with pytest.raises(SceneError) as raised:
        series(text, tmp_path, columns)
    for each in words:
        assert each in str(raised.value)


def test_tables_of_a_run_are_series_of_it(rigid, tmp_path):
    """The run is its own measurement, but for the digits of the file."""
    for columns in (trajectory_columns(rigid, "link.end"), lever_columns(rigid, "strike")):
        write_csv(tmp_path / "own.csv", columns)
        found = against(rigid, read_series(rigid.scene, tmp_path / "own.csv"))
        assert len(found.measured) == (2 if "x_m" in columns else 1)
        for own in found.distances:
            assert own.largest < 1e-9 * own.span


def test_every_quantity_of_a_flexible_scene_has_values_in_its_unit(rigid):
    time = np.array([0.1, 0.2])
    for name, signal in signals(rigid.scene).items():
        assert signal.at(rigid, time).shape == (2,)
        assert (signal.dimension is Dimension.ANGLE) == (
            name.endswith((".angle", "lever.response"))
        )
    crank = signals(rigid.scene)["guide.angle"].at(rigid, time)
    assert np.diff(crank) == pytest.approx([1.0])  # 10 rad/s


def test_a_table_has_rows():
    with pytest.raises(SceneError, match="one length, and a row or more"):
        read_series(RUN.scene, {"t": [], POINT: []})


@pytest.mark.parametrize("shift", [0.1234567, -0.3, 0.0])
def test_a_shift_is_found(shift):
    time = np.linspace(0.5, 2.5, 121)
    measured = read_series(RUN.scene, {"t": time, POINT: OFF + fades(time + shift)})
    found = against(RUN, measured, "find")
    assert found.shift == pytest.approx(shift, abs=1e-7)
    assert found.distances[0].largest < 1e-6


def test_distances_of_a_known_offset():
    time = np.linspace(0, 5, 501)
    offset = 0.01 + 0.02 * (time == 2.0)
    measured = read_series(RUN.scene, {"t": time, POINT: OFF + fades(time) - offset})
    found = against(RUN, measured)
    (own,) = found.distances
    assert (own.largest, own.at) == (pytest.approx(0.03, rel=1e-5), pytest.approx(2.0))
    assert own.rms == pytest.approx(np.sqrt((400 * 0.01**2 + 0.03**2) / 401), rel=1e-5)
    assert found.outside == 100
    parted = replace(RUN, error=MeasuredError(("a",), horizon=1.5, limit=1e-6, largest=1e-7))
    assert against(parted, measured).distances[0].largest == pytest.approx(0.01, rel=1e-5)


def test_no_overlap():
    late = read_series(RUN.scene, {"t": [7.0, 8.0], POINT: [0.0, 0.1]})
    with pytest.raises(NoOverlapError, match=r"from 0 to 4 s, the rows from 7 to 8 s"):
        against(RUN, late)
    assert against(RUN, late, -5.0).time == pytest.approx([2, 3])


def test_from_python():
    run = fl.load(save_run("a"))
    time = np.linspace(0, 2, 41)
    found = fl.compare(run, {"t": time, "x": OFF + fades(time + 0.2)}, columns={"x": POINT},
                       shift="200 ms")  # fmt: skip
    assert repr(found).startswith(f"<Comparison of exudyn and the table: apart by rms {POINT} ")
    assert "0.2 s are added to times of the series" in found.summary()
    (both, below) = found.plot().axes
    assert both.lines[0].get_ydata() == pytest.approx(1e3 * (OFF + fades(time + 0.2)))
    assert "difference" in below.get_ylabel()
    for wrong in ({"names": ("a", "b")}, {"shift": "soon"}):
        with pytest.raises(ValueError, match=r"'names' are|shift: expected find or a time,"):
            fl.compare(run, {"t": time, POINT: time}, **wrong)
    with pytest.raises(ValueError, match="'columns' and 'shift' are for a measured series"):
        fl.compare(run, run, shift=0.1)


def test_fit_from_python():
    scene = fl.load_scene(DATA / "fit_A.yaml", ["springs.s.stiffness=3.2"], tolerance=1e-6)
    found = fl.fit(scene, DATA / "fit_A.csv", {"theta": "lever.angle"}, vary="springs.s.damping")
    assert repr(found).startswith("<Fit to fit_A.csv: springs.s.damping 0.024")
    assert isinstance(found.scene, fl.Scene)
    assert "0.02411" in found.summary()
    assert "residual" in found.plot().axes[1].get_ylabel()
    assert found.save("here").joinpath("residuals.csv").exists()


# --- the command line


def save_run(name, run=RUN):
    results.put(run, name)
    return name


def test_saved_runs_are_compared(capsys):
    save_run("pendulum")  # which a model is called, too
    save_run("b", block(lambda t: fades(t) + 1e-3, lambda t: 0 * t, samples=801, end=4.0))
    assert code_of("compare", "pendulum", "b", "--no-plots", "--tolerance", "1e-4") == 1
    told = capsys.readouterr()
    assert "Comparison of pendulum and b" in told.out
    assert "deviates by 0.001 m" in told.err
    assert "runs/pendulum-compare-b/" in told.out


def test_measurements_are_compared(tmp_path, capsys):
    save_run("a")
    time = np.linspace(0, 3, 61)
    write_csv(tmp_path / "m.csv", {"t (s)": time, "where (mm)": 1e3 * (OFF + fades(time + 0.5))})
    columns = ["--column", f"where={POINT}"]
    assert code_of("compare", "a", "m.csv", *columns, "--shift", "find") == 0
    assert "0.5 s are added" in capsys.readouterr().out
    assert {path.name for path in tmp_path.glob("runs/a-compare-m/*")} == {
        *("comparison.json", "comparison.csv", "comparison.png", "manifest.json")
    }


def test_fit_on_the_command_line(tmp_path, capsys):
    data = [str(DATA / f"fit_A.{ending}") for ending in ("yaml", "csv")]
    more = ["--set", "springs.s.stiffness=3.2", "--set", "accuracy.tolerance=1e-6"]
    vary = ["--column", "theta=lever.angle", "--vary", "springs.s.damping=0.01:0.05"]
    assert code_of("fit", *data, *vary, *more) == 0
    told = capsys.readouterr().out
    assert "0.0241" in told
    assert "--set=springs.s.damping=0.0241" in told
    (folder,) = (tmp_path / "runs").iterdir()
    names = {path.name for path in folder.iterdir()}
    assert names == {"fit.json", "residuals.csv", "fit.png", "manifest.json"}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["compare", "a"], "'a' is a folder: give what to compare it with"),
        (["compare", "a", "none.csv"], "can't read the file: No such file"),
        (["compare", "a", "m.csv", "--set", "run.turns=1"], "'--set' is for models"),
        (["compare", "clearance", "m.csv"], "with 'm.csv' goes the folder of a saved run"),
        (["compare", "a", "a", "--shift", "1"], "'--column' and '--shift' are for a CSV file"),
        (["compare", "clearance", "--shift", "1"], "need a run and a CSV file"),
        (["compare", "a", "m.csv", "--tolerance", "1"], "'--tolerance' is for two runs"),
        (["compare", "a", "m.csv", "--column", "x"], "expected NAME=QUANTITY"),
        (
            ["compare", "a", "m.csv", "--shift", "1 kg"],
            "expected a time, such as 1.5 (s) or '20 ms', got '1 kg'",
        ),
        (["compare", "a", "m.csv", "--shift", "90"], "no row of m.csv lies within the run"),
        (["fit", "rigid", "m.csv", "--column", "x=link.end.x"], "nothing is varied"),
    ],
)
def test_refused(arguments, words, tmp_path, capsys):
    save_run("a")
    write_csv(tmp_path / "m.csv", {"t": [0.0, 1.0], "x": [0.0, 1.0], POINT: [0.0, 1.0]})
    assert code_of(*arguments) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "runs").exists()


# --- series of a wrong clock, and files that are no table of one ----------------------------------


def test_rows_outside_the_run_are_told_and_too_few_inside_refused():
    """A clock in ms that says s: one row of many would agree by chance."""
    time = np.linspace(0, 40, 81)
    near = {"t": time, POINT: OFF + fades(time)}
    run = fl.load(save_run("a"))
    found = fl.compare(run, near)
    assert "72 of 81 rows are outside the run" in repr(found)
    assert "outside the run 72 of 81 rows" in " ".join(found.summary().split())
    with pytest.raises(ValueError, match=r"only 1 of 81 rows(.|\n)*'t \(ms\)'; '--shift'"):
        fl.compare(run, {"t": 1e3 * time, POINT: OFF + fades(time)})


def test_masked_values_and_columns_of_one_name_are_no_data():
    pandas = pytest.importorskip("pandas")
    run, time = fl.load(save_run("a")), np.linspace(0, 2, 21)
    masked = np.ma.masked_array(fades(time), np.arange(21) == 3)
    with pytest.raises(SceneError, match=r"row 4, .*expected a finite number, got 'nan'"):
        fl.compare(run, {"t": time, POINT: masked})
    twice = pandas.DataFrame(np.c_[time, time, time], columns=["t", POINT, POINT])
    with pytest.raises(ValueError, match=f"two columns are named '{POINT}'"):
        fl.compare(run, twice)


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"PK\x03\x04\xff", "a workbook of Excel, or another zip file: save it as 'CSV UTF-8'"),
        (b"\x1f\x8b\x08\x00\xff", "packed by gzip: unpack it first"),
        ("t,x\n0,1\n".encode("utf-16"), "text in UTF-16: save it as"),
        ("t,x\n0,1\n1,2\n# 20 °C\n".encode("latin-1"), r"such as Latin-1 \(line 4\)"),
        (b"Model,TBS1102\nRecord Length,201\nTIME,CH1\n0,1\n1,2\n", "line 3: 'TIME, CH1'"),
        (b"t,x\n2026-11-28T10:00:00,1\n2026-11-28T10:00:01,2\n", "is a date or a time of day"),
    ],
)
def test_a_file_that_is_no_table_says_what_it_is(data, words, tmp_path):
    (tmp_path / "m.csv").write_bytes(data)
    with pytest.raises((SceneError, fl.SceneError), match=words):
        read_series(RUN.scene, tmp_path / "m.csv", {"x": POINT})


def test_tables_of_other_programs_get_hints():
    run, time = fl.load(save_run("a")), np.linspace(0, 2, 21)
    with pytest.raises(TypeError, match=r"'x': data\['x'\]\[:, 0\]"):
        fl.compare(run, {"t": time, POINT: np.stack([fades(time), fades(time)], axis=1)})
    with pytest.raises(SceneError, match="reset_index"):
        fl.compare(run, {POINT: fades(time)})
    with pytest.raises(ValueError, match="'--shift', in Python shift="):
        fl.compare(run, {"t": 1.7e9 + time, POINT: fades(time)})


def test_what_loadmat_gives_is_read_by_the_columns_that_are_named(tmp_path):
    """MATLAB has matrices alone, notes on the file, and variables that are none of the series."""
    run, time = fl.load(save_run("a")), np.linspace(0, 2, 21)
    stored = {"t": time, "x": fades(time)[:, None], "gain": 3.0, "note": "a lever"}
    savemat(tmp_path / "m.mat", stored)
    found = fl.compare(run, loadmat(tmp_path / "m.mat"), columns={"x": POINT})
    plain = fl.compare(run, {"t": time, POINT: fades(time)})
    np.testing.assert_array_equal(found.series.time, time)
    assert found.distances[0].rms == plain.distances[0].rms
