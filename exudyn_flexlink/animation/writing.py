"""Films as files: a GIF, a video by ffmpeg, and a player as HTML.

A GIF has few colours, but every page can show it. The player is one text of data, style and
program, and loads nothing. Its data are names and short lists as JSON, and long rows of numbers
as base64, little-endian: ``f4`` and ``f8`` are floats of 32 and 64 bits, ``i4`` integers of 32
bits. `player/film.js` reads them. Units are m, s and N, and N m for torques of stops.
"""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from html import escape
from importlib import import_module
from importlib.resources import files
from io import BytesIO
from math import inf, isfinite
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from PIL import Image

from exudyn_flexlink.animation.film import (
    Film,
    FilmError,
    Take,
    Touching,
    Zoom,
    strength,
    touching_of,
    zooms_of,
)
from exudyn_flexlink.animation.picture import Picture, Pixels, look_data
from exudyn_flexlink.animation.shots import SLOW_SECONDS, frames_of, kept_instants, usual_speed
from exudyn_flexlink.arrays import FloatArray
from exudyn_flexlink.mechanism import Anchor
from exudyn_flexlink.observables import turns
from exudyn_flexlink.plots.outline import Drawn, Line, Mark, through
from exudyn_flexlink.plots.panels import length_unit
from exudyn_flexlink.shipped import FILM_FORMATS

GENERATOR = "exudyn-flexlink animation"
"""Mark in files that this program wrote."""

_PROGRAM = ("film", "drawing", "zoom", "guide", "timeline", "controls", "begin")
"""Files of the player's program, in order."""


def player(film: Film, speed: float | None = None) -> str:
    """Return the player of a film as a fragment of HTML, a ``<div>``.

    A page may have several players. The style applies only to the player's class,
    ``flexlink-player``. The player is as wide as the element around it, and as light or dark as the
    page. It loads nothing. It starts when the reader asks for it, at `speed`, s of the run per
    second (by default `usual_speed`).
    """
    return _fragment(film, speed, at_once=False)


def page(film: Film, speed: float | None = None) -> str:
    """Return a whole page with the player of a film; the player starts at once."""
    title = escape(film.takes[-1].result.scene.title)
    first_part = _fragment(film, speed, at_once=True)
    return _packaged_file("page.html").format(generator=GENERATOR, title=title, player=first_part)


def _fragment(film: Film, speed: float | None, *, at_once: bool) -> str:
    data = {**film_data(film, speed), "at_once": at_once}
    # A '<' in the data, for instance in '</script>', must not end the data.
    text = json.dumps(data, ensure_ascii=False, separators=(",", ":")).replace("<", "\\u003c")
    return (
        '<div class="flexlink-player">\n'
        f"<style>\n{_packaged_file('player.css')}</style>\n"
        "<noscript>This animation needs JavaScript.</noscript>\n"
        f'<script type="application/json">{text}</script>\n'
        f"<script>\n{_program()}</script>\n"
        "</div>"
    )


def _program() -> str:
    """Return the player's program; it finds the data beside it and adds no names to the page."""
    program = "\n".join(_packaged_file(f"{name}.js") for name in _PROGRAM)
    look = json.dumps(look_data())
    return f'(function () {{\n"use strict";\n\nconst LOOK = {look};\n\n{program}\n}})();\n'


def _packaged_file(name: str) -> str:
    return (files(__package__) / "player" / name).read_text(encoding="utf-8")


def film_data(film: Film, speed: float | None = None) -> dict[str, Any]:
    """Return the player's data of a film; it starts with `speed`, s of the run per second."""
    low, high = film.box
    factor, unit = length_unit(film.size)
    beyond = film.horizon
    return {
        "title": film.takes[-1].result.scene.title,
        "box": [*low.tolist(), *high.tolist()],
        "begin": film.begin,
        "end": film.end,
        "speed": speed or usual_speed(film),
        "unit": {"factor": factor, "name": unit},
        "horizon": None if beyond is None else {"from": beyond[0], "words": beyond[1]},
        "doubts": film.doubts,
        "slow_seconds": SLOW_SECONDS,
        "slow": film.slow,
        "strikes": film.strikes,
        "takes": [_take(film, take) for take in film.takes],
    }


def row(values: ArrayLike, kind: str = "f4") -> dict[str, str]:
    """Return numbers, in the order of their memory, as text."""
    packed = np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()
    return {kind: base64.b64encode(packed).decode("ascii")}


def _take(film: Film, take: Take) -> dict[str, Any]:
    times, _ = kept_instants(film, take)
    crank = take.crank(times)
    lines = [
        {
            "kind": drawn.kind,
            "colour": drawn.colour,
            "spans": _spans(take, drawn),
            **_line(drawn.line),
        }
        for drawn in take.lines
    ]
    return {
        "name": take.name,
        "colour": take.colour,
        "parts": len(take.model.parts),
        "time": row(times, "f8"),
        "poses": row(take.poses(times)),
        "crank": None if crank is None else row(crank, "f8"),
        "turns": turns(take.result),
        "lines": lines,
        "marks": [
            {"kind": mark.kind, "spans": _spans(take, mark), **_anchor(mark.anchor)}
            for mark in take.marks
        ],
        "points": {name: _anchor(anchor) for name, anchor in take.named.items()},
        "touching": [_touching(take, touching, times) for touching in touching_of(film, take)],
        "zooms": [_zoom(zoom) for zoom in zooms_of(film, take)],
    }


