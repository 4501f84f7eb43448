"""What the program says of a work-precision study: table, causes of error, advice."""

from __future__ import annotations

from exudyn_flexlink.accuracy import (
    STIFFER,
    Advice,
    Method,
    Point,
    Source,
    Study,
    advise,
    beams,
    dominating,
    flexible,
    needed,
    rods_needed,
    stiffnesses,
)
from exudyn_flexlink.accuracy.sources import MOST_RODS
from exudyn_flexlink.observables import measures, name_of
from exudyn_flexlink.report.text import Table, in_blocks, lines_of, table
from exudyn_flexlink.scene import FlexibleBody, ImpulseLaw

NAMES = {"time": "time steps", "rods": "number of rods", "contact": "contact compliance"}


def accuracy_text(study: Study, command: str) -> str:
    """Return the whole report of a study; `command` simulates its scene, as it was studied."""
    blocks = [
        [f"What accuracy costs: {study.scene.title}"],
        judged_by(study),
        _points(study),
        _sources(study),
        _left_out(study),
        [recommendation(study), *_how_accurate(study, command)],
    ]
    return in_blocks(blocks)


def judged_by(study: Study) -> list[str]:
    """Say what errors are measured against, how well that is known, and up to when."""
    lines = [f"Errors of {name_of(study.judged_by)}, against {study.reference.told}"]
    if study.check is not None:
        what = "independent" if study.independent else "not independent: the same equations"
        lines.append(
            f"Cross-check ({what}): {study.check.told} is {study.floor:.2g} m from it at most; "
            "smaller errors are not claimed"
        )
    else:
        lines.append("There was no second run to check it with")
    if study.horizon is not None:
        lines.append(
            f"Horizon: both part by more than {study.horizon.limit:.2g} m at t = "
            f"{study.horizon.parted:.5g} s of {study.end:.5g} s (the motion is sensitive, or the "
            f"check coarse); errors are those up to t = {study.until:.5g} s"
        )
    return lines


def _points(study: Study) -> list[str]:
    rows, method = [["", "steps", "rms", "largest", "of", "forces", "processor time"]], ""
    for point in study.points:
        if point.method.name != method:
            method = point.method.name
            rows.append([f"{method}: {point.method.knob}"])
        rows.append(_accuracy_row(study, point))
    what = "" if len(study.judged_by) == 1 else " of the point that is farthest off"
    return [
        f"Errors (m){what}, errors of forces as parts of the force (of the one that is worst), "
        "and processor time (s) of the solve, best of those run",
        *table(rows),
    ]


def _accuracy_row(study: Study, point: Point) -> list[str]:
    errors = point.errors
    told = [_told_accuracy(error, study.floor) for error in (errors.rms, errors.largest)]
    force = _told_accuracy(errors.force, study.force_floor)
    own = " (model's own)" if point is study.own else ""
    setting = f"  {point.method.amount(point.value)}{own}"
    cost = f"{point.processor:.3g} (of {point.repeats})"
    worst = errors.worst if errors.largest >= study.floor else ""
    return [setting, str(point.steps), *told, worst, force, cost]


def _told_accuracy(error: float, floor: float) -> str:
    """Return an error, or what it is known to be less than."""
    return f"{error:.1e}" if error >= floor else f"< {floor:.1e}"


def _sources(study: Study) -> list[str]:
    if study.still:
        return ["Nothing that is judged moves: there is no error to take apart"]
    own = study.own.told if study.own is not None else ""
    caption = f"Where the error comes from, at the model's own settings{own and f' ({own})'}"
    rows = [_source(study, source) for source in study.sources]
    lines = lines_of(Table(caption, rows, ["", "rms", "largest", "of", "forces", ""])) or [caption]
    return [*lines, *(f"  {note}" for note in notes(study)), dominance(study)]


def _source(study: Study, source: Source) -> list[str]:
    errors = source.errors
    numbers = [f"{errors.rms:.1e} m", f"{errors.largest:.1e} m", f"{errors.force:.1e}"]
    if source.at_most:
        numbers = [f"<~ {number}" for number in numbers]
    rms, largest, force = numbers
    return [NAMES[source.kind], rms, largest, errors.worst, force, _about(study, source)]


def _about(study: Study, source: Source) -> str:
    """Say what a source's error was told from."""
    if source.kind == "time":
        own = study.own is not None
        return "against the reference" if own else "this is the finest run: that of the check"
    if source.kind == "rods":
        rods = ", ".join(f"{b.rods}" for b in beams(study.scene).values())
        twice = ", ".join(f"{2 * b.rods}" for b in beams(study.scene).values())
        power = f"^{source.order:g}" if source.order != 1 else ""
        return f"n = {rods} against {twice}, which {_cost(source)}; estimated as O(1/n{power})"
    told = measures(study.scene)
    peaks = "".join(
        f"; peak of {body} {x:.1e} {told[body].unit}" for body, x in source.errors.levers.items()
    )
    against = f"{STIFFER:g} times the stiffness, which {_cost(source)}"
    return f"{against}; estimated as O(k^-1/2){peaks}"


def _cost(source: Source) -> str:
    return f"costs {source.dearer:.2g} times as much"


