"""GIF and video: their frames show the run; what can't be written is said."""

import json
import shutil
import subprocess
from io import BytesIO

import numpy as np
import pytest
import results
from matplotlib.colors import to_rgb
from PIL import Image

from exudyn_flexlink.animation import Filming, film_bytes, film_of, is_animation
from exudyn_flexlink.animation.picture import Picture
from exudyn_flexlink.animation.shots import frames_of
from exudyn_flexlink.plots.frame import BLACK, BLUE

FFPROBE = shutil.which("ffprobe") if shutil.which("ffmpeg") else None
needs_ffmpeg = pytest.mark.skipif(FFPROBE is None, reason="no ffmpeg on the path")
WHITE = (255, 255, 255)


@pytest.fixture(scope="module")
def run():
    return results.rigid_link(turns=2.0, samples=401)


def rgb(colour):
    return np.array([round(255 * part) for part in to_rgb(colour)])


def pixel(picture, shown, place):
    """Colour of a frame at a place in m."""
    x, y = picture.axes.transData.transform(place)
    return shown[picture.height - 1 - int(y), int(x), :3].astype(int)


def test_a_frame_has_everything_where_it_is(run):
    film = film_of(run)
    picture = Picture(film, frames_of(film, 10, 0.2), 800)
    times = picture._frames.times
    for frame in (5, 17, len(picture) - 3):
        shown = picture.frame(frame)
        assert shown.shape == (picture.height, picture.width, 4)
        theta = results.SPEED * times[frame]
        along = np.array([np.cos(theta), np.sin(theta)])
        [s] = results.exact_s(run.scene, times[frame : frame + 1])
        p = s - results.LENGTH * along
        assert pixel(picture, shown, s) == pytest.approx(rgb(BLACK), abs=8)
        assert pixel(picture, shown, p) == pytest.approx(WHITE, abs=8)
        assert pixel(picture, shown, p + 0.052 * along) == pytest.approx(rgb(BLUE), abs=8)
        assert pixel(picture, shown, [-0.13, 0.09]) == pytest.approx(WHITE, abs=8)


def test_a_gif_has_its_frames_its_time_and_few_colours(run):
    film = film_of(run, window=(0.28, 0.33))
    made = film_bytes(film, "gif", Filming(fps=20, speed=0.1, width=320))
    assert is_animation(made)
    with Image.open(BytesIO(made)) as image:
        assert image.n_frames == 11
        assert image.info["duration"] == 50
        assert image.info["loop"] == 0
        assert image.size[0] == 320
        first = np.asarray(image.convert("RGB"))
        image.seek(10)
        later = np.asarray(image.convert("RGB"))
    assert tuple(first[60, 5]) == WHITE
    assert np.any(first != later)


@needs_ffmpeg
def test_a_video_has_its_frames_and_shows_the_run(run, tmp_path):
    film = film_of(run, window=(0.25, 0.35))
    made = film_bytes(film, "mp4", Filming(fps=25, speed=0.1, width=321))
    assert is_animation(made)
    file = tmp_path / "film.mp4"
    file.write_bytes(made)
    asked = "stream=width,height,nb_frames,r_frame_rate,pix_fmt"
    told = subprocess.run(
        [FFPROBE, "-v", "error", "-show_entries", asked, "-of", "json", file],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    [stream] = json.loads(told.stdout)["streams"]
    assert (stream["width"], stream["height"] % 2) == (320, 0)
    assert (stream["nb_frames"], stream["r_frame_rate"]) == ("26", "25/1")
    assert stream["pix_fmt"] == "yuv420p"  # which every player knows
