"""Hypothesis strategies for model folders: shipped models changed, trees, texts and bytes."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import yaml
from hypothesis import strategies as st

from exudyn_flexlink.source import load_document

MODELS = Path(__file__).parents[2] / "models"
EXAMPLES = Path(__file__).parents[2] / "docs" / "reference" / "examples"
POINTS = "track_points.csv"

Path_ = tuple[str | int, ...]


@cache
def shipped_points() -> bytes:
    """Return the shipped CSV file."""
    return (MODELS / POINTS).read_bytes()


@cache
def example_tables() -> dict[str, bytes]:
    """Return the CSV files that the reference's examples read, by name."""
    return {path.name: path.read_bytes() for path in sorted(EXAMPLES.glob("*.csv"))}


@dataclass(frozen=True)
class Input:
    """What a user may hand to the loader: a model's bytes, its CSV file's, and settings."""

    model: bytes
    points: bytes = field(default_factory=shipped_points)
    settings: tuple[str, ...] = ()

    def write(self, folder: Path) -> Path:
        """Write the files into a folder, and those of the examples; returns the model's path."""
        for name, table in example_tables().items():
            (folder / name).write_bytes(table)
        (folder / POINTS).write_bytes(self.points)
        model = folder / "model.yaml"
        model.write_bytes(self.model)
        return model

    def keep(self, folder: Path) -> None:
        """Write the files and the settings, so that `kept` gives the same input again."""
        folder.mkdir(parents=True, exist_ok=True)
        self.write(folder)
        (folder / "settings.json").write_text(json.dumps(self.settings), encoding="utf-8")


def kept(folder: Path) -> Input:
    """Read an input that `Input.keep` wrote."""
    settings = tuple(json.loads((folder / "settings.json").read_text(encoding="utf-8")))
    return Input((folder / "model.yaml").read_bytes(), (folder / POINTS).read_bytes(), settings)


@cache
def shipped_models() -> list[Path]:
    """Return the files of shipped models, and the reference's, which show every part and key."""
    folders = (MODELS, MODELS / "textbook", MODELS / "benchmarks", EXAMPLES)
    found = [path for folder in folders for path in sorted(folder.glob("*.yaml"))]
    return [path for path in found if not path.name.endswith(".published.yaml")]


@cache
def shipped_texts() -> list[bytes]:
    """Return the texts of the shipped models."""
    return [path.read_bytes() for path in shipped_models()]


@cache
def shipped_data() -> list[dict[str, Any]]:
    """Return the shipped models as plain data."""
    return [load_document(path).data for path in shipped_models()]


def _paths(data: Any, path: Path_ = ()) -> Iterator[Path_]:
    """Give the path of every value below `data`."""
    items = data.items() if isinstance(data, dict) else enumerate(data)
    for key, value in items:
        yield (*path, key)
        if isinstance(value, (dict, list)):
            yield from _paths(value, (*path, key))


def _at(data: Any, path: Path_) -> Any:
    for step in path:
        data = data[step]
    return data


@cache
def _vocabulary() -> tuple[list[str], list[str]]:
    """Keys, and texts, of the shipped models and of the schema."""
    schema = json.loads((MODELS / "flexlink.schema.json").read_text(encoding="utf-8"))
    keys = {key for part in schema["$defs"].values() for key in part.get("properties", {})}
    keys |= set(schema["properties"])
    texts = {"ground", "link.end", "guide.start", "5 mm", "-90 deg", "3 N", "1e400 m", "1/s^9"}
    texts |= {"2*sin(t)", "t**2 - angle(crank)", "where(t < 1, 1, log(t - 1))", "1/t", "1e300**t"}
    texts |= {"speed(hub)*place(rod.big, y)", "max(0, abs(cos(9*t)))", "5 mm * t", "1/0", POINTS}
    for data in shipped_data():
        found = list(_paths(data))
        keys |= {step for path in found for step in path if isinstance(step, str)}
        texts |= {value for path in found if isinstance(value := _at(data, path), str)}
    for part in schema["$defs"].values():
        for value in part.get("properties", {}).values():
            texts |= {word for word in value.get("enum", []) if isinstance(word, str)}
            texts |= {value["const"]} if "const" in value else set()
    return sorted(keys), sorted(texts)


