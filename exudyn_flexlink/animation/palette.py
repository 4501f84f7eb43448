"""Few colours for all frames of a GIF, so that none flickers, and pictures in these colours."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from exudyn_flexlink.animation.picture import Pixels

COLOURS = 64  # lines on white need few
KEPT = 12  # the most frequent colours stay as they are: white stays white
RARE = 4  # a root: so much less counts how often a colour is seen, or small marks lost their own
BITS = 6  # of each of red, green and blue by which colours are told apart


class Palette:
    """Colours that frames are drawn in, from some of these (height, width, 4)."""

    def __init__(self, frames: Sequence[Pixels]) -> None:
        seen = np.concatenate([_boxes(frame).ravel() for frame in frames])
        boxes, counts = np.unique(seen, return_counts=True)
        order = np.argsort(-counts, kind="stable")
        found, rest = [_colours(boxes[order[:KEPT]])], order[KEPT:]
        if len(rest):
            times = np.ceil(counts[rest] ** (1 / RARE)).astype(int)
            shown = Image.fromarray(np.repeat(_colours(boxes[rest]), times, axis=0)[None])
            mixed = shown.quantize(COLOURS - KEPT, method=Image.Quantize.MEDIANCUT).getpalette()
            found.append(np.array(mixed, dtype=np.uint8).reshape(-1, 3)[: COLOURS - KEPT])
        self._colours = np.concatenate(found)
        self._nearest = _nearest(self._colours)

    def image(self, frame: Pixels) -> Image.Image:
        """A frame in these colours."""
        image = Image.fromarray(self._nearest[_boxes(frame)])
        image.putpalette(self._colours.tobytes())
        return image


def _boxes(pixels: Pixels) -> NDArray[np.uint32]:
    """Numbers (height, width) of the small boxes of colours that pixels are in."""
    parts = (pixels[..., :3] >> (8 - BITS)).astype(np.uint32)
    return np.asarray(parts @ np.array([1 << 2 * BITS, 1 << BITS, 1], dtype=np.uint32))


def _colours(boxes: NDArray[np.uint32]) -> Pixels:
    """A colour (n, 3) of every box: the darkest is black, the lightest white."""
    most = (1 << BITS) - 1
    parts = np.stack([boxes >> 2 * BITS, boxes >> BITS & most, boxes & most], axis=1)
    return (parts * 255 // most).astype(np.uint8)


def _nearest(colours: Pixels) -> Pixels:
    """Index of the nearest of some colours (n, 3), for every box."""
    every = _colours(np.arange(1 << 3 * BITS, dtype=np.uint32)).astype(np.int32)
    least = np.full(len(every), np.iinfo(np.int32).max, dtype=np.int32)
    found = np.zeros(len(every), dtype=np.uint8)
    for i, colour in enumerate(colours.astype(np.int32)):
        off = ((every - colour) ** 2).sum(axis=1, dtype=np.int32)
        nearer = off < least
        found[nearer], least[nearer] = i, off[nearer]
    return found
