"""Clean campaigns of a limp rope, the simplest belt: y' = theta_p - (y_run-up - y_run-off)/L."""

import dataclasses
import math

import numpy as np

from belt_sim.campaign import (
    BeltSheet,
    Campaign,
    Machine,
    Quantity,
    Run,
    SettingsSheet,
    SignalSheet,
    Source,
)

LENGTH, RADIUS, YAW = 11.28, 0.17, 0.042 * math.pi / 180.0
WHITE, ZERO = 2e-5, 1e-4  # [m]
SPACING = 0.05  # [m]


def rope(yaw: float, travel: np.ndarray) -> dict[str, np.ndarray]:
    """y of points 1-4 [m] after a yaw of the tail pulley, in steps of SPACING."""
    lag = round(math.pi * RADIUS / SPACING)
    y1, y3 = np.zeros(len(travel) + lag), np.zeros(len(travel) + lag)
    for k in range(lag, len(y1) - 1):
        y1[k + 1] = y1[k] + SPACING * (yaw - (y1[k] - y3[k - lag]) / LENGTH)
        y3[k + 1] = y3[k] - SPACING * (y3[k] - y1[k - lag]) / LENGTH
    n = len(travel)
    return {"y1": y1[-n:], "y2": y1[:n], "y3": y3[-n:], "y4": y3[:n]}


def roped_campaign(seed: int = 0, length: float = 50.0, tension=(10e6, 40e6)) -> Campaign:
    """Runs at both yaw signs and every tension, one repeat each, with white noise and zero errors."""
    rng = np.random.default_rng(seed)
    travel = SPACING * np.arange(round(length / SPACING) + 1)
    runs = []
    for sigma in tension:
        for yaw, repeat_of in ((YAW, None), (-YAW, None), (YAW, f"r{len(runs)}")):
            signals = {
                name: y + rng.normal(0.0, WHITE, len(y)) + rng.normal(0.0, ZERO)
                for name, y in rope(yaw, travel).items()
            }
            name = f"r{len(runs)}"
            runs.append(Run(name=name, tension=sigma, yaw=yaw, repeat_of=repeat_of, travel=travel, signals=signals))
    sheets = tuple(
        SignalSheet(name=f"y{k}", at=f"point_{k}", kind="lateral", unit="mm", white=WHITE, zero=ZERO)
        for k in (1, 2, 3, 4)
    )
    radius = Quantity(value=RADIUS)
    return Campaign(
        title="rope",
        source=Source(kind="synthetic"),
        machine=Machine(centre_distance=Quantity(value=LENGTH), head_radius=radius, tail_radius=radius),
        belt=BeltSheet(
            width=Quantity(value=0.2),
            thickness=Quantity(value=3e-4),
            youngs_modulus=Quantity(value=210e9),
            density=Quantity(value=7850.0),
        ),
        signals=sheets,
        settings=SettingsSheet(tension_rel=0.01, yaw_u=3e-6),
        runs=tuple(runs),
    )


def damaged(campaign: Campaign, change, *runs: int) -> Campaign:
    """The campaign with ``change`` (dict of signals -> dict of signals) applied to these runs, or to all."""
    new = [
        dataclasses.replace(run, signals=run.signals | change(run.signals)) if not runs or k in runs else run
        for k, run in enumerate(campaign.runs)
    ]
    return dataclasses.replace(campaign, runs=tuple(new))
