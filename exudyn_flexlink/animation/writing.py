"""Films to files: a GIF in few colours, which every page shows, and a video with ffmpeg."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from importlib import import_module
from io import BytesIO
from math import inf
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

from exudyn_flexlink.animation.film import Film, FilmError
from exudyn_flexlink.animation.html import GENERATOR, page
from exudyn_flexlink.animation.picture import Picture, Pixels
from exudyn_flexlink.animation.shots import frames_of, usual_speed

Progress = Callable[[float], None]

GIF_FPS, VIDEO_FPS = 20.0, 30.0
GIF_WIDTH, VIDEO_WIDTH = 640, 1280
GIF_TICK = 0.01  # s: the time that a frame of a GIF is shown counts in these
LOOKED_AT = 24  # frames that the colours are taken from
MOST_PIXELS = 600_000_000  # of a GIF, whose frames are kept until it is written
FORMATS = ("mp4", "gif", "html")
MOST_FPS = {"mp4": 240.0, "gif": 50.0}  # players show frames of a GIF for 0.02 s at least
LEAST_WIDTH, MOST_WIDTH = 160, 4096
NO_FFMPEG = (
    "a video needs the program ffmpeg, which is not on the path; install it, or the Python package "
    "imageio-ffmpeg, or write a GIF or a page"
)
COLOURS = 128  # of a GIF: more are not seen, and take room


@dataclass(frozen=True)
class Filming:
    """How a film is written: None is what suits the format.

    `fps` frames in a second and `width` pixels, of pictures; `speed`, s of the run in a second.
    """

    fps: float | None = None
    speed: float | None = None
    width: int | None = None

    def mistakes(self, suffix: str) -> list[str]:
        """Say what can't be in a format, by the ending of its files."""
        most = MOST_FPS.get(suffix, inf)
        told = []
        if self.fps is not None and not 0 < self.fps <= most:
            told.append(f"{self.fps:g} frames in a second: a {suffix.upper()} has up to {most:g}")
        if self.width is not None and not LEAST_WIDTH <= self.width <= MOST_WIDTH:
            told.append(f"{self.width} pixels: a width is from {LEAST_WIDTH} to {MOST_WIDTH}")
        if self.speed is not None and not 0 < self.speed < inf:
            told.append(f"a speed of {self.speed:g}: it is a number of more than 0")
        if suffix == "mp4" and ffmpeg() is None:
            told.append(NO_FFMPEG)
        return told


def film_bytes(
    film: Film, suffix: str, filming: Filming, progress: Progress | None = None
) -> bytes:
    """Return a film as the content of a file: ``"mp4"``, ``"gif"`` or ``"html"``.

    Raises:
        FilmError: there is no such format, it can't be written so, is too long, or ffmpeg failed.

    """
    if suffix not in FORMATS:
        raise FilmError(f"no format '{suffix}'; there is: {', '.join(FORMATS)}")
    if mistakes := filming.mistakes(suffix):
        raise FilmError("\n".join(mistakes))
    if suffix == "html":
        return page(film, filming.speed).encode("utf-8")
    if suffix == "gif":  # whose frames last a whole number of ticks
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
    return (_gif if suffix == "gif" else _video)(picture, fps, _counted(picture, progress))


def usual_formats() -> tuple[str, ...]:
    """Formats where none is asked for: a video, or without ffmpeg a GIF; and a page."""
    return ("gif" if ffmpeg() is None else "mp4", "html")


def is_animation(content: bytes) -> bool:
    """Whether the content of a file is an animation that this program wrote."""
    return GENERATOR.encode() in content


def _gif(picture: Picture, fps: float, frames: Iterator[Pixels]) -> bytes:
    """Return a film as the content of a GIF that repeats."""
    chosen = np.unique(np.linspace(0, len(picture) - 1, LOOKED_AT).astype(int))
    palette = _palette([picture.frame(int(i))[..., :3] for i in chosen])
    images = (
        Image.fromarray(own[..., :3]).quantize(palette=palette, dither=Image.Dither.NONE)
        for own in frames
    )
    written = BytesIO()
    next(images).save(
        written, format="GIF", save_all=True, append_images=images, loop=0,
        duration=round(1000 / fps), optimize=False, comment=GENERATOR.encode(),
    )  # fmt: skip
    return written.getvalue()


def _palette(frames: list[Pixels]) -> Image.Image:
    """Return an image with the colours that are most frequent in some frames; greys stay grey."""
    red, green, blue = np.concatenate(frames).astype(np.intp).reshape(-1, 3).T >> 3
    most = np.argsort(-np.bincount(red << 10 | green << 5 | blue), kind="stable")[:COLOURS]
    colours = np.stack([most >> 10, most >> 5 & 31, most & 31], axis=1) * 255 // 31
    palette = Image.new("P", (1, 1))
    palette.putpalette(colours.astype(np.uint8).tobytes())
    return palette


def _video(picture: Picture, fps: float, frames: Iterator[Pixels]) -> bytes:
    """Return a film as the content of an MP4."""
    program = ffmpeg()
    assert program is not None  # see `Filming.mistakes`
    with TemporaryDirectory() as folder:
        file, told = Path(folder) / "film.mp4", Path(folder) / "told.txt"
        size = f"{picture.width}x{picture.height}"
        command = [
            program, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", "rgba",
            "-s", size, "-r", f"{fps:g}", "-i", "-", "-an", "-pix_fmt", "yuv420p",
            "-movflags", "+faststart", "-metadata", f"comment={GENERATOR}", str(file),
        ]  # fmt: skip
        with told.open("wb") as errors:
            code = _pipe(command, errors.fileno(), frames)
        if code or not file.exists() or not file.stat().st_size:
            reason = told.read_text(encoding="utf-8", errors="replace").strip()
            raise FilmError(f"ffmpeg made no video: {reason or 'it did not say why'}")
        return file.read_bytes()


def ffmpeg() -> str | None:
    """Return the program ffmpeg: that on the path, else that of imageio-ffmpeg; None without."""
    found = shutil.which("ffmpeg")
    if found is not None:
        return found
    try:
        return str(import_module("imageio_ffmpeg").get_ffmpeg_exe())
    except (ImportError, RuntimeError):  # not installed; installed without its program
        return None


def _pipe(command: list[str], errors: int, frames: Iterator[Pixels]) -> int:
    """Hand frames to a program, which ends with them, or before; return its exit code."""
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=errors
    ) as program:
        assert program.stdin is not None
        try:
            for own in frames:
                program.stdin.write(own.data)
        except BrokenPipeError:
            pass  # it has ended: what it says tells why
        except BaseException:
            program.kill()
            raise
        finally:
            with suppress(BrokenPipeError):
                program.stdin.close()
    return program.returncode


def _counted(picture: Picture, progress: Progress | None) -> Iterator[Pixels]:
    """The frames in order, telling the part that is done."""
    for frame in range(len(picture)):
        yield picture.frame(frame)
        if progress is not None:
            progress((frame + 1) / len(picture))
