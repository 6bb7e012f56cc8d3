"""Torsion of the strip beyond what lines of nodes under tension have by themselves, and where it ends on a pulley."""

from dataclasses import dataclass

import mujoco
import numpy as np

from belt_sim.case import Case
from belt_sim.mujoco3d.wrap.contact import Contact
from belt_sim.mujoco3d.wrap.hold import Pose, Wrap
from belt_sim.mujoco3d.wrap.touchdown import FIRST, LAST, depth


@dataclass(frozen=True)
class Torsion:
    """Couples on the sections of the free spans: C phi'', phi the roll of a section.

    The strip has F b^2 / 12 + G b h^3 / 3; lines at y_j with shares w_j of the section have F sum(w_j y_j^2), and C is
    the rest: 8 % (40 N/mm2) to 16 % (7 N/mm2) for two lines. tense [1/m], own [1/m], still [N/m]: b^2 / 12,
    sum(w_j y_j^2) and G b h^3 / 3, all over chord b'^2, b' the outer lines' distance; lean [m], shape (n,): height of
    the first line above the last in the stress-free places.

    A strip does not roll where it meets the pulley. The last landed station is up to half a chord before or behind that
    place, so that the next station rolls too little or too much, and the entry moment of a belt that tilts swings with
    every landing. The couples on that station are those of a link as long as its distance from the right place.
    """

    tense: float
    own: float
    still: float
    lean: np.ndarray
    forces: np.ndarray

    @staticmethod
    def of(case: Case, contact: Contact, data: mujoco.MjData) -> "Torsion":
        belt, mesh = case.belt, contact.scene.mesh
        width, thickness = float(belt.width), float(belt.thickness)
        share = mesh.line_stiffness / mesh.line_stiffness.sum()
        apart = float(mesh.line_y[0] - mesh.line_y[-1])
        per = 1.0 / (mesh.chord * apart**2) if apart else 0.0
        return Torsion(
            tense=per * width**2 / 12.0,
            own=per * float(share @ mesh.line_y**2),
            still=per * float(belt.shear_modulus) * width * thickness**3 / 3.0,
            lean=mesh.rest[:, 0, 2] - mesh.rest[:, -1, 2],
            forces=data.qfrc_applied[contact.scene.base :].reshape(contact.slides.shape),
        )

    def apply(self, contact: Contact, poses: tuple[Pose, ...], tension: float) -> None:
        """Write the couples as vertical forces on the outer nodes; landed sections do not roll. tension [N]: F."""
        if not self.tense:
            return
        whole = tension * self.tense + self.still
        roll = self.lean + contact.slides[:, 0, 2] - contact.slides[:, -1, 2]
        bent = -2.0 * roll
        bent[1:] += roll[:-1]
        bent[:-1] += roll[1:]
        bent[0] += roll[-1]
        bent[-1] += roll[0]
        couple = (whole - tension * self.own) * bent
        for wrap in contact.wraps:
            couple[wrap.stations] = 0.0
        for wrap, pose in zip(contact.wraps, poses, strict=True):
            for landed, end in ((wrap.first, FIRST), (wrap.last, LAST)):
                couple[(landed + end) % len(roll)] -= whole * self._end(contact, wrap, pose, landed, end, roll)
        self.forces[:, 0, 2], self.forces[:, -1, 2] = couple, -couple

    def _end(self, contact: Contact, wrap: Wrap, pose: Pose, landed: int, end: int, roll: np.ndarray) -> float:
        """How much longer or shorter the link from the last landed station to the first free one is to seem.

        Its roll [m] times (chord / distance from the right place - 1).
        """
        n, chord = len(roll), contact.scene.mesh.chord
        last = landed % n
        behind = float(depth(wrap, pose, 0.5 * (wrap.angle[last, 0] + wrap.angle[last, -1]), end))
        behind = min(max(behind, -0.5 * chord), 0.5 * chord)
        return (chord / (chord - behind) - 1.0) * float(roll[(landed + end) % n] - roll[last])
