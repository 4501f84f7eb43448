"""Animations of a run, or of two over each other: a page with a player, a GIF, a video.

`film_of` says what is shown; `player` is a fragment of HTML for another page, `page` a whole one.
"""

from exudyn_flexlink.animation.film import Film, FilmError, Take, film_of
from exudyn_flexlink.animation.html import is_page, page, player
from exudyn_flexlink.animation.slowing import Slow

__all__ = ["Film", "FilmError", "Slow", "Take", "film_of", "is_page", "page", "player"]
