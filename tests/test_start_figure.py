"""`check --figure`: a model where it starts, drawn with its names."""

import pytest
from matplotlib.text import Annotation
from matplotlib.transforms import Bbox

from exudyn_flexlink.cli import main
from exudyn_flexlink.loading import assemble_scene, load_scene
from exudyn_flexlink.plots import start
from exudyn_flexlink.shipped import model_file

MODELS = (
    *("no_clearance", "clearance", "whitworth", "geneva_wheel", "toggle_press"),
    *("welded_cantilever", "andrews_squeezer", "pump", "spin_up_beam"),
)
CLEAR = {"no_clearance", "clearance", "pump", "whitworth"}  # their names lie on no symbol


def drawn(name):
    file = model_file(name)
    assert file is not None
    scene = load_scene(file)
    return scene, start(scene, assemble_scene(scene)).axes[0]


@pytest.mark.parametrize("name", MODELS)
def test_every_body_is_named_within_the_figure(name):
    """And on no symbol: names of the short lever's ends once lay on those of its pivot."""
    scene, axes = drawn(name)
    axes.figure.draw_without_rendering()
    told = [text for text in axes.texts if isinstance(text, Annotation)]
    assert set(scene.bodies) <= {text.get_text() for text in told}
    whole = Bbox([[0, 0], axes.figure.bbox.size])
    symbols = [line for line in axes.lines if line.get_linestyle() == "None"]
    places = [axes.transData.transform(line.get_xydata())[0] for line in symbols]
    radius = 3.0 * axes.figure.dpi / 72  # points
    for text in axes.texts:
        box = text.get_window_extent()
        assert whole.x0 <= box.x0 < box.x1 <= whole.x1, text.get_text()
        assert whole.y0 <= box.y0 < box.y1 <= whole.y1, text.get_text()
        on = [place for place in places if box.padded(radius).contains(*place)]
        assert not on or name not in CLEAR, text.get_text()


def test_symbols_are_those_of_the_parts():
    """Rods that stretch are no joints or springs of the scene."""
    told, of_rods = (
        [text.get_text() for text in drawn(name)[1].get_legend().get_texts()]
        for name in ("no_clearance", "spin_up_beam")
    )
    assert told == ["guide", "link", "lever", "track", "revolute, on the ground", "in a slot",
                    "torsional spring", "drive", "point that may strike",
                    "face of a contact"]  # fmt: skip
    assert not {*of_rods} & {"prismatic", "linear spring"}


def test_a_drive_along_a_line_is_drawn_where_its_point_is():
    _, axes = drawn("driven_trammel")
    (drive,) = [line for line in axes.lines if line.get_marker() == r"$\circlearrowleft$"]
    (x,), (y,) = drive.get_xdata(), drive.get_ydata()
    assert (x, y) == pytest.approx((100, 0), abs=1e-6)  # mm: 0.1 m out, as its value at t = 0 says


def test_the_figure_is_written_in_the_format_of_its_name(tmp_path, capsys):
    """Of png a page of the documentation has a command, which is tried, too."""
    assert main(["check", "scotch_yoke", "--figure", str(tmp_path / "start.pdf")]) == 0
    assert (tmp_path / "start.pdf").read_bytes().startswith(b"%PDF")
    assert "no mistakes" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        main(["check", "scotch_yoke", "--figure", str(tmp_path / "start.jpeg")])
    assert "does not end in one of .png, .pdf, .svg" in capsys.readouterr().err