def notes(study: Study) -> list[str]:
    """Say which causes of error the scene does not have, and which were not looked at, and why."""
    kinds = {source.kind for source in study.sources}
    others = dict.fromkeys(point.method for point in study.points if not point.method.of_rods)
    found = [_other_model(study, method) for method in others]
    if "time" not in kinds:
        found.append(
            "time steps: not told, the model's own settings were not run, or are the judge"
        )
    found += _of_rods(study, "rods" in kinds)
    if not stiffnesses(study.scene):
        laws = study.scene.laws.values()
        jumps = any(isinstance(law, ImpulseLaw) for law in laws)
        why = "strike by impulses" if jumps else "give way as their materials do"
        why = why if laws else "there is no contact"
        found.append(f"contact compliance: none, {why}")
    elif "contact" not in kinds:
        found.append("contact compliance: not told, there was no time to vary it")
    return found


def _other_model(study: Study, method: Method) -> str:
    finest = min((p for p in study.points if p.method == method), key=lambda p: p.value)
    return (
        f"{method.name}: another model of the link, which moves otherwise than rods at any "
        f"setting; at {method.set_to(finest.value)} it is {finest.errors.largest:.1e} m off"
    )


def _of_rods(study: Study, told: bool) -> list[str]:
    links = flexible(study.scene)
    if not links:
        return ["number of rods: no flexible body"]
    found = [_fixed(name, body) for name, body in links.items() if body.hinges.stiffness != "beam"]
    if beams(study.scene) and not told:
        found.append("number of rods: not told, there was no time (or no room) to double it")
    return found


def _fixed(name: str, body: FlexibleBody) -> str:
    rule = body.hinges.stiffness
    hinges = f"'{rule}' hinges" if isinstance(rule, str) else f"hinges of {rule:.4g} N m/rad"
    return (
        f"number of rods: {name} with {hinges} tends to no beam as rods are added; "
        f"n = {body.rods} is part of the model, not an error"
    )


def dominance(study: Study) -> str:
    """Say which source of error is the largest."""
    largest = dominating(study.sources)
    if largest is None:
        return "There is only one known source of error" if study.sources else ""
    others = [s for s in study.sources if s is not largest]
    next_one = max(others, key=lambda s: s.errors.largest)
    name, other = NAMES[largest.kind], NAMES[next_one.kind]
    verb = "dominate" if largest.kind == "time" else "dominates"
    if next_one.errors.largest == 0:
        return f"The {name} {verb}"
    ratio = largest.errors.largest / next_one.errors.largest
    return f"The {name} {verb}: {ratio:.2g} times the error of the {other}"


def recommendation(study: Study) -> str:
    """Say in one sentence what to choose for the target, and what limits."""
    if study.still and len(study.judged_by) == 1:
        still = f"{study.judged_by[0]} does not move and judges nothing: watch another point"
        return f"Recommendation: {still}."
    if study.still:
        return "Recommendation: nothing moves, so that any setting will do."
    advice = advise(study)
    return f"Recommendation: {_choice(study, advice)}{_limit(study, advice)}."


def _how_accurate(study: Study, command: str) -> list[str]:
    """Say which command simulates by the setting that is advised; it replaces whole sections."""
    choice = None if study.still else advise(study).choice
    if choice is None:
        return []
    method, value = choice.method, choice.value
    solver = method.at(study.scene, value).solver
    options = ["--engine " + method.engine] if method.engine != "exudyn" else []
    options.append(f'--set "accuracy={{{method.knob}: {value:.3g}}}"')
    if solver != study.scene.solver:
        keys = ", ".join(f"{key}: {x}" for key, x in solver.model_dump(exclude_unset=True).items())
        options.append(f'--set "solver={{{keys}}}"')
    return [f"That is: {' '.join([command, *options])}"]


def _choice(study: Study, advice: Advice) -> str:
    goal = f"for {study.target:.2g} m"
    if advice.choice is not None:
        point = advice.choice
        error = f"{'below ' if point.below_floor else ''}{point.claimed:.1e} m"
        return f"{goal} choose {point.told} ({error}, {point.processor:.2g} s)"
    if advice.below_floor:
        return (
            f"{goal} nothing can be said: the references agree to {study.floor:.2g} m only; "
            "raise --budget, or --target"
        )
    if advice.best is None:
        return f"{goal} nothing can be said"
    best = advice.best
    return (
        f"{goal} no setting tried is accurate enough; the best is {best.told} "
        f"({best.claimed:.1e} m, {best.processor:.2g} s): raise --budget, or --target"
    )


def _limit(study: Study, advice: Advice) -> str:
    source = advice.limit
    if source is None:
        return ""
    error = f"{source.errors.largest:.1e} m"
    if source.kind == "rods":
        return f"; but the rods, not the steps, limit you: {error}, {_more_rods(study, source)}"
    stiffer = needed(1.0, source, study.target)
    return (
        "; but the contact's compliance, not the steps, limits you if it stands for a rigid one: "
        f"{error}, which would take some {stiffer:.3g} times the stiffness of a linear law"
    )


def _more_rods(study: Study, source: Source) -> str:
    links = beams(study.scene).values()
    count = max(rods_needed(body.rods, source, study.target) for body in links)
    advice = f"more than {MOST_RODS}" if count > MOST_RODS else f"about {float(f'{count:.2g}'):.0f}"
    equal = any(body.layout == "equal" for body in links)
    other = "; 'layout: half_ends' takes fewer" if equal else ""
    return f"a beam to {study.target:.2g} m takes {advice} rods{other}"


def _left_out(study: Study) -> list[str]:
    lines = [f"  {name}: {why}" for name, why in study.runs.left_out.items()]
    return ["Left out", *lines] if lines else []