def _spans(take: Take, thing: Drawn | Mark) -> list[list[float | None]]:
    """Return the begins and ends (s) of the spans in which a line or mark exists; None: no end."""
    return [[t if isfinite(t) else None for t in span] for span in take.spans(thing)]


def _line(line: Line) -> dict[str, Any]:
    """Return the data of a line; the part's number comes once if all points are on one part."""
    alike = len(set(line.parts.tolist())) == 1
    parts = int(line.parts[0]) if alike else row(line.parts, "i4")
    return {"name": line.name, "parts": parts, "places": row(line.places)}


def _anchor(anchor: Anchor) -> dict[str, Any]:
    return {"part": anchor.part, "x": anchor.x, "y": anchor.y}


def _touching(take: Take, touching: Touching, times: FloatArray) -> dict[str, Any]:
    """Return touches as columns, and the forces at the kept instants in one row.

    Forces at instant i are entries ``first[i]`` to ``first[i + 1]`` of ``pair`` and ``force``.
    """
    touches = touching.touches
    force = touching.forces(take, times)
    instant, pair = np.nonzero(force > 0)
    return {
        "name": touching.name,
        "unit": touching.unit,
        "begin": row(touches.begin, "f8"),
        "end": row(touches.until(float(take.result.time[-1])), "f8"),
        "strength": row(strength(touches)),
        "which": row(touches.pair, "i4"),
        "first": row(np.searchsorted(instant, np.arange(len(times) + 1)), "i4"),
        "pair": row(pair, "i4"),
        "force": row(force[instant, pair]),
        "places": None if touching.places is None else _line(touching.places),
        "spots": None if touching.places is not None else row(touching.spots(take, times)[:, 0]),
    }


def _zoom(zoom: Zoom) -> dict[str, Any]:
    """Return the data of a zoom; a guide also has its walls, link nodes, and sides of the pairs."""
    channel = zoom.channel
    guide = None if channel is None else {
        "length": channel.length,
        "clearance": channel.clearance,
        "link": _line(through(channel.name, *channel.nodes)),
        "sides": list(channel.sides),
    }  # fmt: skip
    return {
        "name": zoom.name,
        "words": zoom.words,
        "view": {**_anchor(zoom.view.origin), "angle": zoom.view.angle},
        "along": list(zoom.along),
        "across": list(zoom.across),
        "guide": guide,
        "point": None if zoom.point is None else {"name": zoom.point_name, **_anchor(zoom.point)},
    }


Progress = Callable[[float], None]

GIF_FPS, VIDEO_FPS = 20.0, 30.0
GIF_WIDTH, VIDEO_WIDTH = 640, 1280
GIF_TICK = 0.01  # s: unit of time of a GIF's frames
PALETTE_FRAMES = 24  # number of frames from which the palette is made
MOST_PIXELS = 600_000_000  # of all frames of a GIF: all are in memory until it is written
MOST_FPS = {"mp4": 240.0, "gif": 50.0}  # players show a GIF's frame for at least 0.02 s
LEAST_WIDTH, MOST_WIDTH = 160, 4096
NO_FFMPEG = (
    "a video needs the program ffmpeg, which is not on the path; install it, or the Python package "
    "imageio-ffmpeg, or write a GIF or a page"
)
COLOURS = 128  # colours of a GIF: more would be invisible, and take room


@dataclass(frozen=True)
class Filming:
    """Options of a film's file; None is the format's usual value.

    Pictures have `fps` frames per second and a `width` in pixels; `speed` is in s of the run per
    second.
    """

    fps: float | None = None
    speed: float | None = None
    width: int | None = None

    def mistakes(self, suffix: str) -> list[str]:
        """Say which options a format can't have; `suffix` is the ending of its files."""
        most = MOST_FPS.get(suffix, inf)
        texts = []
        if self.fps is not None and not 0 < self.fps <= most:
            texts.append(f"{self.fps:g} frames in a second: a {suffix.upper()} has up to {most:g}")
        if self.width is not None and not LEAST_WIDTH <= self.width <= MOST_WIDTH:
            texts.append(f"{self.width} pixels: a width is from {LEAST_WIDTH} to {MOST_WIDTH}")
        if self.speed is not None and not 0 < self.speed < inf:
            texts.append(f"a speed of {self.speed:g}: it is a number of more than 0")
        if suffix == "mp4" and ffmpeg() is None:
            texts.append(NO_FFMPEG)
        return texts


