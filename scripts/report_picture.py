"""Show the report of the paper's run as a reader sees it: at a desk, and on a phone beside it.

  .venv/bin/python scripts/report_picture.py
  .venv/bin/python scripts/report_picture.py --out docs --run runs/no_clearance

Without --run the model is simulated first. Writes report.png. Needs a Chromium. Takes ten seconds.
"""

from __future__ import annotations

import argparse
import sys
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory

from browsing.chromium import Page, browser, program
from PIL import Image

import exudyn_flexlink as fl

DESK, PHONE = (1000, 1500), (390, 750)  # pixels of the windows; the phone has two for one
GAP = 40  # pixels around both
GREY = (225, 228, 232)


def main() -> int:
    """Draw the picture."""
    parser = argparse.ArgumentParser(
        description=(__doc__ or "").split("\n\n")[0],
        epilog="Without --run the model no_clearance is simulated.",
    )
    parser.add_argument("--out", type=Path, default=Path(), metavar="DIR", help="default: here")
    parser.add_argument("--run", type=Path, metavar="RUN", help="a saved run")
    options = parser.parse_args()
    if program() is None:
        print("needs a Chromium, and finds none", file=sys.stderr)
        return 2
    options.out.mkdir(parents=True, exist_ok=True)
    result = (
        fl.simulate(fl.load_scene("no_clearance")) if options.run is None else fl.load(options.run)
    )
    with TemporaryDirectory() as folder, browser() as page:
        file = result.report(Path(folder) / "report.html")
        desk, phone = seen(page, file, DESK), seen(page, file, PHONE, "strikes")
    beside(desk, phone).save(options.out / "report.png", optimize=True)
    return 0


def seen(page: Page, file: Path, size: tuple[int, int], part: str = "outcome") -> Image.Image:
    """Return what a window of a size shows of a page, from one of its parts on."""
    page.open(file, *size)
    if part != "outcome":
        page.value(f"document.getElementById('{part}').scrollIntoView()")
    return Image.open(BytesIO(page.picture(whole=False)))


def beside(*pictures: Image.Image) -> Image.Image:
    """Return pictures beside one another, on grey."""
    width = sum(one.width for one in pictures) + GAP * (len(pictures) + 1)
    height = max(one.height for one in pictures) + 2 * GAP
    whole, left = Image.new("RGB", (width, height), GREY), GAP
    for one in pictures:
        whole.paste(one, (left, GAP))
        left += one.width + GAP
    return whole


if __name__ == "__main__":
    sys.exit(main())
