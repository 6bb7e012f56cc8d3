"""What a step of travel reads and writes, and what the machine is told for it."""

from typing import NamedTuple

from belt_sim.belt_mechanics.wrap import Pose, Wrap
from belt_sim.pytree import Numbers as Array
from belt_sim.quasi_static.friction import Slip
from belt_sim.quasi_static.limp import Kinks


class State(NamedTuple):
    """nodes [m], (m, 3, n); wraps, pose: of head and tail; tension [N]: mean of the spans; travel [m]; correction [m]:
    by how much the step's last Newton iteration moved a node at most; slip: None if it sticks; kinks: of a limp belt;
    turned [rad], (2,): yaw by which the pulleys give way, None if they do not; layer: as in layer.py, or None."""

    nodes: Array
    wraps: Wrap
    pose: Pose
    tension: Array
    travel: Array
    correction: Array
    slip: Slip | None = None
    kinks: Kinks | None = None
    turned: Array | None = None
    layer: Array | None = None


class Command(NamedTuple):
    """What the machine is told for a step: travel [m] at its end; yaw [rad], (2,): head, tail; share: of yaw offsets,
    cants, camber and loads that acts."""

    travel: Array
    yaw: Array
    share: Array
