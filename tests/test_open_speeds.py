"""Speeds at time 0 that nothing decides: least, whatever axes and units bodies are written in."""

import numpy as np
import pytest
from test_mechanism_assembly import assembled, pin, rods


@pytest.mark.parametrize("up", [0.0, 4.0, -1.5])
@pytest.mark.parametrize(
    ("drive", "initial", "trolley", "load"),
    [
        ("drives: {go: {type: speed, joint: rail, value: 2}}\n", "", 2.0, 0.0),
        ("", "speeds: {load: 1}", 0.0, 1.0),
        ("", "speeds_along: {rail: 3}, speeds: {load: 1}", 3.0, 1.0),
    ],
)
def test_speeds_that_are_left_open_do_not_depend_on_a_body_s_axes(
    up, drive, initial, trolley, load
):
    """A load hangs on a trolley: it does not turn, and the trolley stands, unless they have to."""
    found = assembled(
        "bodies:\n"
        "  trolley: {type: rigid, mass: 500, inertia: 100, points: {pin: [0, 0]}}\n"
        f"  load: {{type: rigid, mass: 1000, inertia: 500, points: {{hook: [0, {up}]}},"
        f" centre_of_mass: [0, {up - 4}]}}\n"
        "joints:\n"
        "  rail: {type: prismatic, points: [ground, trolley.pin], at: [0, 0], axis: [1, 0]}\n"
        "  hook: {type: revolute, points: [trolley.pin, load.hook]}\n"
        f"{drive}initial: {{along: {{rail: 0}}, {initial}}}\n"
    )
    assert found.state.v == pytest.approx(
        np.array([[trolley, 0, 0], [trolley + up * load, 0, load]]), abs=1e-11
    )


def test_pendulums_in_a_row_hang_still_but_for_those_that_are_told_to_turn():
    bars = "".join(
        f"  {name}: {{type: rigid, mass: 1, inertia: 0.1,"
        f" points: {{a: [{a}, 0], b: [{a + 1}, 0]}}}}\n"
        for name, a in (("p", 0), ("q", -0.5), ("r", 0.25))
    )
    joints = pin("A", "ground", "p.a", "[0, 0]") + pin("B", "p.b", "q.a") + pin("C", "q.b", "r.a")
    found = assembled(
        f"bodies:\n{bars}joints:\n{joints}"
        "initial: {angles: {p: -90 deg, q: -60 deg, r: -80 deg}, speeds: {p: 3}}\n"
    )
    assert found.state.v[:, 2] == pytest.approx([3, 0, 0], abs=1e-13)


def test_a_long_chain_whose_ends_are_told_to_turn_hangs_still_between_them():
    count = 60
    bars = "".join(
        f"  b{k}: {{type: rigid, mass: 1, inertia: 0.1, points: {{a: [0, 0], b: [1, 0]}}}}\n"
        for k in range(count)
    )
    joints = pin("j0", "ground", "b0.a", "[0, 0]")
    joints += "".join(pin(f"j{k}", f"b{k - 1}.b", f"b{k}.a") for k in range(1, count))
    told = f"initial: {{speeds: {{b0: 1, b{count - 1}: 3}}}}\n"
    found = assembled(f"bodies:\n{bars}joints:\n{joints}{told}")
    assert found.state.v[:, 2] == pytest.approx([1, *[0] * (count - 2), 3], abs=1e-10)


def test_a_loop_shares_what_it_leaves_open_of_its_angular_speeds():
    """Five bars: of two freedoms one is given; the sum of the squares of the others is least."""
    found = assembled(
        rods(a=0.1, b=0.3, c=0.2, d=0.25)
        + "joints:\n"
        + pin("A", "ground", "a.start", "[0, 0]")
        + pin("B", "a.end", "b.start")
        + pin("C", "b.end", "c.start")
        + pin("D", "c.end", "d.start")
        + pin("E", "ground", "d.end", "[0.45, 0]")
        + "initial: {angles: {a: 60 deg, b: 30 deg}, guesses: {c: -40 deg, d: -70 deg},"
        " speeds: {a: 2}}\n"
    )
    angles, speeds = found.state.q[:, 2], found.state.v[:, 2]
    arms = np.array([0.1, 0.3, 0.2, 0.25]) * np.array([-np.sin(angles), np.cos(angles)])
    free = -np.linalg.pinv(arms[:, 1:]) @ arms[:, 0] * 2  # least squares by another way
    assert speeds == pytest.approx([2, *free], abs=1e-12)
