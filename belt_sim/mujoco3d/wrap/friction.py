"""Coulomb friction of landed nodes: how far they slip until no node pulls harder than friction allows."""

import numpy as np

from belt_sim.mujoco3d.state import Wrap
from belt_sim.mujoco3d.wrap.coulomb import slip_increments
from belt_sim.mujoco3d.wrap.tangent import Tangent


def let_slip(wrap: Wrap, holding: np.ndarray, friction: float, tangent: Tangent) -> float:
    """Move the anchors of nodes whose tangential force exceeds friction [1] x pressure; mean lateral slip [m].

    A return mapping on the holding forces of a wrap, as one system, without inertia. holding [N], shape (held, m, 3):
    forces of the pulley on the nodes outwards, along the axis, along the turn.
    """
    k = wrap.stations
    limit = friction * np.maximum(holding[..., 0], 0.0)
    if np.all(np.hypot(holding[..., 1], holding[..., 2]) <= limit):
        wrap.slip_increment[k] = 0.0
        return 0.0
    stiffness, guess = tangent.wrap(wrap.first, len(k)), wrap.slip_increment[k]
    increment = slip_increments(holding[..., 1:].reshape(-1, 2), limit.ravel(), stiffness, guess.reshape(-1, 2))
    increment = increment.reshape(guess.shape)
    wrap.slip(increment)
    return float(increment[..., 0].mean())