def film_bytes(
    film: Film, suffix: str, filming: Filming, progress: Progress | None = None
) -> bytes:
    """Return a film as the content of a file: ``"mp4"``, ``"gif"`` or ``"html"``.

    Raises:
        FilmError: there is no such format, an option does not suit it, the film is too long, or
            ffmpeg failed.

    """
    if suffix not in FILM_FORMATS:
        raise FilmError(f"no format '{suffix}'; there is: {', '.join(FILM_FORMATS)}")
    if mistakes := filming.mistakes(suffix):
        raise FilmError("\n".join(mistakes))
    if suffix == "html":
        return page(film, filming.speed).encode("utf-8")
    if suffix == "gif":  # a frame of a GIF lasts a whole number of ticks
        ticks = round(1 / (filming.fps or GIF_FPS) / GIF_TICK)
        fps, width = 1 / (ticks * GIF_TICK), filming.width or GIF_WIDTH
    else:
        fps, width = filming.fps or VIDEO_FPS, filming.width or VIDEO_WIDTH
    frames = frames_of(film, fps, filming.speed or usual_speed(film))
    if suffix == "gif" and len(frames.times) * width**2 > MOST_PIXELS:
        raise FilmError(
            f"too long for a GIF: {len(frames.times)} frames; show a part of the run, or play it "
            "faster, with fewer frames in a second, narrower, or as a video"
        )
    picture = Picture(film, frames, width)
    return (_gif if suffix == "gif" else _video)(picture, fps, _with_progress(picture, progress))


def usual_formats() -> tuple[str, ...]:
    """Return the default formats: a page, and a video, or a GIF if ffmpeg is missing."""
    return ("gif" if ffmpeg() is None else "mp4", "html")


def is_animation(content: bytes) -> bool:
    """Whether the content of a file is an animation that this program wrote."""
    return GENERATOR.encode() in content


def _gif(picture: Picture, fps: float, frames: Iterator[Pixels]) -> bytes:
    """Return a film as the content of a GIF, which repeats."""
    chosen = np.unique(np.linspace(0, len(picture) - 1, PALETTE_FRAMES).astype(int))
    palette = _palette([picture.frame(int(i))[..., :3] for i in chosen])
    images = (
        Image.fromarray(picture[..., :3]).quantize(palette=palette, dither=Image.Dither.NONE)
        for picture in frames
    )
    written = BytesIO()
    next(images).save(
        written, format="GIF", save_all=True, append_images=images, loop=0,
        duration=round(1000 / fps), optimize=False, comment=GENERATOR.encode(),
    )  # fmt: skip
    return written.getvalue()


def _palette(frames: list[Pixels]) -> Image.Image:
    """Return an image with the most frequent colours of some frames; greys stay grey."""
    red, green, blue = np.concatenate(frames).astype(np.intp).reshape(-1, 3).T >> 3
    most = np.argsort(-np.bincount(red << 10 | green << 5 | blue), kind="stable")[:COLOURS]
    colours = np.stack([most >> 10, most >> 5 & 31, most & 31], axis=1) * 255 // 31
    palette = Image.new("P", (1, 1))
    palette.putpalette(colours.astype(np.uint8).tobytes())
    return palette


def _video(picture: Picture, fps: float, frames: Iterator[Pixels]) -> bytes:
    """Return a film as the content of an MP4."""
    program = ffmpeg()
    assert program is not None  # `Filming.mistakes` has checked this
    with TemporaryDirectory() as folder:
        file, log = Path(folder) / "film.mp4", Path(folder) / "errors.txt"
        size = f"{picture.width}x{picture.height}"
        command = [
            program, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgba",
            "-s", size, "-r", f"{fps:g}", "-i", "-", "-an", "-pix_fmt", "yuv420p",
            "-movflags", "+faststart", "-metadata", f"comment={GENERATOR}", str(file),
        ]  # fmt: skip
        with log.open("wb") as errors:
            code = _pipe(command, errors.fileno(), frames)
        if code or not file.exists() or not file.stat().st_size:
            reason = log.read_text(encoding="utf-8", errors="replace").strip()
            raise FilmError(f"ffmpeg made no video: {reason or 'it did not say why'}")
        return file.read_bytes()


def ffmpeg() -> str | None:
    """Return the path of ffmpeg: from the path, else from imageio-ffmpeg; None if missing."""
    path = shutil.which("ffmpeg")
    if path is not None:
        return path
    try:
        return str(import_module("imageio_ffmpeg").get_ffmpeg_exe())
    except (ImportError, RuntimeError):  # not installed, or installed without its program
        return None


def _pipe(command: list[str], errors: int, frames: Iterator[Pixels]) -> int:
    """Pipe frames to a program; it may end before the last frame. Return its exit code."""
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=errors
    ) as program:
        assert program.stdin is not None
        try:
            for frame in frames:
                program.stdin.write(frame.data)
        except BrokenPipeError:
            pass  # the program has ended; its messages tell why
        except BaseException:
            program.kill()
            raise
        finally:
            with suppress(BrokenPipeError):
                program.stdin.close()
    return program.returncode


def _with_progress(picture: Picture, progress: Progress | None) -> Iterator[Pixels]:
    """Yield the frames in order; `progress` receives the part that is done."""
    for frame in range(len(picture)):
        yield picture.frame(frame)
        if progress is not None:
            progress((frame + 1) / len(picture))
