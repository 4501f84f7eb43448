"""Looks up what names in a scene refer to, and says which lead nowhere."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from inspect import isclass
from itertools import islice
from typing import Any, NamedTuple, get_args

from exudyn_flexlink.expressions import Expression, Sensed
from exudyn_flexlink.scene.base import (
    DRIVEN,
    GROUND,
    REVOLUTE,
    SLIDING,
    Part,
    Refers,
    split_point,
)
from exudyn_flexlink.scene.joints import SleeveJoint
from exudyn_flexlink.source import MOST_SHOWN, KeyPath, Mistake, did_you_mean

_NOUNS = {"materials": "material", "curves": "curve", "bodies": "body", "joints": "joint"}


class Parts:
    """The sections of a scene as far as they are valid, and whether names in them lead anywhere.

    A part that is not valid is `None`: its name is known, its contents are not. A section that
    can't be read at all is missing, or `None`: no reference into it is a mistake.
    """

    def __init__(self, sections: Mapping[str, Any]) -> None:
        self.sections = sections
        self._unknown = 0  # names met that no part has

    def valid(self, section: str) -> list[tuple[str, Any]]:
        """Return the parts of a section that are valid, by name."""
        parts = self.sections.get(section) or {}
        return [(name, part) for name, part in parts.items() if part is not None]

    def get(self, section: str, name: str | None) -> Any:
        """Return the part of that name, None if there is none or it is not valid."""
        return (self.sections.get(section) or {}).get(name)

    def lost_names(self) -> Iterator[Mistake]:
        """Refuse names that lead nowhere, or to another kind of part than is needed."""
        for section, own in self.sections.items():
            for name in references(own, (section,)):
                yield from self._mistakes(name)

    def missing(
        self, path: KeyPath, section: str, name: str, on_key: bool = False
    ) -> Iterator[Mistake]:
        """Refuse a name that no part of the section has."""
        known = self.sections.get(section)
        if known is None or name in known:
            return
        # Every unknown name compared with every known one: more are reported than are shown.
        self._unknown += 1
        near = did_you_mean(name, known) if self._unknown <= MOST_SHOWN else ""
        names = [*islice(known, MOST_SHOWN), *(["..."] if len(known) > MOST_SHOWN else [])]
        hint = f"{section}: {', '.join(names)}" if known else f"no {section} given"
        yield Mistake(path, f"unknown {_NOUNS[section]} '{name}'{near}", hint, on_key)

    def _mistakes(self, name: Reference) -> Iterator[Mistake]:
        """Refuse what a name refers to, if that is not there, or is not what is needed."""
        refers, path = name.refers, name.path
        if refers.section == "points":
            yield from self._point(path, name.text)
        elif refers.section != "frames":
            yield from self.missing(path, refers.section, name.text, name.on_key)
        elif name.text != GROUND:
            yield from self.missing(path, "bodies", name.text)
        joint = self.get("joints", name.text) if refers.kinds else None
        if joint is None:
            return
        if joint.type not in refers.kinds:
            message = f"needs {refers.words}; '{name.text}' is of type {joint.type}"
            slides = joint.type in SLIDING.kinds
            yield Mistake(path, message, refers.to_slides if slides else "", name.on_key)
        elif isinstance(joint, SleeveJoint) and joint.clearance > 0 and not refers.play:
            hint = "the link may lie askew there; it does not just slide"
            yield Mistake(path, f"needs a sleeve without clearance; '{name.text}' has one", hint)

    def _point(self, path: KeyPath, text: str) -> Iterator[Mistake]:
        """Refuse a point 'body.point' whose body, or point, is unknown."""
        try:
            body, point = split_point(text)
        except ValueError as error:  # in an expression
            yield Mistake(path, str(error))
            return
        if body == GROUND:
            return
        yield from self.missing(path, "bodies", body)
        part = self.get("bodies", body)
        if part is not None and point not in part.point_names:
            message = f"body '{body}' has no point '{point}'"
            message += did_you_mean(point, part.point_names)
            yield Mistake(path, message, "its points: " + ", ".join(part.point_names))


class Reference(NamedTuple):
    """A name in a scene: where it stands, as a key or as a value, and what it should refer to."""

    path: KeyPath
    refers: Refers
    text: str
    on_key: bool = False

    @property
    def body(self) -> str:
        """The body that it names, or of which it names a point; empty if it is of another kind."""
        if self.refers.section == "points":
            return split_point(self.text)[0]
        return self.text if self.refers.section in ("bodies", "frames") else ""


def references(value: Any, path: KeyPath = (), refers: Refers | None = None) -> Iterator[Reference]:
    """Find all names in a part, or in what a key that refers to something holds."""
    if isinstance(value, Part):
        for key, alias, inner in _referring(type(value)):
            yield from references(getattr(value, key), (*path, alias), inner)
    elif isinstance(value, Mapping):
        if refers is not None:
            yield from (Reference((*path, name), refers, name, on_key=True) for name in value)
        for name, own in value.items():
            yield from references(own, (*path, name))
    elif isinstance(value, tuple):
        for i, own in enumerate(value):
            yield from references(own, (*path, i), refers)
    elif isinstance(value, Expression):
        yield from (
            Reference(path, _wanted(sensed), sensed.of) for sensed in value.sensed if sensed.of
        )
    elif isinstance(value, str) and refers is not None:
        yield Reference(path, refers, value)


@cache
def _referring(part: type[Part]) -> list[tuple[str, str, Refers | None]]:
    """Fields of a part that may hold names, with their keys, and what these refer to."""
    found = []
    for key, info in part.model_fields.items():
        told = list(_told((info.annotation, *info.metadata)))
        if told:
            refers = next((one for one in told if isinstance(one, Refers)), None)
            found.append((key, info.alias or key, refers))
    return found


def _told(hint: Any) -> Iterator[Any]:
    """What in a type may hold names: parts and expressions; and to what names in it refer."""
    if isinstance(hint, Refers) or (isclass(hint) and issubclass(hint, (Part, Expression))):
        yield hint
    inner = hint if isinstance(hint, tuple) else get_args(hint)
    for one in (*inner, *getattr(hint, "__metadata__", ())):
        yield from _told(one)


def _wanted(sensed: Sensed) -> Refers:
    """What an expression needs for what it senses."""
    if sensed.axis:
        return Refers("points")
    return {"speed": DRIVEN, "place": SLIDING}.get(sensed.kind, REVOLUTE)
