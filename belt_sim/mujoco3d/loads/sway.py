"""Drag that calms the sway of a limp belt without holding back a span that travels."""

from dataclasses import dataclass

import numpy as np

from belt_sim.mujoco3d.mesh.belt import Mesh
from belt_sim.mujoco3d.mujoco_4 import Springs
from belt_sim.mujoco3d.state import HEAD, TAIL, State


@dataclass(frozen=True)
class Sway:
    """What is added to the drag of the nodes' slides, so that it acts against waves only.

    sign: +1 or -1, travel along station numbers; drag [N s/m], shape (m,): sideways damping of a node; dt [s].
    """

    mesh: Mesh
    sign: int
    drag: np.ndarray
    dt: float

    def forces(self, state: State, springs: Springs) -> np.ndarray:
        """Drag times the sideways speed of a straight span, which is linear between its ends.

        At the tangent point (theta its direction) that is v (theta + slope), at the run-up it is the pulley's.
        """
        mesh, forces = self.mesh, np.zeros_like(state.slides)
        if state.speed == 0.0:
            return forces
        for begins, ends in ((HEAD, TAIL), (TAIL, HEAD)):
            wrap, first = state.wraps[ends], state.led[begins]
            landed = wrap.first if self.sign > 0 else wrap.last
            links = self.sign * (landed - first) % mesh.stations
            k = (first + self.sign * np.arange(1, links + 1)) % mesh.stations
            y = mesh.at(state.slides, k[-1])[:, 1]
            theta = (y - mesh.at(state.slides, k[0])[:, 1]) / (mesh.chord * (links - 1))
            at_run_off = state.speed * (theta + state.kink_slope[begins])
            at_run_up = (springs.rest[k[-1]] - state.slides[k[-1]])[:, 1] / self.dt
            share = np.arange(1, links)[:, None] / links
            forces[k[:-1], :, 1] = self.drag * (at_run_off + (at_run_up - at_run_off) * share)
        return forces
