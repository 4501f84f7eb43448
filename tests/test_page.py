"""The report of a run as a page: what is in it, held against the run, and what may never be."""

import base64
import hashlib
import re
from dataclasses import replace
from itertools import pairwise
from math import degrees

import numpy as np
import pytest
from pages import read_page, tables_of
from results import BLOCK, result_of, rigid_link, scene_from, stopped

from exudyn_flexlink.loading import scene_of
from exudyn_flexlink.mechanism import build_mechanism
from exudyn_flexlink.observables import force_peaks, lever_response, strikes
from exudyn_flexlink.page import page_of
from exudyn_flexlink.result import Extremes, ForceDeviation, ForceSpread, MeasuredError, Outcome
from exudyn_flexlink.source import parse_document

LARGEST = 3_000_000  # bytes: a page that is sent by mail, and read on a phone
EVIL = "<script>alert('title')</script> & <img src=x onerror=alert(1)>"
ADDRESSES = ("src", "srcset", "href", "action", "poster", "data", "background", "formaction")


@pytest.fixture(scope="module")
def whole():
    """Return the page of the paper's run, with its figures."""
    return page_of(rigid_link())


@pytest.fixture
def told(monkeypatch):
    """Return a function that reads the page of a run without its figures, which take seconds."""
    monkeypatch.setattr("exudyn_flexlink.page.pictures_of", lambda _: {})
    return lambda result: read_page(page_of(result))


def slider():
    """Return a block that slides in a slot: nothing turns, nothing strikes."""
    scene = scene_from(BLOCK)
    time = np.linspace(0, 1, 101)
    q = np.zeros((101, len(build_mechanism(scene).parts), 3))
    q[:, 0, 0] = 0.1 * time
    made = result_of(scene, time, q)
    return replace(made, warnings=())


# --- the page ---------------------------------------------------------------------------------


def test_the_page_is_well_formed_and_can_be_read_aloud(whole):
    page = read_page(whole)
    assert page.all("html")[0].attributes["lang"] == "en"
    assert len(page.all("h1")) == 1
    assert page.all("title")[0].words == page.all("h1")[0].words
    levels = [int(one.tag[1]) for one in page.all("h1", "h2", "h3")]
    assert all(after <= before + 1 for before, after in pairwise(levels))
    ids = [one.attributes["id"] for one in page.all() if "id" in one.attributes]
    assert len(set(ids)) == len(ids)
    links = [one.attributes["href"] for one in page.all("a")]
    assert {link[1:] for link in links if link.startswith("#")} <= set(ids)
    assert all(len(image.attributes["alt"]) > 20 for image in page.all("img"))
    for table in page.all("table"):
        assert [one.words != "" for one in table.all("caption")] == [True]
        assert all(cell.attributes["scope"] in ("row", "col") for cell in table.all("th"))
    for section in page.all("section"):
        assert section.attributes["aria-labelledby"] in ids


def test_the_page_is_small_and_loads_nothing(whole):
    assert len(whole.encode("utf-8")) < LARGEST
    page = read_page(whole)
    for one in page.all():
        for name in ADDRESSES:
            address = one.attributes.get(name, "#")
            assert address.startswith(("#", "data:")), (one.tag, name, address[:60])
        assert not [name for name in one.attributes if name.startswith("on")]
    assert not page.all("link", "iframe", "object", "embed", "base")
    for style in page.all("style"):
        assert "url(" not in str(style.inside)
        assert "@import" not in str(style.inside)


def test_a_browser_may_run_the_player_and_nothing_else(whole):
    page = read_page(whole)
    (policy,) = (m for m in page.all("meta") if "Policy" in m.attributes.get("http-equiv", ""))
    told = policy.attributes["content"].split("; ")
    assert told[:2] == ["default-src 'none'", "img-src data:"]
    (run,) = (one for one in page.all("script") if "type" not in one.attributes)
    digest = base64.b64encode(hashlib.sha256("".join(run.inside).encode()).digest()).decode()
    assert told[-1] == f"script-src 'sha256-{digest}'"
    (section,) = (one for one in page.all("section") if one.attributes["id"] == "animation")
    assert section.all("script") == page.all("script")


# --- numbers ----------------------------------------------------------------------------------


def test_strikes_are_those_of_the_run(told):
    run = rigid_link()
    head, *rows = tables_of(told(run))["Strikes of contact 'strike'"]
    assert head == ["lap", "angle of crank (deg)", "time (s)", "approach (m/s)", "place (m)",
                    "lever peak (rad)", "lasts (s)", "touches", "impulse (N s)",
                    "energy lost (J)", "peak force (N)"]  # fmt: skip
    found = strikes(run, "strike")
    assert len(rows) == len(found) == 2
    for row, strike in zip(rows, found, strict=True):
        numbers = [float(cell) for cell in row]
        assert numbers[0] == strike.lap
        assert numbers[1] == pytest.approx(degrees(strike.crank_angle or 0.0) % 360, abs=5e-3)
        exact = [strike.begin, strike.approach_speed, strike.place]
        assert numbers[2:5] == pytest.approx(exact, abs=5e-5)
        assert numbers[6:8] == [pytest.approx(strike.end - strike.begin, abs=5e-6), 2]
        passed = [strike.impulse, strike.energy_lost, strike.peak_force]
        assert numbers[8:] == pytest.approx(passed, rel=1e-3)
    peaks = [float(row[5]) for row in rows]
    assert min(peaks) == pytest.approx(lever_response(run, "strike").least[0], abs=5e-6)


