"""A belt that lies off is centred: what was found, in 3D and by the law, and the quickest there can be.

The strip law is linear in yaw, so that whether any yaw of at most ``most`` degrees centres the belt by some travel is
a linear programme over the yaw of each metre.
"""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.api.simulate import model_named, simulate
from belt_sim.case import Case, Schedule
from belt_sim.commands.cases import CentringGoal
from belt_sim.curves import Curves, read_curves
from belt_sim.settings import case_from
from belt_sim.show import style
from belt_sim.show.style import FAINT, INK, POINT_NAMES, POINTS
from belt_sim.units import DEGREE, MM
from studies.application import application

SPARE = 7  # of so many records one is asked of in the linear programme


def nearest(case: Case, wanted: CentringGoal, by: float, config: Mapping[str, Any]) -> float:
    """Least distance [m] from the middle within which some yaw keeps the belt from travel ``by`` [m] on."""
    from scipy.optimize import linprog

    angle = float(config["most"]) * DEGREE
    step = replace(case, settings=replace(case.settings, yaw=Schedule.step(-angle * np.sign(wanted.start))))
    curves = simulate(step, model="strip", travel=config["travel"]).curves
    travel, y = np.asarray(curves.travel), np.asarray(curves.y)  # type: ignore[union-attr]
    pieces = round(by / config["every"])
    width = round(config["every"] / (travel[1] - travel[0]))
    rows = np.stack([_delay(y, k * width) - _delay(y, (k + 1) * width) for k in range(pieces)], axis=-1)
    off = wanted.start
    late, all_of = rows[:, travel >= by][:, ::SPARE].reshape(-1, pieces), rows[:, ::SPARE].reshape(-1, pieces)
    one, none = np.ones((len(late), 1)), np.zeros((len(all_of), 1))
    left = np.block([[late, -one], [-late, -one], [-np.sign(off) * all_of, none]])
    right = np.concatenate([-off * one[:, 0], off * one[:, 0], abs(off) + wanted.beyond + none[:, 0]])
    answer = linprog(np.eye(pieces + 1)[-1], left, right, bounds=[(-1, 1)] * pieces + [(0, None)])
    return float(answer.x[-1])


def _delay(y: np.ndarray, records: int) -> np.ndarray:
    """y (4, n) later by so many records."""
    return np.hstack([np.zeros((4, records)), y[:, : y.shape[1] - records]])


@style.picture
def picture(path: Path, law: Curves, space: Curves | None, wanted: CentringGoal, schedule: Schedule) -> Path:
    """Points 1-4 and the yaw, against travel; space: those in three dimensions."""
    fig, [[ax], [below]] = style.figure(8.4, 5.6, rows=2, sharex=True, height_ratios=[3, 1])
    for k, (colour, name) in enumerate(zip(POINTS, POINT_NAMES, strict=True)):
        ax.plot(law.travel, (law.y[k] + wanted.start) / MM, color=colour, label=name)
        if space is not None:
            ax.plot(space.travel, (space.y[k] + wanted.start) / MM, color=colour, linestyle=":", linewidth=2.6)
    for level in (-wanted.within, wanted.within):
        ax.axhline(level / MM, color=FAINT, linewidth=0.8)
    ax.set(ylabel="from the middle [mm]")
    ax.legend(loc="upper right")
    ax.set_title("strip law; dotted: in three dimensions" if space is not None else "strip law", fontweight="normal")
    travel = np.asarray(law.travel)
    part = np.clip((travel[:, None] - schedule.at) / np.maximum(schedule.over, 1e-9), 0.0, 1.0)
    below.plot(travel, (part * schedule.change).sum(axis=1) / DEGREE, color=INK)
    below.set(xlabel="belt travel [m]", ylabel="yaw [degrees]", xlim=(0.0, 120.0))
    style.title(fig, "A slack belt is centred")
    return style.save(fig, path)


def run_line(name: str, travel: np.ndarray, y: np.ndarray, wanted: CentringGoal) -> str:
    """One line of a run, y (4, n) [m]."""
    centred = wanted.centring_travel(travel, y)
    rest = wanted.largest_distance(y)[travel >= centred].max()
    over = wanted.overshoot(y)
    return f"{name}: centred after {centred:.1f} m, within {rest / MM:.2f} mm then, beyond by {over / MM:.2f} mm"


def centring(config: dict[str, Any]) -> None:
    """Tell, and draw."""
    case, wanted = case_from(config), CentringGoal.from_setting(config["objective"])
    assert wanted is not None
    for by in config["quickest"]:
        print(f"from {by:g} m on, any yaw: within {nearest(case, wanted, by, config) / MM:.2f} mm at best", flush=True)
    law = simulate(case, model=model_named("strip"), travel=config["travel"]).curves
    assert law is not None
    print(run_line("strip law", np.asarray(law.travel), np.asarray(law.y), wanted))
    space = read_curves(Path(config["space"])) if config["space"] else None
    if space is not None:
        print(run_line("3D", space.travel, space.y, wanted))
    if config["picture"]:
        print(picture(Path(config["picture"]), law, space, wanted, case.settings.yaw))


if __name__ == "__main__":
    application("centring", centring)
