"""A workbench whose model is a sum of shapes: what is right can be written down, and nothing is compiled."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np

from belt_sim.campaign import SignalSheet
from belt_sim.diagnosis.forward import Forward, Slot
from belt_sim.diagnosis.noise import LevelFinder, Levels, metric_of
from belt_sim.diagnosis.samples import Samples
from belt_sim.diagnosis.workbench import Workbench
from belt_sim.effects.base import Parameter

YAW, SPACING = 7e-4, 0.5
WHITE = SignalSheet(name="y1", at="point_1", kind="lateral", unit="mm", white=1e-5)
NUMBER = Parameter(unit="1", meaning="how much of its shape", plausible=(-1e9, 1e9), scale=1.0)


def run(tension=7e6, yaw=YAW):
    return SimpleNamespace(
        name=f"{tension:g} {yaw:g}", tension=tension, yaw=yaw, yaw_head=0.0, speed=0.5, direction=1.0, yaw_at=0.0,
        y0=None, use="fit", runs_already=False,
    )  # fmt: skip


REPEATS = (run(), run())
SPREAD = tuple(run(t, yaw) for t in (7e6, 14e6, 40e6) for yaw in (YAW, -YAW))


class Sum:
    """Predictions that are each effect's shape times its one number; shapes: id -> (R, S, n)."""

    def __init__(self, shapes):
        self.classes = tuple(
            SimpleNamespace(id=i, parameters={"size": NUMBER}, is_additive=lambda: False) for i in shapes
        )
        self.slots = tuple(Slot(c, "size") for c in self.classes)
        self.rows, self.size = np.stack(list(shapes.values())), len(shapes)
        self.sides = np.full(self.size, -np.inf), np.full(self.size, np.inf)

    def index(self, name):
        return [k for k, c in enumerate(self.classes) if c.id == name]

    def grids(self, name):
        return {}

    def null(self):
        return np.zeros(self.size)

    def values(self, vectors):
        return np.einsum("ck,krsn->crsn", vectors, self.rows)

    def values_and_slopes(self, vectors, directions):
        return self.values(vectors), self.values(directions)

    expand = Forward.expand


def linear_bench(runs, signal=WHITE, *, count=40, per_bin=1.0, levels=None, y=None, shapes=None) -> Workbench:
    """One signal, read ``count`` times a run half a metre apart; no nuisances; y (R, 1, count): readings."""
    still = np.zeros((len(runs), 1, count))
    travel = np.tile(np.arange(count) * SPACING, (len(runs), 1))
    rig = SimpleNamespace(span_length=11.28, tail_radius=0.2, belt_length=23.8)
    samples = Samples(
        runs=runs, signals=(signal,), cases=SimpleNamespace(rig=rig), travel=travel, time=2.0 * travel,
        y=still if y is None else y, yaw_at=np.zeros(len(runs)), per_bin=np.full(len(runs), per_bin),
    )  # fmt: skip
    levels = levels or Levels()
    return Workbench(
        campaign=None, samples=samples, fitted=samples, forward=Sum(shapes or {"a": still}), levels=levels,
        finder=LevelFinder(samples, still[None]), shapes=still[None], shared=still[None],
        metric=metric_of(samples, levels, still[None], still[None]),
    )  # fmt: skip


def with_readings(bench, y):
    """A workbench that fits to readings y (R, S, n), judged on the same scale."""
    return replace(bench, metric=replace(bench.metric, samples=replace(bench.metric.samples, y=y)))
