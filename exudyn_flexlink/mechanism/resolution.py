"""How long contacts last, and how short steps are in them where a number of steps resolves them."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

from exudyn_flexlink.laws import Impulse, RestitutionPenalty
from exudyn_flexlink.mechanism.assembly import Assembly
from exudyn_flexlink.mechanism.contact_pairs import Channel, Contact
from exudyn_flexlink.mechanism.dynamics import contact_mass
from exudyn_flexlink.scene import Scene

WALL_SHARE = 0.5  # of the steps of a strike: a wall presses longer than it strikes
ELASTIC = 0.99  # restitution of an impact that must not lose energy by its steps either
ELASTIC_STEPS = 2.0  # times the steps there: 60 lose 1e-5 of the energy in an impact, 120 an eighth


@dataclass(frozen=True)
class Resolution:
    """Half the period of a contact's stiffness with the least mass on it, and its step, s."""

    half_period: float
    step: float

    def steps(self, given: float | None) -> float:
        """Steps of the contact where the user gave a step (s), which may be shorter."""
        return self.half_period / min(self.step, given or inf)


def resolution_of_strike(half_period: float, law: RestitutionPenalty, asked: int) -> Resolution:
    """Return the resolution of a strike (half a period in s) that the scene asks so many steps for.

    An elastic impact takes more of them: see `ELASTIC_STEPS`.
    """
    steps = asked * (ELASTIC_STEPS if law.restitution > ELASTIC else 1.0)
    return Resolution(half_period, half_period / steps)


def resolution_of_wall(half_period: float, asked: int) -> Resolution:
    """Return the resolution of a touch of a wall, where a scene asks so many steps for a strike."""
    return Resolution(half_period, half_period / (WALL_SHARE * asked))


def resolutions(scene: Scene, assembly: Assembly) -> list[Resolution]:
    """Resolutions of contacts and bearings, then of sleeves; none of contacts that take no time."""
    mechanism, asked = assembly.mechanism, scene.solver.steps_per_contact
    strikes = [
        resolution_of_strike(half_period(assembly, contact), contact.law, asked)
        for contact in mechanism.touching
        if isinstance(contact.law, RestitutionPenalty)
    ]
    walls = [resolution_of_wall(half_period(assembly, c), asked) for c in mechanism.channels]
    return strikes + walls


def contact_step(scene: Scene, assembly: Assembly) -> float:
    """Step that resolves the shortest contact as the scene asks, s; inf without contacts."""
    return min((own.step for own in resolutions(scene, assembly)), default=inf)


def half_period(assembly: Assembly, contact: Contact | Channel) -> float:
    """Half the period of a stiffness with the least mass behind it, s; inf of a rigid contact."""
    if isinstance(contact.law, Impulse):
        return inf
    state = assembly.state
    mass = contact_mass(assembly.mechanism, contact, state.q, state.places)
    return contact.law.half_period(mass)
