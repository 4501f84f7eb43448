"""The recorder of guide, link and levers: what is known of them at nodes and samples of steps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from exudyn_flexlink.arrays import ComplexArray, FloatArray
from exudyn_flexlink.engines.extremes import ExtremeSeeker
from exudyn_flexlink.engines.lagrangian.equations import momentum_rate
from exudyn_flexlink.engines.lagrangian.system import Motion, System, joined
from exudyn_flexlink.engines.recording import AT_ONCE, ROWS, BlockRecorder, Kept, Steps
from exudyn_flexlink.integrate.explicit import DenseStep
from exudyn_flexlink.integrate.radau import Step

Path = Step | DenseStep


class LinkKept(NamedTuple):
    """What is kept of the mechanism at instants (m,)."""

    poses: FloatArray  # (m, parts, 3)
    rates: FloatArray
    accelerations: FloatArray  # (m, N)
    momentum_rate: ComplexArray  # (m,) of the link, N
    motor: FloatArray  # (m,): torque of the speed drive, N m


class _Waiting(NamedTuple):
    t: float
    h: float
    motion: Motion  # at the nodes, then at samples


class Recorder(BlockRecorder):
    """Takes the steps of a system."""

    def __init__(self, system: System, grid: FloatArray, seeker: ExtremeSeeker) -> None:
        super().__init__(system.model.mechanism, grid, seeker, system.touches)
        self.system = system
        self._waiting: list[_Waiting] = []

    def due(self, step: Path) -> FloatArray:
        """Samples (n,), s, within a step."""
        return self._due(step.t + step.h)

    def begin(self, at: Motion) -> None:
        """Take the state (1,) at time 0."""
        self._start(self._known(at))

    def keep(self, at: Motion) -> None:
        """Keep a state (1,) as it is now, after what happened there."""
        self.work_off()
        self._keep_now(self._known(at))

    def take(self, step: Path, motion: Motion) -> None:
        """Take a step, known at its nodes and then at the samples that are `due` in it."""
        self._pass(step.t + step.h)
        self._waiting.append(_Waiting(step.t, step.h, motion))
        if len(self._waiting) >= AT_ONCE:
            self.work_off()

    def work_off(self) -> None:
        """Work off the steps that wait: the same contacts press in all of them."""
        if not self._waiting:
            return
        t, h, motions = (list(own) for own in zip(*self._waiting, strict=True))
        self._waiting.clear()
        counts = np.array([len(own.t) for own in motions])
        nodes = (np.cumsum(counts) - counts)[:, None] + ROWS
        samples = np.delete(np.arange(counts.sum()), nodes.ravel())
        of = np.repeat(np.arange(len(counts)), counts - len(ROWS))
        whole = joined(motions)
        known = self._known(whole)
        steps = Steps(np.array(t), np.array(h), nodes, samples, of)
        self._book(steps, known, self._rates(whole, known), known.pick(nodes[:, -1]))

    def _known(self, at: Motion) -> Kept:
        """What is known at instants, but for the totals."""
        model, count = self.system.model, len(at.t)
        a, held = self.system.accelerations(at)
        press = np.zeros((count, len(self.contacts)))
        if at.pushed is not None:
            press[:, at.pushed.which] = at.pushed.press
        press[:, self.system.held] = held
        motor = self.system.motor_torque(at, a, held)
        pressed = np.broadcast_to(self.touches.pressed, press.shape)
        places = (at.place + self.system.track.shift)[:, None]
        own = LinkKept(*model.poses(at.frame), a, momentum_rate(model.numbers, at.frame, a), motor)
        return Kept(at.t, places, press, pressed, np.zeros((count, 2)), own)

    def _rates(self, at: Motion, known: Kept) -> FloatArray:
        """Rates (m, ...) of the totals at instants."""
        count, v = len(self.contacts), at.frame.v
        rates = np.zeros((len(at.t), 2 + 2 * count))
        rates[:, 0] = ((v @ self.system.model.numbers.damping) * v).sum(axis=1)
        rates[:, 1] = known.own.motor * v[:, 0] + (at.motors * v).sum(axis=1)
        rates[:, 2 : 2 + count] = known.press
        if at.pushed is not None:
            rates[:, 2 + count + at.pushed.which] = at.pushed.power
        return rates

    def motion(self, at: Kept) -> tuple[FloatArray, FloatArray]:
        """Poses and rates (m, parts, 3) at instants that are kept."""
        return at.own.poses, at.own.rates