def test_forces_and_energies_are_those_of_the_run(told):
    run = rigid_link()
    found = tables_of(told(run))
    rows = {row[0]: row[1:] for row in found["Largest forces and torques"][1:]}
    peaks = force_peaks(run)
    assert list(rows) == list(peaks)
    for name, peak in peaks.items():
        value, _, unit = rows[name][0].partition(" ")
        assert float(value) == pytest.approx(peak.value, rel=1e-3)
        assert unit == peak.unit
    assert rows["contact force of strike"][0] == "0.4 N"  # made up so, in `results`
    energies = {row[0].split()[0]: row[1:] for row in found["Energies of all parts together"][1:]}
    for name in ("kinetic", "stored", "dissipated", "supplied"):
        values = getattr(run.energy, name)
        told_ = [float(cell) for cell in energies[name]]
        assert told_[:2] == pytest.approx([values[0], values[-1]], rel=1e-3)
        assert abs(told_[2]) == pytest.approx(np.max(np.abs(values)), rel=1e-3)


def test_the_largest_of_a_force_comes_from_every_step():
    """Contacts' own extremes, not samples; and no number for an impulse, which has no bound."""
    run = rigid_link()
    exact = Extremes(np.array([0.3, 0.4]), np.array([0.5, 0.7]))
    run = replace(run, extremes={**run.extremes, "strike.force_N": exact})
    assert force_peaks(run)["contact force of strike"].value == 0.7
    own = run.contacts["strike"]
    forces = np.full(len(own.touches), np.inf)
    hit = replace(own, touches=replace(own.touches, peak_force=forces))
    assert "contact force of strike" not in force_peaks(replace(run, contacts={"strike": hit}))


def test_errors_and_the_horizon_are_told(told):
    spread = ForceSpread(0.03, 0.2, 0.01, 0.4)
    error = MeasuredError(
        points=("link.end",), worst="link.end", limit=1e-5, largest=3e-3, exceeds_from=1.25,
        forces={"slot force of pin": ForceDeviation("N", spread, None)}, horizon=1.5,
    )  # fmt: skip
    found = tables_of(told(replace(rigid_link(), error=error)))
    errors = dict(found["How far the run is off"])
    assert errors["positions"].startswith("link.end within 1e-05 m, as asked, up to t = 1.25 s")
    assert dict(found["The run"])["positions"] == errors["positions"]
    caption = "Errors of forces, as a second run tells, up to t = 1.5 s"
    assert found[caption][1] == ["slot force of pin", "0.03 N", "7.5 %", "0.20000 s", "0.01 N"]
    rows = {row[0]: row for row in found["Largest forces and torques"][1:]}
    assert rows["slot force of pin"][3] == "0.03 N"


# --- runs that end otherwise, and scenes with less ------------------------------------------------


def test_a_run_that_ended_early_says_why(told):
    """One that the user interrupted did not fail."""
    failed = stopped(rigid_link())
    outcome = told(failed).all("section")[0].words
    assert outcome.startswith("Outcome Stopped before its end")
    own = failed.outcome
    assert f"the run stopped at {own.time:g} s: {own.reason} try: {own.advice}" in outcome
    ended = told(replace(failed, outcome=Outcome(False, 0.5, "interrupted"))).all("section")[0]
    assert ended.words.startswith("Outcome Interrupted")
    assert "Stopped" not in ended.words


def test_a_page_speaks_of_no_parts_that_a_scene_has_not():
    page = read_page(page_of(slider()))
    keys = [section.attributes["id"] for section in page.all("section")]
    parts = ("mechanism", "animation", "motion", "forces", "energy", "effects", "errors")
    assert keys == ["outcome", *parts, "model"]
    (model,) = (one for one in page.all("section") if one.attributes["id"] == "model")
    alts = " ".join(image.attributes["alt"] for image in page.all("img"))
    said = f"{page.words.replace(model.words, '')} {alts}".lower()
    for word in ("crank", "lever", "guide", "link", "strikes", "touches", "lap"):
        assert not re.search(rf"\b{word}\b", said.replace("support in the guide", "")), word


# --- foreign text ---------------------------------------------------------------------------


def test_foreign_text_stays_text(told):
    run = rigid_link()
    scene = run.scene.changed(title=EVIL, source=EVIL)
    outcome = Outcome(False, 0.5, EVIL, EVIL)
    page = told(replace(run, scene=scene, warnings=(EVIL,), outcome=outcome))
    assert not page.all("img")
    assert len(page.all("script")) == len(told(run).all("script")) == 2
    assert page.all("title")[0].words == page.all("h1")[0].words == EVIL
    assert page.words.count(EVIL) >= 5  # in title and heading, source, warning, reason, advice


# --- how to run it again ------------------------------------------------------------------------


def model_of(page):
    """Return the model file that a page offers, which its reader also sees."""
    (link,) = (one for one in page.all("a") if "download" in one.attributes)
    content = base64.b64decode(link.attributes["href"].partition(";base64,")[2]).decode("utf-8")
    (shown,) = (one for one in page.all("pre") if one.attributes.get("id") == "scene")
    assert shown.text == content
    return content


def test_the_model_of_a_page_is_that_of_the_run(told):
    run = rigid_link()
    scene = run.scene.changed(title=f'{EVIL} "a: b" # \u00fc', source="it's\n  'assumed'")
    page = told(replace(run, scene=scene))
    assert scene_of(parse_document(model_of(page), "model.yaml")) == scene
    assert "exudyn-flexlink simulate model.yaml" in page.words
