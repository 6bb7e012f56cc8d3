"""The 3D belt over tension, yaw and friction, and its picture beside the strip law.

``python -m studies.quasi_static_map FILE.csv [side] [travel] [mu ..]`` runs it (a GPU). side: tensions, and as many
yaws; friction: inf, as it is by itself, is a belt that sticks. A row a case: late rates of the points, overshoot and
retreat of point 1. ``python -m studies.quasi_static_map`` alone reads docs/maps/tension_yaw_3d.csv, marches the strip
law at its tensions, and draws docs/images/tension_yaw_3d.png.
"""

import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import jax
import numpy as np
import pandas as pd

import belt_sim as bs
from belt_sim.case import Case, Schedule, Settings
from belt_sim.curves import Curves, late_rates
from belt_sim.errors import SimulationError
from belt_sim.io import write_text
from belt_sim.jax_setup import prepare
from belt_sim.scene_parts import SceneParts
from belt_sim.show import style
from belt_sim.units import DEGREE, MM, MM_PER_M, N_PER_MM2
from studies.paper.case import PAPER_BELT, TEST_RIG

TABLE, PICTURE = Path("docs/maps/tension_yaw_3d.csv"), Path("docs/images/tension_yaw_3d.png")
COLUMNS = {
    "early_mm": "point 1 after 3 m [mm]",
    "most_mm": "furthest of point 1 [mm]",
    "retreat_mm": "retreat of point 1 [mm]",
    "rate1": "late rate of point 1, 48-60 m [mm/m]",
}
STICKING = np.inf
Figures = dict[str, np.ndarray]  # shape (tensions, yaws) each


HEADER = "tension_n_per_mm2,yaw_deg,rate1,rate2,rate3,rate4,y1_3m_mm,y1_10m_mm,y1_end_mm,most_mm,retreat_mm,worst_um"
HEADER += ",friction"


