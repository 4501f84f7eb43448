"""Fuzz the loader of models: whatever it is given, a scene or a SceneError comes out.

Usage:
  .venv/bin/python scripts/fuzz_loader.py --minutes 60     another seed every time; it is printed
  .venv/bin/python scripts/fuzz_loader.py --minutes 5 --seed 7
  .venv/bin/python scripts/fuzz_loader.py --replay fuzz/0  what was found, once more

An input that lets anything else out (an exception, a warning, more than 20 s of processor time,
more than 4 GB) is made as small as possible and kept, model, CSV file and settings, in a folder of
its own. The exit code is 1 if there is one.
"""

from __future__ import annotations

import argparse
import secrets
import sys
import tempfile
import time
import traceback
from pathlib import Path

try:
    from hypothesis import HealthCheck, Phase, given, settings
    from hypothesis import seed as seeded
except ModuleNotFoundError:
    helping = {"-h", "--help"} & set(sys.argv)
    told = f"{__doc__}\n" if helping else ""
    print(f"{told}needs hypothesis: .venv/bin/pip install -q -e '.[dev]'", file=sys.stderr)
    raise SystemExit(0 if helping else 2) from None

from fuzzing.inputs import INPUTS, Input, kept
from fuzzing.limits import TooLongError, limit_memory
from fuzzing.trying import loads, signature

AT_ONCE = 400  # inputs between two looks at the clock


class Fuzzing:
    """Tries inputs; knows what was found, so that the same is not found again."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self.found: dict[str, tuple[Input, str]] = {}
        self.tried = self.scenes = 0
        self._last: tuple[str, Input, str] | None = None

    def one(self, given_input: Input) -> None:
        """Try an input; raises what is found for the first time."""
        self.tried += 1
        try:
            self.scenes += loads(given_input, self._folder)
        except KeyboardInterrupt:
            raise
        except (Exception, TooLongError) as error:
            name = signature(error)
            if name in self.found:
                return
            self._last = (name, given_input, traceback.format_exc())
            raise AssertionError(name) from None

    def some(self, seed: int) -> None:
        """Try inputs made from a seed; the smallest that fails is remembered."""

        @settings(
            max_examples=AT_ONCE,
            deadline=None,
            database=None,
            phases=(Phase.generate, Phase.shrink),
            suppress_health_check=list(HealthCheck),
            report_multiple_bugs=False,
            print_blob=False,
        )
        @seeded(seed)
        @given(INPUTS)
        def fuzz(given_input: Input) -> None:
            self.one(given_input)

        try:
            fuzz()
        except AssertionError:
            assert self._last is not None
            name, smallest, told = self._last
            self.found[name] = (smallest, told)


def main() -> int:
    """Fuzz for the minutes asked for, or replay an input."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n", maxsplit=1)[0])
    parser.add_argument("--minutes", type=float, default=60.0, help="how long; default: 60")
    parser.add_argument("--seed", type=int, default=None, help="default: a random one")
    parser.add_argument("--out", type=Path, default=Path("fuzz"), help="where findings are kept")
    parser.add_argument("--replay", type=Path, metavar="DIR", help="an input that was kept")
    options = parser.parse_args()
    limit_memory()
    with tempfile.TemporaryDirectory() as folder:
        if options.replay is not None:
            told = "a scene" if loads(kept(options.replay), Path(folder)) else "a SceneError"
            print(f"{options.replay}: {told}")
            return 0
        return _fuzz(options, Path(folder))


def _fuzz(options: argparse.Namespace, folder: Path) -> int:
    seed = secrets.randbelow(10**9) if options.seed is None else options.seed
    print(f"seed {seed}", flush=True)
    fuzzing, ends = Fuzzing(folder), time.monotonic() + 60 * options.minutes
    while time.monotonic() < ends:
        known = len(fuzzing.found)
        fuzzing.some(seed)
        for name, (smallest, told) in list(fuzzing.found.items())[known:]:
            place = options.out / f"{seed}-{known}"
            smallest.keep(place)
            (place / "traceback.txt").write_text(told, encoding="utf-8")
            print(f"found: {name}; kept in {place}", flush=True)
        seed += 1
    print(f"{fuzzing.tried} inputs, {fuzzing.scenes} scenes among them; "
          f"{len(fuzzing.found)} findings; next seed {seed}")  # fmt: skip
    return 1 if fuzzing.found else 0


if __name__ == "__main__":
    sys.exit(main())