NUMBERS = st.one_of(
    st.sampled_from([0, 1, -1, 2, 3, 1e-6, 1e-300, 5e-324, 1e154, 1e300, 1.7e308, -1e300, 10**30,
                     10**400, float("inf"), float("nan"), 0.0, -0.0, 1e-9, 1e9, 200, 10**6]),
    st.integers(-(10**6), 10**6),
    st.floats(),
    st.floats(-1.0, 1.0),
)  # fmt: skip
KEYS = st.deferred(lambda: st.sampled_from(_vocabulary()[0]))
LETTERS = st.characters(exclude_categories=("Cs", "Cc"))
TEXTS = st.one_of(
    st.deferred(lambda: st.sampled_from(_vocabulary()[1])),
    st.text(LETTERS, max_size=12),
    st.builds("{} {}".format, NUMBERS, st.sampled_from(["mm", "m", "deg", "N", "Hz", "GPa", "kg"])),
)
SCALARS = st.one_of(NUMBERS, TEXTS, st.booleans(), st.none())
TREES = st.recursive(
    SCALARS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(st.one_of(KEYS, st.text(LETTERS, max_size=5)), inner, max_size=5),
    ),
    max_leaves=12,
)


@st.composite
def changed_data(draw: st.DrawFn) -> dict[str, Any]:
    """Change a shipped model in up to four places: values, keys, whole branches."""
    data = copy.deepcopy(draw(st.sampled_from(shipped_data())))
    for _ in range(draw(st.integers(1, 4))):
        paths = list(_paths(data))
        if not paths:
            break
        path = draw(st.sampled_from(paths))
        _change(draw, data, path, paths)
    return data


def _change(draw: st.DrawFn, data: Any, path: Path_, paths: list[Path_]) -> None:
    """Change one value: drop it, give it twice, replace it, or scale it."""
    holder, key = _at(data, path[:-1]), path[-1]
    how = draw(st.sampled_from(["drop", "twice", "number", "value", "other", "scale"]))
    if how == "drop":
        del holder[key]
    elif how == "twice":
        again = copy.deepcopy(holder[key])
        if isinstance(holder, list):
            holder.append(again)
        else:
            holder[draw(st.one_of(KEYS, TEXTS))] = again
    elif how == "other":
        holder[key] = copy.deepcopy(_at(data, draw(st.sampled_from(paths))))
    elif how == "scale" and type(holder[key]) in (int, float):
        holder[key] = _times(holder[key], draw(st.sampled_from([-1.0, 1e-3, 0.1, 10, 1e3, 1e9])))
    else:
        holder[key] = draw(NUMBERS if how in ("number", "scale") else TREES)


def _times(value: float, factor: float) -> float:
    try:
        return value * factor
    except OverflowError:
        return float("inf")


def as_text(data: Any) -> bytes:
    """Write plain data as YAML."""
    return yaml.safe_dump(data, allow_unicode=True, sort_keys=False, width=100).encode()


@st.composite
def cut_bytes(draw: st.DrawFn, source: list[bytes]) -> bytes:
    """Change the bytes of a file in up to four places: cut, repeat, insert."""
    found = draw(st.sampled_from(source))
    for _ in range(draw(st.integers(1, 4))):
        begin = draw(st.integers(0, len(found)))
        end = min(begin + draw(st.integers(0, 40)), len(found))
        put = draw(
            st.one_of(
                st.just(b""),
                st.just(found[begin:end] * 2),
                st.binary(max_size=8),
                st.sampled_from([b"&a ", b"*a", b"<<: ", b"\t", b"\r\n", b"- ", b": ", b"{", b"["]),
                st.sampled_from([b"\xef\xbb\xbf", b"---\n", b"nan", b"1e999", b"!!int ", b"? "]),
            )
        )
        found = found[:begin] + put + found[end:]
    return found


TEXT_MODELS = st.text(alphabet="ab1:-[]{}&*!'\"\\#|>%@`,?~. \n\t\r\x00é\ufeff\u2028", max_size=80)
SETTINGS = st.lists(
    st.one_of(
        st.builds("{}.{}={}".format, KEYS, KEYS, st.one_of(NUMBERS, TEXTS)),
        st.sampled_from(["bodies.link.rods=200", "run.turns=.nan", "accuracy.tolerance=1e-400"]),
        st.text(LETTERS, max_size=20),
    ),
    max_size=2,
).map(tuple)
NO_SETTINGS = st.just(())

_CHANGED = st.builds(Input, changed_data().map(as_text), settings=NO_SETTINGS)
INPUTS = st.one_of(
    _CHANGED,
    _CHANGED,  # what comes closest to a scene finds most
    st.builds(Input, changed_data().map(as_text), settings=SETTINGS),
    st.builds(Input, st.dictionaries(KEYS, TREES, max_size=8).map(as_text)),
    st.builds(Input, st.deferred(lambda: cut_bytes(shipped_texts()))),
    st.builds(
        Input,
        st.deferred(lambda: st.just((MODELS / "spline_track.yaml").read_bytes())),
        st.deferred(lambda: cut_bytes([shipped_points()])),
    ),
    st.builds(Input, TEXT_MODELS.map(str.encode)),
    st.builds(Input, st.binary(max_size=60)),
)
"""Anything that may be handed to the loader, mostly close to a model."""
