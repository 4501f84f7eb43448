"""Animations of a run, or of two over each other: a page with a player, a GIF, a video.

`film_of` says what is shown. `film_bytes` is the content of a file; `player` is a fragment of HTML
for another page.
"""

from exudyn_flexlink.animation.film import Film, FilmError, Slow, Take, film_of
from exudyn_flexlink.animation.writing import (
    Filming,
    film_bytes,
    is_animation,
    page,
    player,
    usual_formats,
)
