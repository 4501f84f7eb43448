"""The animation of a run for a page, and what a browser may run of it."""

from __future__ import annotations

import re
from base64 import b64encode
from hashlib import sha256

from exudyn_flexlink.animation import film_of, player
from exudyn_flexlink.result import Result

PROGRAM = re.compile(r"<script>(.*?)</script>", re.DOTALL)  # others hold data


def player_of(result: Result) -> str:
    """Return the player of a run's animation; empty if the run has one instant only."""
    if not result.time[0] < result.time[-1]:
        return ""
    return player(film_of(result))


def policy_of(players: str) -> str:
    """Return what a browser lets a page do: load nothing, and run nothing but these players."""
    programs = [sha256(own.encode("utf-8")).digest() for own in PROGRAM.findall(players)]
    hashes = " ".join(f"'sha256-{b64encode(own).decode('ascii')}'" for own in programs)
    allowed = f"; script-src {hashes}" if hashes else ""
    return f"default-src 'none'; img-src data:; style-src 'unsafe-inline'{allowed}"
