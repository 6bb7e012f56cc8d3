"""Torsion of the strip beyond what lines of nodes under tension have by themselves, and where it ends on a pulley."""

from dataclasses import dataclass

import numpy as np

from belt_sim.mujoco3d.mesh.belt import Mesh
from belt_sim.mujoco3d.mujoco_4 import Springs
from belt_sim.mujoco3d.state import TAIL, Pose, State, Wrap
from belt_sim.mujoco3d.wrap.touchdown import FIRST, LAST, depth
from belt_sim.rig import Belt


@dataclass(frozen=True)
class Torsion:
    """Couples on the sections of the free spans: C phi'', phi the roll of a section.

    The strip has F b^2 / 12 + G b h^3 / 3; lines at y_j with shares w_j of the section have F sum(w_j y_j^2), and C is
    the rest: 8 % (40 N/mm2) to 16 % (7 N/mm2) for two lines. A twist also stretches the edges, by (y phi')^2 / 2. Of
    the strip that is a couple E h b^5 phi'^3 / 360, of lines EA phi'^3 (sum(w_j y_j^4) - sum(w_j y_j^2)^2) / 2, nothing
    for two. tense [1/m], own [1/m], still [N/m]: b^2 / 12, sum(w_j y_j^2) and G b h^3 / 3, all over chord b'^2, b' the
    outer lines' distance; stretched [N/m3]: what the lines lack of the couple, as a force on them over the cube of what
    a link of the one rises more than the other; lean [m], shape (n,): height of the first line above the last in the
    stress-free places.

    A strip does not roll where it meets the pulley. The last landed station is up to half a chord before or behind that
    place, so that the next station rolls too little or too much, and the entry moment of a belt that tilts swings with
    every landing. The couples on that station are those of a link as long as its distance from the right place.
    """

    mesh: Mesh
    tense: float
    own: float
    still: float
    stretched: float
    lean: np.ndarray

    @staticmethod
    def of(belt: Belt, mesh: Mesh) -> "Torsion":
        """Of a belt of two or more lines."""
        width, thickness = float(belt.width), float(belt.thickness)
        share = mesh.line_stiffness / mesh.line_stiffness.sum()
        apart = float(mesh.line_y[0] - mesh.line_y[-1])
        per = 1.0 / (mesh.chord * apart**2)
        lacking = width**4 / 180.0 - float(share @ mesh.line_y**4) + float(share @ mesh.line_y**2) ** 2
        stiffness = float(belt.youngs_modulus) * float(belt.area)
        return Torsion(
            mesh=mesh,
            tense=per * width**2 / 12.0,
            own=per * float(share @ mesh.line_y**2),
            still=per * float(belt.shear_modulus) * width * thickness**3 / 3.0,
            stretched=0.5 * stiffness * lacking / (apart * (mesh.chord * apart) ** 3),
            lean=mesh.rest[:, 0, 2] - mesh.rest[:, -1, 2],
        )

    def forces(self, state: State, springs: Springs) -> np.ndarray:
        """The couples as vertical forces on the outer nodes; landed sections do not roll."""
        tension = max(-0.5 * float(state.loads[TAIL, 0]), 0.0)
        whole = tension * self.tense + self.still
        roll = self.lean + state.slides[:, 0, 2] - state.slides[:, -1, 2]
        bent = -2.0 * roll
        bent[1:] += roll[:-1]
        bent[:-1] += roll[1:]
        bent[0] += roll[-1]
        bent[-1] += roll[0]
        twisted = self.stretched * (np.roll(roll, -1) - roll) ** 3
        couple = (whole - tension * self.own) * bent + twisted - np.roll(twisted, 1)
        for wrap in state.wraps:
            couple[wrap.stations] = 0.0
        for wrap, pose in zip(state.wraps, state.poses, strict=True):
            for landed, end in ((wrap.first, FIRST), (wrap.last, LAST)):
                couple[(landed + end) % len(roll)] -= whole * self._end(wrap, pose, landed, end, roll)
        forces = np.zeros_like(state.slides)
        forces[:, 0, 2], forces[:, -1, 2] = couple, -couple
        return forces

    def _end(self, wrap: Wrap, pose: Pose, landed: int, end: int, roll: np.ndarray) -> float:
        """How much longer or shorter the link from the last landed station to the first free one is to seem.

        Its roll [m] times (chord / distance from the right place - 1).
        """
        n, chord = len(roll), self.mesh.chord
        last = landed % n
        behind = float(depth(wrap, pose, 0.5 * (wrap.angle[last, 0] + wrap.angle[last, -1]), end))
        behind = min(max(behind, -0.5 * chord), 0.5 * chord)
        return (chord / (chord - behind) - 1.0) * float(roll[(landed + end) % n] - roll[last])
