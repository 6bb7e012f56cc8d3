"""Campaigns of the 3D belt by lot: nothing, or one thing that is geometry, friction or the belt's own shape."""

import numpy as np

from belt_sim.campaign import Campaign
from belt_sim.virtual_rig.fault import overrides
from belt_sim.virtual_rig.library import LOT
from belt_sim.virtual_rig.make import checked_seed
from belt_sim.virtual_rig.seal import Truth
from belt_sim.virtual_rig.space import make_space_campaign

NOTHING = 0.3  # share of campaigns with nothing hidden
_SIZES = (0.5, 2.0)  # times the typical size
_BASE = "strip"


def random_space_campaign(seed: int) -> tuple[Campaign, Truth]:
    """One campaign measured in the scene by one process; a seed makes it again. Takes minutes."""
    rng = np.random.default_rng([checked_seed(seed), 3])
    hidden: list[str | dict] = []
    if rng.random() >= NOTHING:
        classes = [cls for cls in LOT if overrides(cls, "scene") and _BASE not in (*cls.idle_on, *cls.part_of)]
        cls = classes[int(rng.integers(len(classes)))]
        name, size = next(iter(cls.sizes.items()))
        value = min(size.typical * float(np.exp(rng.uniform(*np.log(_SIZES)))), size.limit)
        sign = 1.0 if cls.positive else float(rng.choice((-1.0, 1.0)))
        hidden = [{"id": cls.id, name: sign * value}]
    return make_space_campaign(hidden=hidden, seed=seed, base=_BASE, workers=1)
