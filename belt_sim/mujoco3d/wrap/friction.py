"""Coulomb friction of landed nodes: how far they slide until no node pulls harder than friction allows."""

import math
from dataclasses import dataclass, field

import numpy as np

from belt_sim.mujoco3d.wrap.coulomb import slide
from belt_sim.mujoco3d.wrap.hold import Wrap
from belt_sim.mujoco3d.wrap.tangent import Tangent


@dataclass
class Friction:
    """A return mapping on the holding forces of a wrap, as one system, without inertia.

    friction [1], inf = sticking; tangent: in-plane stiffness of the landed belt, None = not needed; slip [m]: lateral
    way the belt has slid on the head and the tail pulley, mean over the wrap.
    """

    friction: float
    tangent: Tangent | None
    slip: np.ndarray = field(default_factory=lambda: np.zeros(2))

    @property
    def acts(self) -> bool:
        """Whether nodes can slide at all."""
        return self.tangent is not None and not math.isinf(self.friction)

    def apply(self, wrap: Wrap, which: int, holding: np.ndarray) -> None:
        """Slide the anchors of nodes whose tangential force exceeds friction x pressure.

        holding [N], shape (held, m, 3): forces of the pulley on the nodes outwards, along the axis, along the turn.
        """
        assert self.tangent is not None
        k = wrap.stations
        limit = self.friction * np.maximum(holding[..., 0], 0.0)
        if np.all(np.hypot(holding[..., 1], holding[..., 2]) <= limit):
            wrap.way[k] = 0.0
            return
        way = slide(
            holding[..., 1:].reshape(-1, 2),
            limit.ravel(),
            self.tangent.wrap(wrap.first, len(k)),
            wrap.way[k].reshape(-1, 2),
        ).reshape(wrap.way[k].shape)
        wrap.slide(way)
        self.slip[which] += way[..., 0].mean()
