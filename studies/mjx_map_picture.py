"""The map of 3D belts beside the strip law: ``python -m studies.mjx_map_picture``.

Reads docs/maps/tension_yaw_3d.csv, marches the strip law at its tensions, and draws docs/images/tension_yaw_3d.png.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

import belt_sim as bs
from belt_sim.curves import late_rates
from belt_sim.jax_setup import prepare
from belt_sim.pictures import style
from belt_sim.si import MM, MM_PER_M

TABLE, PICTURE = Path("docs/maps/tension_yaw_3d.csv"), Path("docs/images/tension_yaw_3d.png")
COLUMNS = {
    "rate1": "late rate of point 1, 48-60 m [mm/m]",
    "most_mm": "furthest of point 1 [mm]",
    "retreat_mm": "retreat of point 1 [mm]",
}


def by_law(tensions: np.ndarray, yaws: np.ndarray) -> dict[str, np.ndarray]:
    """The same figures by the strip law, shape (tensions, yaws): it is linear in the yaw."""
    found: dict[str, list[float]] = {name: [] for name in COLUMNS}
    for tension in tensions:
        curves = bs.simulate(model="strip", tension=float(tension), yaw=-0.042, travel=60.0).curves
        assert curves is not None
        ahead = -np.asarray(curves.y)[0] / MM
        found["rate1"].append(float(late_rates(curves)[0]) / MM_PER_M)
        found["most_mm"].append(float(ahead.max()))
        found["retreat_mm"].append(float((np.maximum.accumulate(ahead) - ahead).max()))
    return {name: np.outer(column, yaws / -0.042) for name, column in found.items()}


@style.picture
def draw(path: Path, tensions: np.ndarray, yaws: np.ndarray, rows: dict[str, dict[str, np.ndarray]]) -> Path:
    """A column a figure, a row a model, one scale of colours for both."""
    fig, axes = style.figure(11.0, 6.2, len(rows), len(COLUMNS), sharex=True, sharey=True)
    for k, (name, words) in enumerate(COLUMNS.items()):
        limit = max(float(np.abs(row[name]).max()) for row in rows.values())
        for j, (model, row) in enumerate(rows.items()):
            ax = axes[j][k]
            low = (
                -limit if row[name].min() < 0.0 < row[name].max() else min(0.0, float(np.sign(row[name].min())) * limit)
            )
            look: dict[str, Any] = {"cmap": "viridis_r", "vmin": low, "vmax": limit if row[name].max() > 0.0 else 0.0}
            drawn = ax.pcolormesh(tensions, yaws, row[name].T, shading="nearest", **look)
            ax.grid(False)
            ax.set(xscale="log", title=f"{model}" if k else model)
            ax.set_xticks([5, 10, 20, 40, 60], ["5", "10", "20", "40", "60"])
            ax.minorticks_off()
            if j == len(rows) - 1:
                ax.set_xlabel("tension [N/mm$^2$]")
            if k == 0:
                ax.set_ylabel("yaw of the tail [degrees]")
        fig.colorbar(drawn, ax=[row[k] for row in axes], label=words, location="bottom", shrink=0.8)
    style.title(fig, "256 belts in 3D over tension and yaw, and the strip law")
    return style.save(fig, path)


def main() -> None:
    """Read, march, draw; prints how far the two are apart."""
    prepare()
    table = pd.read_csv(TABLE)
    tensions, yaws = np.unique(table["tension_n_per_mm2"]), np.unique(table["yaw_deg"])[::-1]
    grids = table.sort_values(["tension_n_per_mm2", "yaw_deg"], ascending=[True, False])
    space = {n: grids[n].to_numpy().reshape(len(tensions), len(yaws)) for n in COLUMNS}
    law = by_law(tensions, yaws)
    for name, words in COLUMNS.items():
        print(f"{words}: at most {np.abs(space[name] - law[name]).max():.3g} apart, of {np.abs(law[name]).max():.3g}")
    draw(PICTURE, tensions, yaws, {"in 3D": space, "strip law": law})


if __name__ == "__main__":
    main()
