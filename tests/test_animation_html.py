"""The player: its numbers are the run's, it loads nothing, and it runs in a browser."""

import base64
import json
import re
from dataclasses import replace

import numpy as np
import pytest
import results
from browsing.chromium import browser, lacking
from pages import read_page

from exudyn_flexlink.animation import film_of, page, player
from exudyn_flexlink.animation.writing import film_data
from exudyn_flexlink.mechanism import Anchor, anchor_position
from exudyn_flexlink.result import MeasuredError


@pytest.fixture(scope="module")
def run():
    return results.rigid_link(samples=801)


def numbers(packed):
    [(kind, text)] = packed.items()
    return np.frombuffer(base64.b64decode(text), dtype=f"<{kind}")


def embedded(text):
    found = read_page(text).all("script")
    return [json.loads("".join(own.inside)) for own in found if "type" in own.attributes]


def test_the_page_has_the_numbers_of_the_run(run):
    [data] = embedded(page(film_of(run)))
    [take] = data["takes"]
    time = numbers(take["time"])
    assert set(time) <= set(run.time)
    at = np.searchsorted(run.time, time)
    poses = numbers(take["poses"]).reshape(len(time), take["parts"], 3)
    assert poses == pytest.approx(run.poses[at], rel=1e-6, abs=1e-8)
    assert numbers(take["crank"]) == pytest.approx(results.SPEED * time)
    s = Anchor(**take["points"]["S"])
    assert anchor_position(s, poses)[:, 0].max() == pytest.approx(0.11, abs=1e-6)
    [strike] = take["touching"]
    touches = run.contacts["strike"].touches
    assert numbers(strike["begin"]).tolist() == touches.begin.tolist()
    assert numbers(strike["end"]).tolist() == touches.end.tolist()
    assert numbers(strike["strength"]) == pytest.approx(touches.peak_force)


def test_forces_of_walls_are_stored_where_they_press(tilting):
    [take] = film_data(film_of(tilting))["takes"]
    [own] = take["touching"]
    time, sleeve = numbers(take["time"]), tilting.sleeves["sleeve"]
    dense = np.zeros((len(time), len(sleeve.pairs)))
    first, pair, force = (numbers(own[name]) for name in ("first", "pair", "force"))
    for i in range(len(time)):
        here = slice(first[i], first[i + 1])
        dense[i, pair[here]] = force[here]
    exact = np.stack([np.interp(time, tilting.time, column) for column in sleeve.force.T], axis=1)
    assert dense == pytest.approx(exact, rel=1e-6)
    assert take["zooms"][0]["guide"]["clearance"] == results.PLAY


def test_the_page_loads_nothing(run):
    text = page(film_of(run))
    for one in read_page(text).all():
        assert not {"src", "href", "data", "action"} & set(one.attributes)
    program = re.sub(r'<script type="application/json">.*?</script>', "", text, flags=re.DOTALL)
    for word in ("http:", "https:", "//cdn", "@import", "url(", "fetch(", "XMLHttpRequest",
                 "import(", "WebSocket", "sendBeacon"):  # fmt: skip
        assert word not in program


def test_a_title_cannot_end_the_data_or_become_markup(run):
    title = "</script><script>alert(1)</script> & <b>"
    odd = replace(run, scene=run.scene.changed(title=title))
    text = page(film_of(odd))
    assert "<script>alert" not in text
    [data] = embedded(text)
    assert data["title"] == title


@pytest.fixture(scope="module")
def window():
    if lacking():
        pytest.skip("no Chromium, to look at pages with")
    with browser() as opened:
        yield opened


def seen_in(window, text, tmp_path, looks, width=1280):
    """What a program, which sees the players of a page, returns in a browser; errors fail."""
    file = tmp_path / "page.html"
    file.write_text(text, encoding="utf-8")
    window.open(file, width, 844)
    told = window.value(
        "(() => { const players = [...document.querySelectorAll('.flexlink-player')]"
        f".map((own) => own.flexlinkPlayer); {looks} }})()"
    )
    assert window.complaints == []
    assert window.asked == [file.as_uri()]
    return told


def test_a_browser_shows_where_things_are(run, tilting, window, tmp_path):
    film, link = film_of(run), film_of(tilting)
    instants = [0.0, 0.1234, 0.7, 2.5]
    text = f"<body>{player(film)}{player(link)}</body>"
    told = seen_in(window, text, tmp_path, f"""
        const [one, two] = players;
        const places = {instants}.map((t) => {{
          one.go(t);
          const S = one.takes[0].data.points.S;
          return one.takes[0].at(S.part, S.x, S.y);
        }});
        const [link] = two.takes;
        const force = (t) => {{ two.go(t); return link.pressing(link.touching[0]); }};
        one.go(99); one.step(-1); one.change(1); one.change(-1); one.switch("follows");
        one.look(7, [0, 0]); one.play(); one.pause();
        return {{places, force: force(1.1), ends: one.t, count: players.length,
                 words: one.root.innerText, slider: one.line.getAttribute("aria-valuetext")}};
    """)  # fmt: skip
    assert told["count"] == 2
    s = film.takes[0].watched
    exact = anchor_position(s, film.takes[0].poses(np.array(instants)))
    assert np.array(told["places"]) == pytest.approx(exact, abs=film.size / 2000)
    shown = dict(told["force"])
    at = [np.interp(1.1, tilting.time, column) for column in tilting.sleeves["sleeve"].force.T]
    pressing = {k: f for k, f in enumerate(at) if f > 0}
    assert set(shown) == set(pressing)
    assert sum(shown.values()) == pytest.approx(sum(pressing.values()), rel=0.1)
    assert told["slider"].startswith("t = 2.5")
    assert "crank" in told["slider"]


def test_a_player_fits_a_phone_and_tells_what_lies_beyond_the_horizon(run, window, tmp_path):
    error = MeasuredError(("link.end",), limit=1e-6, largest=2e-3, horizon=0.7)
    both = film_of(run, replace(run, error=error))
    for width in (390, 1280):
        told = seen_in(window, page(both), tmp_path, """
            const [one] = players;
            one.pause();
            const words = [0.6, 0.8].map((t) => { one.go(t); return one.told.innerText; });
            return [document.documentElement.scrollWidth, ...words];
        """, width)  # fmt: skip
        assert told[0] == width
        assert "horizon" not in told[1]
        assert "beyond the horizon: two runs part" in told[2]
