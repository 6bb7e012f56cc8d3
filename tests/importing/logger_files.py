"""Records as a logger would write them, of a belt that moves in a way that is known."""

from dataclasses import dataclass

import numpy as np

MAPPING = {
    "machine": {"centre_distance": "11.28 m", "pulley_radius": "170 mm"},
    "belt": {"width": "200 mm", "thickness": "0.3 mm", "youngs_modulus": "210 GPa", "density": "7850"},
    "settings": {"tension_rel": "0.01", "yaw": "3 urad"},
}
SPEED = 0.5  # [m/s]


@dataclass(frozen=True)
class Log:
    """time [s], travel [m], y1 and y4 [mm] from an arbitrary mark, shape (n,)."""

    time: np.ndarray
    travel: np.ndarray
    y1: np.ndarray
    y4: np.ndarray


def truth(travel: np.ndarray, yaw: float, point: int) -> np.ndarray:
    """y [mm] at a travel [m]: the tail leads, the head follows, both drift on; smooth, for yaw in mrad."""
    late = 0.3 * yaw * np.maximum(travel, 0.0)
    lead = 5.0 * yaw * (1.0 - np.exp(-np.maximum(travel, 0.0) / 5.0))
    return late + (lead if point == 1 else 0.1 * lead)


def log(yaw: float = -0.73, length: float = 30.0, spacing: float = 0.05, white: float = 0.02, seed: int = 0) -> Log:
    """A record at an even spacing [m] with white noise [mm]; the sensors' marks are at 103.2 and 48.1 mm."""
    rng = np.random.default_rng(seed)
    travel = np.round(np.arange(0.0, length, spacing), 9)
    y1 = 103.2 + truth(travel, yaw, 1) + white * rng.standard_normal(len(travel))
    y4 = 48.1 + truth(travel, yaw, 4) + white * rng.standard_normal(len(travel))
    return Log(travel / SPEED, travel, y1, y4)


def table(header: list[str], columns: list, separator: str = ",", decimal: str = ".", digits: int = 4) -> str:
    """A table as text."""

    def cell(x) -> str:
        return x if isinstance(x, str) else f"{x:.{digits}f}".replace(".", decimal)

    rows = [separator.join(cell(x) for x in row) for row in zip(*columns, strict=True)]
    return "\n".join([separator.join(header), *rows, ""])
