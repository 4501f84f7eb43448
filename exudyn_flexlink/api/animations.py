"""A run that moves, as a notebook shows it and as a file."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from html import escape
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from exudyn_flexlink.arguments import takes

if TYPE_CHECKING:
    from exudyn_flexlink.animation import Film, Filming

HEIGHT = "min(90vh, 46rem)"  # of the frame in a notebook


@dataclass(frozen=True, repr=False)
class Animation:
    """A run, or two over each other, from one instant to another.

    A notebook shows it as a player; `save` writes it, `html` is for a page of one's own.
    """

    film: Film
    filming: Filming

    @takes()
    def save(
        self,
        path: str | PathLike[str],
        *,
        force: bool = False,
        progress: Callable[[float], None] | None = None,
    ) -> Path:
        """Write it, whole or not at all, as its name ends: ``.html``, ``.gif`` or ``.mp4``.

        An animation that stands there is replaced; other files are not, unless `force` says so.
        `progress` is called with the part of a GIF or a video that is done, 0 to 1.

        Raises:
            FilmError: there is no such format, or it can't hold this; a video needs ffmpeg.
            StorageError: the file can't be written, or may not be replaced.

        """
        from exudyn_flexlink.animation import film_bytes, is_animation
        from exudyn_flexlink.storage import replace_file

        file = Path(path)
        content = film_bytes(self.film, file.suffix[1:].lower(), self.filming, progress)
        replace_file(file, content, is_animation, force=force)
        if progress is not None:
            progress(1.0)
        return file

    def html(self) -> str:
        """Return the player as a fragment of HTML, a ``<div>`` that loads nothing."""
        from exudyn_flexlink.animation import player

        return player(self.film, self.filming.speed)

    def __repr__(self) -> str:
        """Return one line: of what, from when to when."""
        film = self.film
        of = " and ".join(f"'{take.result.scene.title}' by {take.name}" for take in film.takes)
        return f"<Animation of {of}: {film.begin:g} s to {film.end:g} s>"

    def _repr_html_(self) -> str:
        """A page in a frame: the style and the names of a notebook can't disturb it."""
        from exudyn_flexlink.animation import page

        own = escape(page(self.film, self.filming.speed), quote=True)
        return f'<iframe srcdoc="{own}" style="width:100%;height:{HEIGHT};border:0"></iframe>'
