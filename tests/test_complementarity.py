"""Impacts of several contacts that rub, as one complementarity problem: numbers by enumeration.

All values were made by an enumeration of modes and by a projected iteration from three starts,
which agree to 1e-14.
"""

from math import cos, radians, sin

import numpy as np
import pytest

from exudyn_flexlink.integrate.complementarity import rubbing_impact


def meet(body, before, restitution, friction):
    """Speeds after, impulses across and along, and the energy gained.

    The `body` is a mass, an inertia and contacts: arms from the centre, and angles of normals from
    up; tangents are the normals turned by -90 degrees.
    """
    mass, inertia, contacts = body
    rows = []
    for turned in (0, -90):
        for (x, y), angle in contacts:
            way = radians(90 + angle + turned)
            across = cos(way), sin(way)
            rows.append([*across, x * across[1] - y * across[0]])
    rows, inverse = np.array(rows), np.diag([1 / mass, 1 / mass, 1 / inertia])
    count, before = len(contacts), np.array(before, dtype=float)
    speeds = rows @ before
    hit = rubbing_impact(
        rows @ inverse @ rows.T,
        speeds,
        np.full(count, restitution),
        np.full(count, friction),
    )
    after = before + inverse @ rows.T @ np.concatenate([hit.across, hit.along])
    assert rows @ after == pytest.approx(np.concatenate([hit.gap_rate, hit.slip]), abs=1e-12)
    of = np.array([mass, mass, inertia])
    return after, hit.across, hit.along, 0.5 * (of * after**2 - of * before**2).sum()


def block(a, b, mass=2.0):
    """Mass, inertia and rear and front corner of a block of half width a and half height b."""
    return mass, mass * (a * a + b * b) / 3, [((-a, -b), 0), ((a, -b), 0)]


LANDINGS = [
    # a, b, mu, e, before, N, T, after, energy
    (
        0.1,
        0.05,
        0.3,
        0.5,
        (1.5, -1, 0),
        (1.275, 1.725),
        (-0.3825, -0.5175),
        (1.05, 0.5, 0),
        -1.8975,
    ),
    (0.1, 0.05, 0.4, 0.5, (0.5, -1, 0), (1.25, 1.75), None, (0, 0.5, 0), -1),
    (
        *(0.1, 0.2, 0.6, 0.5, (3, -1, 0), (0, 3.409090909), (0, -2.045454545)),
        *((1.977272727, 0.7045454545, -2.045454545), -5.52427686),
    ),
    (0.1, 0.2, 0.8, 0.5, (3, -1, 0), (0, 4.35), (0, -3.3), (1.35, 1.175, -6.75), -6.0375),
    (0.1, 0.2, 0.8, 0, (3, -1, 0), (0, 3.125), (0, -2.5), (1.75, 0.5625, -5.625), -6.09375),
]


@pytest.mark.parametrize(
    ("a", "b", "friction", "restitution", "before", "across", "along", "after", "gained"),
    LANDINGS,
    ids=["slides", "sticks", "tips and slides", "tips and sticks", "without restitution"],
)
def test_a_block_lands_flat(*, a, b, friction, restitution, before, across, along, after, gained):
    """Both corners press where |T| b <= a N; else it tips over the front one."""
    ended, pressed, rubbed, energy = meet(block(a, b), before, restitution, friction)
    assert ended == pytest.approx(after, abs=1e-9)
    assert pressed == pytest.approx(across, abs=1e-9)
    assert energy == pytest.approx(gained, abs=1e-8)
    if along is None:  # how both share it is not unique; each keeps to its bound
        assert rubbed.sum() == pytest.approx(-1)
        assert (np.abs(rubbed) <= friction * pressed + 1e-12).all()
    else:
        assert rubbed == pytest.approx(along, abs=1e-9)


def flanks(angle, radius):
    """Where a disc touches both flanks of a groove; the first one's normal leans to the right."""
    sides = [-angle, angle]
    return [((radius * sin(radians(t)), -radius * cos(radians(t))), t) for t in sides]


