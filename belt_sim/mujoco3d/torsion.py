"""Torsion of the strip beyond what lines of nodes under tension have by themselves."""

from dataclasses import dataclass

import mujoco
import numpy as np

from belt_sim.case import Case
from belt_sim.mujoco3d.contact import Contact


@dataclass(frozen=True)
class Torsion:
    """Couples on the sections of the free spans: C phi'', phi the roll of a section.

    The strip has F b^2 / 12 + G b h^3 / 3; lines at y_j with shares w_j of the section have F sum(w_j y_j^2), and C is
    the rest: 8 % (40 N/mm2) to 16 % (7 N/mm2) for two lines. rate [N/m]: C / (chord b'^2), b' the outer lines'
    distance; lean [m], shape (n,): height of the first line above the last in the stress-free places.
    """

    rate: float
    lean: np.ndarray
    forces: np.ndarray

    @staticmethod
    def of(case: Case, contact: Contact, data: mujoco.MjData) -> "Torsion":
        belt, mesh = case.belt, contact.scene.mesh
        tension, width = float(case.tension_force), float(belt.width)
        share = mesh.line_stiffness / mesh.line_stiffness.sum()
        own = tension * float(share @ mesh.line_y**2)
        stiffness = (
            tension * width**2 / 12.0 + float(belt.shear_modulus) * width * float(belt.thickness) ** 3 / 3.0 - own
        )
        apart = float(mesh.line_y[0] - mesh.line_y[-1])
        forces = data.qfrc_applied[contact.scene.base :].reshape(contact.slides.shape)
        lean = mesh.rest[:, 0, 2] - mesh.rest[:, -1, 2]
        return Torsion(rate=stiffness / (mesh.chord * apart**2) if apart else 0.0, lean=lean, forces=forces)

    def apply(self, contact: Contact) -> None:
        """Write the couples as vertical forces on the outer nodes; landed sections do not roll."""
        if not self.rate:
            return
        roll = self.lean + contact.slides[:, 0, 2] - contact.slides[:, -1, 2]
        for wrap in contact.wraps:
            roll[wrap.stations] = 0.0
        couple = self.rate * (np.roll(roll, 1) - 2.0 * roll + np.roll(roll, -1))
        for wrap in contact.wraps:
            couple[wrap.stations] = 0.0
        self.forces[:, 0, 2], self.forces[:, -1, 2] = couple, -couple
