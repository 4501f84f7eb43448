"""How animations look: colours, widths of lines and times, the same in every format."""

from __future__ import annotations

from exudyn_flexlink.plots.style import BLACK, GREY

INK, PALE, TOUCH, GLOW = BLACK, GREY, "#E5401A", "#FF7A22"

WIDTHS = {"curve": 1.4, "face": 5.0, "wall": 2.6, "guide": 9.0, "spring": 1.5, "ring": 1.6,
          "spoke": 1.2, "bar": 3.0, "link": 3.0}  # fmt: skip
"""Widths of lines, in pixels of a picture that is `WIDE` pixels wide."""
WIDE = 620.0
THINNEST, BROADEST = 0.75, 1.5  # times those widths, in small and in large pictures
PALENESS = {"curve": 0.85, "face": 0.35, "spoke": 0.6, "guide": 0.8}
"""Opacity of lines, where it is not 1."""
HALO, HALO_PALE = 8.0, 0.2  # width and opacity of what is around a bar

BAND, BAND_PALE = 2.4, 0.4  # of two runs the first is a band, so many times as wide and as opaque,
THIN = 0.8  # on which the second is a line so many times as wide

TRAIL_SECONDS = 1.6  # of the film without slow motion: how long the trail of S stays dark
GLOW_SECONDS = 0.45  # of the film: how long a touch is seen after its end
LABELLED = 0.12  # of the largest force: a weaker touch in a joint is not told in numbers
ARROW = (7.0, 15.0)  # pixels: length of an arrow in the zoom, and what the largest force adds


def look_data() -> dict[str, object]:
    """Return what the player needs of it."""
    return {
        "ink": INK, "pale": PALE, "touch": TOUCH, "widths": WIDTHS, "wide": WIDE,
        "thinnest": THINNEST, "broadest": BROADEST, "paleness": PALENESS,
        "halo": [HALO, HALO_PALE], "band": [BAND, BAND_PALE], "thin": THIN,
        "trail": TRAIL_SECONDS, "glow": GLOW_SECONDS, "labelled": LABELLED,
        "arrow": ARROW,
    }  # fmt: skip


def thickness(width: float) -> float:
    """How many times as wide lines are in a picture of a width in pixels."""
    return min(max(width / WIDE, THINNEST), BROADEST)
