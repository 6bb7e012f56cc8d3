"""A map of many cases: one column of its table over two axes, or against one."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.case_map.axes import CasePlan
from belt_sim.case_map.parts import FOLDER, parquet
from belt_sim.pictures import style
from belt_sim.pictures.style import BLUE, INK

MOST = 2_000_000  # cases drawn
WORDS = {
    "tension_n_per_mm2": "tension [N/mm$^2$]",
    "yaw_deg": "yaw of the tail pulley [degrees]",
    "yaw_head_deg": "yaw of the head pulley [degrees]",
    "rate1_mm_per_m": "late rate of point 1 [mm per m of travel]",
    "steady_rate_mm_per_m": "steady rate [mm per m of travel]",
    "overshoot1_mm": "overshoot of point 1 [mm]",
    "retreat1_mm": "retreat of point 1 [mm]",
}


def draw_map(folder: Path, plan: CasePlan, columns: Sequence[str], show: str | None) -> list[Path]:
    """map.png in ``folder``, of a map of one or two axes: column ``show``, or the first told; nothing for others."""
    wanted = show or columns[len(plan.axes)]
    if len(plan.axes) > 2 or plan.count > MOST:
        return []
    names = [a.column for a in plan.axes]
    table = parquet().read_table(folder / FOLDER, columns=["case", *names, wanted]).to_pandas().sort_values("case")
    values = table[wanted].to_numpy()
    if len(names) == 1:
        return [_line(folder / "map.png", names[0], table[names[0]].to_numpy(), wanted, values)]
    x, y = (table[n].to_numpy() for n in names)
    return [_field(folder / "map.png", names, (x, y), wanted, values, plan.shape if plan.cases is None else None)]


def _words(column: str) -> str:
    return WORDS.get(column, column.replace("_", " "))


@style.picture
def _line(path: Path, axis: str, x: np.ndarray, column: str, y: np.ndarray) -> Path:
    fig, [[ax]] = style.figure(7.2, 4.4)
    order = np.argsort(x)
    ax.plot(x[order], y[order], color=BLUE)
    ax.set(xlabel=_words(axis), ylabel=_words(column))
    return style.finish(fig, path, _words(column).split(" [")[0].capitalize())


@style.picture
def _field(path: Path, axes: Sequence[str], at: Any, column: str, values: np.ndarray, shape: Any) -> Path:
    """Colours over the first axis (across) and the second (up): cells of a grid, else means over hexagons."""
    fig, [[ax]] = style.figure(7.6, 5.0)
    limit = float(np.nanmax(np.abs(values))) or 1.0
    look: dict[str, Any] = {"cmap": style.diverging_map(), "vmin": -limit, "vmax": limit}
    x, y = at
    if shape is None:
        drawn: Any = ax.hexbin(x, y, C=values, gridsize=60, **look)
    else:
        across, up, z = (a.reshape(shape) for a in (x, y, values))
        drawn = ax.pcolormesh(across[:, 0], up[0], z.T, shading="nearest", rasterized=True, **look)
        if min(shape) > 1 and np.ptp(z):
            lines = ax.contour(across[:, 0], up[0], z.T, levels=10, colors=INK, linewidths=0.6)
            ax.clabel(lines, fontsize=style.FONT - 2)
    ax.grid(visible=False)
    fig.colorbar(drawn, ax=ax, label=_words(column))
    ax.set(xlabel=_words(axes[0]), ylabel=_words(axes[1]))
    return style.finish(fig, path, f"{_words(column).split(' [')[0].capitalize()}, {len(values):,} cases")
