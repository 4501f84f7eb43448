"""Engines made up by closed form, for work-precision studies: every error and cost is known."""

from dataclasses import replace
from math import inf, pi

import numpy as np
from results import MODEL, rigid_link

from exudyn_flexlink.accuracy import (
    RefusedError,
    Runs,
    Solved,
    judge,
    methods_of,
)
from exudyn_flexlink.accuracy.study import StudyRunner
from exudyn_flexlink.loading import load_scene

BOTH = {"exudyn": (), "lagrangian": ()}
SAMPLES = 200  # intervals of a turn at 10 rad/s: those of the made-up motion
SETTINGS = [
    "run.turns=1",
    f"run.sample={2 * pi / 10 / SAMPLES}",
    "bodies.link.rods=4",
    "bodies.link.hinges.stiffness=beam",
    "accuracy.tolerance=4e-5",
]
RODS = 2e-3  # m: error of S of one rod
CONTACT = 1e-4  # m: error of S at the model's stiffness, 2e4 N/m
TIP = 0.5  # of the error of S: that of the lever's tip


def scene_with(*settings):
    return load_scene(MODEL, [*SETTINGS, *settings])


class World:
    """Engines that shift the link by known errors; their cost passes on a clock of their own."""

    def __init__(self, refused=(), stop_after=inf, diverging=False, still=False):
        self.refused, self.stop_after = refused, stop_after
        self.diverging, self.still = diverging, still
        self.now, self.labels, self.kept = 0.0, [], {}

    def clock(self):
        return self.now

    def solve(self, scene, engine, label, allowed):
        if engine in self.refused:
            raise RefusedError(f"no {engine} here")
        if len(self.labels) >= self.stop_after:
            raise KeyboardInterrupt
        self.labels.append(label)
        accuracy = scene.accuracy
        cost = self.cost(engine, scene) * (scene.run.duration or 0.63) / 0.63
        if cost > allowed:
            self.now += allowed
            return Solved(self.motion(scene, 0.0), allowed, given_up=True)
        self.now += cost
        return Solved(self.motion(scene, self.error(engine, accuracy)), cost)

    @staticmethod
    def cost(engine, scene):
        """Second order: time goes as error^-1/2; the Lagrangian as error^-1/10."""
        accuracy = scene.accuracy
        if engine == "lagrangian":
            return 0.2 * (accuracy.tolerance / 1e-5) ** -0.1
        return 0.1 * ((accuracy.tolerance or 10 * accuracy.step**2) / 1e-5) ** -0.5

    @staticmethod
    def error(engine, accuracy):
        if engine == "lagrangian":
            return 0.1 * accuracy.tolerance
        return 0.5 * accuracy.tolerance if accuracy.tolerance else 100 * accuracy.step**2

    def motion(self, scene, error):
        link, law = scene.bodies["link"], None
        if scene.contacts:
            law = scene.contacts["strike"].law
        rods = getattr(link, "rods", 1)
        if rods not in self.kept:
            self.kept[rods] = rigid_link(1.0, SAMPLES + 1, scene_with(f"bodies.link.rods={rods}"))
        base = self.kept[rods]
        order = 2 if getattr(link, "layout", "") == "half_ends" else 1
        off = error + RODS / rods**order + CONTACT * (getattr(law, "stiffness", 2e4) / 2e4) ** -0.5
        poses = base.poses.copy()
        if self.still:
            poses[:] = poses[0]
            return replace(base, poses=poses, rates=0 * base.rates)
        own = [i for i, name in enumerate(base.part_names) if name.startswith("link")]
        poses[:, own, 0] += off
        poses[:, base.part_names.index("lever"), 1] += TIP * off
        if self.diverging:
            poses[:, own, 1] += error * 1e3 ** np.maximum(10 * base.time - 2, 0)[:, None]
        return replace(base, poses=poses)


def studied(world=None, scene=None, target=4e-5, budget=60.0):
    world, scene = world or World(), scene or scene_with()
    runs = Runs(scene, target, methods_of(scene, BOTH))
    return judge(StudyRunner(runs, world.solve, budget, world.clock).run())


def points_of(study, name):
    return [point for point in study.points if point.method.name == name]
