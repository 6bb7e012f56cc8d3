"""How a march is laid out: records, steps a record, and room for others of its size."""

import math
from dataclasses import replace

import numpy as np

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.errors import InputError


def plan_steps(case: Case, *, travel: float, step: float, keep: float) -> tuple[int, int, int]:
    """(records, march steps a record, slots of the wrap's history) for a concrete case."""
    for name, length in (("travel", travel), ("step", step), ("keep", keep)):
        if not length > 0:
            raise InputError(name, length, "m", "give a positive length")
    records = max(1, math.ceil(travel / keep - 1e-9))
    stride = max(1, math.ceil(travel / records / step - 1e-9))
    spacing = travel / records / stride
    arcs = [np.max(case.rig.wrap_head), np.max(case.rig.wrap_tail)]
    if spacing > min(np.min(case.rig.wrap_head), np.min(case.rig.wrap_tail)):
        raise InputError("step", spacing, "m", "use a step shorter than the wrapped arc")
    slots = int(max(arcs) / spacing) + 3
    return records, stride, 8 * math.ceil(slots / 8)


def room_for(records: int) -> int:
    """Records that are marched for ``records``: code compiled for one travel serves others of its size."""
    size = 2 ** max(math.ceil(math.log2(records)) - 2, 4)
    return size * math.ceil(records / size)


def first(curves: Curves, records: int) -> Curves:
    """The first records of curves."""
    cut = {n: v[..., :records] for n, v in vars(curves).items() if v is not None and n not in ("extra", "sag")}
    return replace(curves, **cut)
