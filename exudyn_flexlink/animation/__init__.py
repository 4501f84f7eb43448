"""Animations of one run, or of two runs over each other: a page with a player, a GIF, a video.

`film_of` returns the contents of an animation. `film_bytes` returns the content of a file;
`player` returns a fragment of HTML for another page.
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
