"""The plant without delays: each wrapped arc replaced by a rational function of a chosen order."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.io import savemat
from scipy.linalg import block_diag

from belt_sim.errors import InputError
from belt_sim.files import write_with
from belt_sim.linear.delay import rational_delay
from belt_sim.linear.plant import INPUTS, OUTPUTS, LinearBelt

_GRID = 200  # wavenumbers at which the error is looked for


@dataclass(frozen=True, kw_only=True)
class StateSpace:
    """dz/dt = a z + b u, y = c z + d u in seconds (per_metre False) or metres of travel (True).

    u: yaw of the tail and of the head pulley [rad]; y: y1..y4 [m]; order and delay: how a wrapped arc was replaced.
    """

    plant: LinearBelt
    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    order: int
    delay: str
    per_metre: bool

    def response(self, frequency: np.ndarray) -> np.ndarray:
        """y per u [m/rad] at angular ``frequency`` [rad/s, or rad/m of travel], shape (k, 4, 2)."""
        p = 1j * np.atleast_1d(np.asarray(frequency, dtype=float))[:, None, None]
        return self.c @ np.linalg.solve(p * np.eye(len(self.a)) - self.a, self.b.astype(complex)) + self.d

    def error(self, highest: float) -> float:
        """Largest difference from the exact plant up to ``highest`` [rad/s or rad/m], as a share of each entry's size.

        Entries are yaw to y1..y4; ``highest`` should be a little above where the controller stops acting.
        """
        w = np.geomspace(1e-3 * highest, highest, _GRID)
        exact = self.plant.response(w if self.per_metre else w / self.plant.speed)
        size = np.abs(exact)
        seen = size > 1e-9 * size.max()
        return float(np.max(np.abs(self.response(w) - exact)[seen] / size[seen]))

    def to_control(self) -> Any:
        """The same as a ``control.StateSpace`` of python-control; raises InputError when that is not installed."""
        try:
            import control
        except ImportError:
            raise InputError("control", "not installed", "", "pip install belt-sim[control]") from None
        return control.ss(self.a, self.b, self.c, self.d, inputs=list(INPUTS), outputs=list(OUTPUTS), name="belt")

    def save_mat(self, path: Path | str) -> Path:
        """Write a MAT file (level 5) with A, B, C, D and what they are; Matlab: ``ss(A, B, C, D)``."""
        content = {"A": self.a, "B": self.b, "C": self.c, "D": self.d, "inputs": list(INPUTS), "outputs": list(OUTPUTS)}
        about = {
            "model": self.plant.model,
            "tension_Pa": self.plant.tension,
            "speed_m_per_s": self.plant.speed,
            "delay": self.delay,
            "order": self.order,
            "per_metre": float(self.per_metre),
        }
        return write_with(Path(path), lambda p: savemat(p, content | about, appendmat=False))


def state_space(plant: LinearBelt, *, order: int = 3, delay: str = "pade", per_metre: bool = False) -> StateSpace:
    """``plant`` with every wrapped arc of ``order`` by ``delay`` ("pade" or "chain"); raises InputError."""
    n = len(plant.states)
    pieces = [rational_delay(float(arc), order, delay) for arc in plant.arcs]
    a_late, b_late, c_late, d_late = (block_diag(*part) for part in zip(*pieces, strict=True))
    a = np.block([[plant.now + plant.delayed @ d_late, plant.delayed @ c_late], [b_late, a_late]])
    b = np.concatenate([plant.drive, np.zeros((len(a_late), len(INPUTS)))])
    rows = []
    for state, after in plant.places:
        shown = np.eye(1, n, state)
        rows.append(np.hstack([shown @ d_late, shown @ c_late]) if after else np.hstack([shown, 0 * shown @ c_late]))
    scale = 1.0 if per_metre else plant.speed
    c = np.concatenate(rows)
    return StateSpace(
        plant=plant,
        a=a * scale,
        b=b * scale,
        c=c,
        d=np.zeros((len(OUTPUTS), len(INPUTS))),
        order=order,
        delay=delay,
        per_metre=per_metre,
    )