@pytest.mark.parametrize(
    ("angle", "friction", "restitution", "before", "across", "along", "after"),
    [
        (45, 0.2, 0.3, (0, -1, 40), (0.5303300859, 0.3535533906), (-0.1060660172, -0.07071067812),
         (0, 0.3, 25.85786438)),
        (45, 0.2, 0.3, (0.3, -1, 0), (0.4485708643, 0.687219403), (0.08971417286, -0.1268372789),
         (-0.09, 0.3, -2.969848481)),
        (45, 0.25, 0.5, (0.6, -1, 20), (0.45254834, 0.9616652224), (0.113137085, -0.2404163056),
         (-0.3, 0.5, 9.817662351)),
        (60, 0.3, 0.4, (0.2, -1, 10), (1.388269386, 1.526061216), (0.4164808157, -0.4578183648),
         (-0.08, 0.4, 6.692996073)),
    ],
)  # fmt: skip
def test_a_disc_falls_into_a_groove(*, angle, friction, restitution, before, across, along, after):
    """Both flanks are touched at once."""
    mass, radius = 0.5, 0.05
    disc = mass, mass * radius**2 / 2, flanks(angle, radius)
    ended, pressed, rubbed, _ = meet(disc, before, restitution, friction)
    assert ended == pytest.approx(after, abs=1e-8)
    assert pressed == pytest.approx(across, abs=1e-8)
    assert rubbed == pytest.approx(along, abs=1e-8)


ROD = 1.0, 1 / 12, [((-0.5, 0), 0), ((0.5, 0), 0)]


@pytest.mark.parametrize(
    ("before", "across", "along", "after"),
    [
        ((2, -1, -2), (0.5, 1), -0.3, (1.7, 0.5, 1)),
        ((0.1, -1, -2), (0.5, 1), -0.1, (0, 0.5, 1)),
    ],
    ids=["slides", "sticks"],
)
def test_an_end_that_rests_is_pressed_as_the_other_strikes(before, across, along, after):
    """A rod lies down: its left end touches without closing, and takes part."""
    ended, pressed, rubbed, _ = meet(ROD, before, 0.5, 0.2)
    assert ended == pytest.approx(after, abs=1e-12)
    assert pressed == pytest.approx(across, abs=1e-12)
    assert rubbed.sum() == pytest.approx(along, abs=1e-12)


@pytest.mark.parametrize(
    ("a", "b", "turning", "friction", "restitution", "after"),
    [
        (0.05, 0.15, -1.2, 0.8, 0, (0.153, 0.051, -1.02)),
        (0.15, 0.05, -1.2, 0.8, 0, (0, 0, 0)),
        (0.1, 0.1, -1.2, 0.8, 0, (0.03, 0.03, -0.3)),
        (0.1, 0.1, -1.2, 0.3, 0.4, (0.0696, 0.048, 0.48)),
    ],
    ids=["slender", "flat", "square", "bounces"],
)
def test_a_rocking_block_keeps_less_of_its_turning(*, a, b, turning, friction, restitution, after):
    """Housner, 1963: 1 - 3a^2/(2(a^2 + b^2)) of it, and none where that is negative."""
    before = -turning * b, turning * a, turning
    ended, _, _, gained = meet(block(a, b, 1.0), before, restitution, friction)
    assert ended == pytest.approx(after, abs=1e-12)
    assert gained < 0


def test_an_answer_that_gains_energy_is_refused():
    """A rod at 40 degrees strikes with its lower end, elastically, with much friction."""
    lower = [((-0.5 * cos(radians(40)), -0.5 * sin(radians(40))), 0)]
    with pytest.raises(ArithmeticError, match="gain energy"):
        meet((1.0, 1 / 12, lower), (0.1, -1, 5.8), 1, 0.8)


def test_a_groove_wedges_beyond_a_friction():
    """With restitution there is an answer up to mu = tan 20 degrees, as the flanks are at 70."""
    disc = 0.5, 0.5 * 0.05**2 / 2, flanks(70, 0.05)
    meet(disc, (0, -1, 10), 0.3, 0.36)
    with pytest.raises(ArithmeticError, match="no impulses fit"):
        meet(disc, (0, -1, 10), 0.3, 0.37)
    assert meet(disc, (0, -1, 10), 0, 0.37)[0] == pytest.approx((0, 0, 0), abs=1e-12)


def test_a_sliding_block_that_may_jam_or_not_is_refused():
    """Beyond mu = (1 + a^2/I)/(a b/I) the front corner may catch, though nothing closes."""
    low = block(0.06, 0.1, 1.0)
    assert meet(low, (0.3, 0, 0), 0, 1.3)[0] == pytest.approx((0.3, 0, 0))
    with pytest.raises(ArithmeticError, match="more than one answer"):
        meet(low, (0.3, 0, 0), 0, 2.1)


def test_no_more_than_six_contacts_rub_together():
    """4 096 modes are tried."""
    with pytest.raises(ArithmeticError, match="6 contacts at most"):
        meet((1.0, 1.0, [((0.1 * k, 0), 0) for k in range(7)]), (0, -1, 0), 0, 0.1)
