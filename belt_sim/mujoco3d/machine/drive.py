"""What the machine is told for one step."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True, kw_only=True)
class Drive:
    """Boundary values of a step, at its end.

    travel [m], speed [m/s], acceleration [m/s2]: of the belt, along its direction; yaw [rad], shape (2,): commanded,
    head and tail; share: how much of yaw offsets, cants and camber acts; slide_speed [m/s]: of a tail pulley that is
    moved, 0 = fixed, None = it follows the forces; lead [m/s]: how much faster than the belt the tail pulley's rim
    steadily goes; friction [1], inf = sticking; drag [1/s]: of the belt per unit of its mass, along x and across it.
    """

    travel: float
    speed: float = 0.0
    acceleration: float = 0.0
    yaw: np.ndarray = field(default_factory=lambda: np.zeros(2))
    share: float = 0.0
    slide_speed: float | None = None
    lead: float = 0.0
    friction: float
    drag: tuple[float, float]