def row(case: Case, curves: Any, friction: float) -> str:
    """One line of the table; rates in mm/m."""
    tension, yaw = float(case.settings.tension) / N_PER_MM2, float(np.sum(case.settings.yaw.change)) / DEGREE
    if isinstance(curves, SimulationError):
        return f"{tension:g},{yaw:g}" + "," * 11 + f"{friction:g}"
    y1 = curves.y[0] / MM
    at = [float(np.interp(s, curves.travel, y1)) for s in (3.0, 10.0, curves.travel[-1])]
    ahead = y1 * np.sign(y1[len(y1) // 10])
    highest = np.maximum.accumulate(ahead)
    values = [*(late_rates(curves) / MM_PER_M), *at, float(ahead.max()), float((highest - ahead).max())]
    return f"{tension:g},{yaw:g}," + ",".join(
        f"{v:.6g}" for v in (*values, 1e6 * curves.extra["correction"].max(), friction)
    )


def quasi_static_map(cases: Sequence[Case], frictions: Sequence[float], travel: float, out: Path) -> None:
    """Run every case with every friction and write ``out``; prints the time and the device's memory used at most."""
    from belt_sim.space.quasi_static import simulate_batch

    begun, lines, failed = time.perf_counter(), [HEADER], 0
    for friction in frictions:  # belts that stick make a batch of their own: it is cheaper
        parts = [SceneParts.from_case(case, friction) for case in cases]
        found = simulate_batch(cases, travel=travel, parts=parts)
        lines += [row(c, f, friction) for c, f in zip(cases, found, strict=True)]
        failed += sum(isinstance(f, SimulationError) for f in found)
    wall = time.perf_counter() - begun
    write_text(out, "\n".join(lines) + "\n")
    memory = (jax.devices()[0].memory_stats() or {}).get("peak_bytes_in_use", 0) / 1e9
    count, device = len(lines) - 1, jax.devices()[0]
    print(f"{count} cases of {travel:g} m on {device}: {wall:.1f} s, {failed} failed, {memory:.2f} GB")


def by_law(tensions: np.ndarray, yaws: np.ndarray) -> Figures:
    """The figures by the strip law, shape (tensions, yaws): it is linear in the yaw."""
    found: dict[str, list[float]] = {name: [] for name in COLUMNS}
    for tension in tensions:
        curves = bs.simulate(model="strip", tension=float(tension), yaw=-0.042, travel=60.0).curves
        assert isinstance(curves, Curves)
        ahead = -np.asarray(curves.y)[0] / MM
        found["early_mm"].append(float(np.interp(3.0, curves.travel, ahead)))
        found["rate1"].append(float(late_rates(curves)[0]) / MM_PER_M)
        found["most_mm"].append(float(ahead.max()))
        found["retreat_mm"].append(float((np.maximum.accumulate(ahead) - ahead).max()))
    return {name: np.outer(column, yaws / -0.042) for name, column in found.items()}


def in_space(table: pd.DataFrame, tensions: np.ndarray, yaws: np.ndarray) -> Figures:
    """The figures of the belts of one friction, shape (tensions, yaws)."""
    rows = table.sort_values(["tension_n_per_mm2", "yaw_deg"], ascending=[True, False])
    rows = rows.assign(early_mm=rows["y1_3m_mm"].abs())
    return {name: rows[name].to_numpy().reshape(len(tensions), len(yaws)) for name in COLUMNS}


@style.picture
def draw(
    path: Path, tensions: np.ndarray, yaws: np.ndarray, rows: dict[str, Figures], added: dict[str, Figures]
) -> Path:
    """A column a figure; a row a model, one scale of colours for all, and a row for what each friction adds."""
    count = len(rows) + len(added)
    fig, axes = style.figure(12.5, 2.7 * count + 0.6, count, len(COLUMNS), sharex=True, sharey=True)
    for k, (name, words) in enumerate(COLUMNS.items()):
        column = [line[k] for line in axes]
        usual, more = column[: len(rows)], column[len(rows) :]
        values = [row[name] for row in rows.values()]
        scale = {"vmin": min(0.0, *(float(v.min()) for v in values)), "vmax": max(float(v.max()) for v in values)}
        for ax, (model, row) in zip(usual, rows.items(), strict=True):
            drawn = _field(ax, tensions, yaws, row[name], "" if k else model, cmap="viridis_r", **scale)
        fig.colorbar(drawn, ax=usual, label=words, location="bottom", shrink=0.9)
        parts = [100.0 * row[name] / np.abs(values[-1]).max() for row in added.values()]
        most = max(float(np.nanmax(np.abs(part))) for part in parts)
        for ax, friction, part in zip(more, added, parts, strict=True):
            drawn = _field(ax, tensions, yaws, part, "" if k else friction, cmap="RdBu_r", vmin=-most, vmax=most)
        fig.colorbar(drawn, ax=more, label="% of the largest of the column", location="bottom", shrink=0.9)
        column[-1].set_xlabel("tension [N/mm$^2$]")
    fig.supylabel("yaw of the tail [degrees]", fontsize="medium")
    style.title(fig, "3D belts over tension, yaw and friction, and the strip law")
    return style.save(fig, path)


def _field(ax: Any, tensions: np.ndarray, yaws: np.ndarray, values: np.ndarray, title: str, **look: Any) -> Any:
    drawn = ax.pcolormesh(tensions, yaws, values.T, shading="nearest", **look)
    ax.grid(False)
    ax.set(xscale="log", title=title)
    ax.set_xticks([5, 10, 20, 40, 60], ["5", "10", "20", "40", "60"])
    ax.minorticks_off()
    return drawn


def compare() -> None:
    """Print how far sticking belts are from the law, and what friction adds to them; draw."""
    table = pd.read_csv(TABLE)
    tensions, yaws = np.unique(table["tension_n_per_mm2"]), np.unique(table["yaw_deg"])[::-1]
    space = {float(str(friction)): in_space(part, tensions, yaws) for friction, part in table.groupby("friction")}
    stuck, law = space.pop(STICKING), by_law(tensions, yaws)
    print(f"{sum(int(np.isnan(s['rate1']).sum()) for s in space.values())} cases failed")
    added = {f: {n: space[f][n] - stuck[n] for n in COLUMNS} for f in sorted(space, reverse=True)}
    for name, words in COLUMNS.items():
        print(
            f"{words}: law {np.abs(stuck[name] - law[name]).max():.3g} off, of {np.abs(stuck[name]).max():.3g}", end=""
        )
        print(
            "".join(
                f"; friction {f:g}: {np.nanmin(d[name]):+.3g} to {np.nanmax(d[name]):+.3g}" for f, d in added.items()
            )
        )
    told = {f"friction {f:g} adds": d for f, d in added.items()}
    draw(PICTURE, tensions, yaws, {"strip law": law, "in 3D, sticking": stuck}, told)


def main(arguments: list[str]) -> None:
    """Run the map into the named file, or compare what is stored."""
    prepare(space=bool(arguments))
    if not arguments:
        return compare()
    side, far = (int(arguments[1]) if len(arguments) > 1 else 16), float(arguments[2]) if len(arguments) > 2 else 60.0
    yaws = [Schedule.step(-0.042 * DEGREE * k / side) for k in range(1, side + 1)]
    settings = [Settings(tension=t * N_PER_MM2, yaw=yaw) for t in np.geomspace(5.0, 60.0, side) for yaw in yaws]
    cases = [Case(rig=TEST_RIG, belt=PAPER_BELT, settings=s) for s in settings]
    quasi_static_map(cases, [float(f) for f in arguments[3:]] or [np.inf], far, Path(arguments[0]))


if __name__ == "__main__":
    main(sys.argv[1:])
