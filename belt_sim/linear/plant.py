"""The linear plant: dx/ds = A x(s) + A_d x(s - wrapped arc) + B u, exact for a belt that sticks.

x = (y, alpha) where the belt runs up the tail pulley, then the head pulley; u = (yaw of the tail, yaw of the head).
The coefficients are derivatives of the very laws that a march takes (run-up, span, drive, wrap, and what effects do
to them), at a working point; the travel s takes the place of time, and a speed turns one into the other.
"""

from dataclasses import dataclass

import numpy as np

from belt_sim.errors import InputError

INPUTS = ("yaw", "yaw_head")
OUTPUTS = ("y1", "y2", "y3", "y4")
STATES = ("y_tail", "alpha_tail", "y_head", "alpha_head")


@dataclass(frozen=True, kw_only=True)
class LinearBelt:
    """A belt around a working point.

    now, delayed: A and A_d, shape (n, n) [1/m, and m for angles per metre]; drive: B (n, 2); constant: dx/ds at the
    working point with nothing steered (n,); states: names of x, n = 4, or 2 for a limp rope, which has no angles of its
    own; arcs: wrapped arc that each state comes back after (n,) [m]; places: for each of y1..y4 the state that it
    shows and whether it comes one arc late; speed [m/s], tension [Pa].
    """

    model: str
    tension: float
    speed: float
    states: tuple[str, ...]
    now: np.ndarray
    delayed: np.ndarray
    drive: np.ndarray
    constant: np.ndarray
    arcs: np.ndarray
    places: tuple[tuple[int, bool], ...]

    def response(self, wavenumber: np.ndarray) -> np.ndarray:
        """Lateral position per yaw [m/rad] at ``wavenumber`` [rad/m], shape (k, 4, 2), delays exact.

        Raises InputError for a wavenumber that is not positive: the belt integrates, so there is none at 0.
        """
        k = np.atleast_1d(np.asarray(wavenumber, dtype=float))
        if not np.all(k > 0):
            raise InputError("wavenumber", f"{k.min():g}", "rad/m", "give positive ones")
        p = 1j * k[:, None]
        late = np.exp(-p * self.arcs)
        system = p[..., None] * np.eye(len(self.states)) - self.now - self.delayed * late[:, None, :]
        x = np.linalg.solve(system, np.broadcast_to(self.drive, (len(k), *self.drive.shape)).astype(complex))
        rows = [x[:, state] * (late[:, state, None] if after else 1.0) for state, after in self.places]
        return np.stack(rows, axis=1)

    def response_in_time(self, frequency: np.ndarray) -> np.ndarray:
        """The same at ``frequency`` [Hz] and the belt's speed."""
        return self.response(2 * np.pi * np.atleast_1d(np.asarray(frequency, dtype=float)) / self.speed)
