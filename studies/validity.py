"""The map of validity: ``python -m studies.validity picture=docs/images/validity.png``.

Boundaries of the hanging strip (load 1 of each limit of belt_sim.validity) over tension and yaw, length of the rig,
width of the belt, thickness of the belt; everything else as configured. The configured rig is marked.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.lines import Line2D

from belt_sim.case import Case, Schedule
from belt_sim.settings import case_from
from belt_sim.show import style
from belt_sim.show.style import CYCLE, INK
from belt_sim.units import DEGREE, MM, N_PER_MM2
from belt_sim.validity import limits
from studies.application import application


@dataclass(frozen=True)
class Direction:
    """What is varied beside the tension: name with unit, values, the case with a value, the value as configured."""

    name: str
    values: np.ndarray
    case: Callable[[Case, float], Case]
    here: float


def directions(case: Case, points: int) -> list[Direction]:
    """Yaw, length, width, thickness."""
    rig, belt, settings = case.rig, case.belt, case.settings
    yaw = abs(float(settings.yaw.last())) / DEGREE
    return [
        Direction("yaw [degrees]", np.geomspace(0.005, 1.0, points),
                  lambda c, v: replace(c, settings=replace(settings, yaw=Schedule.step(v * DEGREE))), yaw),
        Direction("centre distance [m]", np.geomspace(1.0, 40.0, points),
                  lambda c, v: replace(c, rig=replace(rig, centre_distance=v)), rig.centre_distance),
        Direction("width [mm]", np.geomspace(40.0, 1500.0, points),
                  lambda c, v: replace(c, belt=replace(belt, width=v * MM)), belt.width / MM),
        Direction("thickness [mm]", np.geomspace(0.05, 1.5, points),
                  lambda c, v: replace(c, belt=replace(belt, thickness=v * MM)), belt.thickness / MM),
    ]  # fmt: skip


def loads(case: Case, direction: Direction, tensions: np.ndarray, contains: list[str]) -> dict[str, np.ndarray]:
    """Load of every limit, shape (values, tensions)."""
    grids: dict[str, np.ndarray] = {}
    for i, value in enumerate(direction.values):
        for j, tension in enumerate(tensions):
            varied = direction.case(case, float(value))
            varied = replace(varied, settings=replace(varied.settings, tension=float(tension) * N_PER_MM2))
            for limit in limits(varied, contains):
                grids.setdefault(limit.id, np.zeros((len(direction.values), len(tensions))))[i, j] = limit.load
    return grids


def validity(config: dict[str, Any]) -> None:
    """The picture, and what the configured case says of itself."""
    case, contains = case_from(config), config["contains"]
    for limit in limits(case, contains):
        print(f"{limit.id:14s} {limit.load:8.3f}  {limit.words}")
    if config["picture"]:
        tensions = np.geomspace(3.0, 150.0, config["points"])
        found = [(d, loads(case, d, tensions, contains)) for d in directions(case, config["points"])]
        print(picture(config["picture"], tensions, found))


@style.picture
def picture(path: str | Path, tensions: np.ndarray, found: list[tuple[Direction, dict[str, np.ndarray]]]) -> Path:
    """A panel a direction; a limit's colour is the same in all, the area beyond it is tinted."""
    fig, axes = style.figure(11.0, 8.4, 2, 2)
    names = list(dict.fromkeys(name for _, grids in found for name in grids))
    colours = dict(zip(names, (*CYCLE, INK), strict=False))
    drawn = set()
    for ax, (direction, grids) in zip(axes, found, strict=True):
        for name, grid in grids.items():
            if grid.max() <= 1.0:
                continue
            drawn.add(name)
            ax.contour(tensions, direction.values, grid, levels=[1.0], colors=[colours[name]], linewidths=1.8)
            if grid.min() < 1.0:
                ax.contourf(tensions, direction.values, grid, levels=[1.0, np.inf], colors=[colours[name]], alpha=0.08)
        ax.plot([7, 10, 20, 40], [direction.here] * 4, "o", color=INK, markersize=4)
        ax.set(xscale="log", yscale="log", xlabel="tension [N/mm$^2$]", ylabel=direction.name)
        ax.set_xticks([5, 10, 20, 50, 100], ["5", "10", "20", "50", "100"])
        ax.minorticks_off()
    handles = [Line2D([], [], color=colours[n], label=n) for n in names if n in drawn]
    handles.append(Line2D([], [], color=INK, marker="o", linestyle="", label="the paper's rig"))
    fig.legend(handles=handles, loc="outside lower center", ncols=5)
    style.title(fig, "Where the hanging strip stops being right: beyond each line, on its tinted side")
    return style.save(fig, path)


if __name__ == "__main__":
    application("validity", validity)
