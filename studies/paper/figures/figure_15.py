"""Fig. 15: a highly tensioned particle chain on two pulleys, one of them yawed, at three moments."""

from pathlib import Path

import numpy as np

from belt_sim.show import style
from belt_sim.show.style import BLUE, FAINT
from studies.paper import drawing
from studies.paper.case import ROPE_EXAMPLE, YAW
from studies.paper.drawing import Oblique
from studies.paper.models import y_mm
from studies.paper.plate import Plate, column
from studies.paper.stored_runs import Shape, stored_run

NUMBER, TITLE = 15, "Lateral movement of a particle chain"
RUN, MOMENTS = "rope_100", (0.0, 5.0, 21.4)  # [m] of travel
DRAWN = Oblique(width=1.0, lateral=50.0, height=1.0, tilt=1.0, radius=ROPE_EXAMPLE.tail_radius,
                centre_distance=ROPE_EXAMPLE.centre_distance, half_width=0.36)  # fmt: skip


def plate(in_space: bool = True) -> Plate:
    """Particles of the stored rope in 3D at three travels."""
    run = stored_run(RUN)
    shapes = [run.shape_at(travel) for travel in MOMENTS]
    numbers = {"travel_m": column([s.travel for s in shapes]), "particles": len(shapes[0].left)}
    for k, shape in enumerate(shapes):
        x, y, z = shape.middle.T
        numbers[f"moment_{k + 1}"] = {"x_m": column(shape.tail_x - x), "y_mm": column(y_mm(y)), "z_m": column(z)}
    caption = (
        f"A chain of {numbers['particles']} particles at 100 N/mm2 in three dimensions, centre distance 2 m, tail "
        f"pulley yawed by -0.042 degrees; sideways movements and yaw {DRAWN.lateral:g} times enlarged."
    )
    return Plate(number=NUMBER, title=TITLE, caption=caption, numbers=numbers, draw=lambda p: _draw(p, shapes),
                 stored=(RUN,))  # fmt: skip


@style.picture
def _draw(path: Path, shapes: list[Shape]) -> Path:
    fig, axes = style.figure(9.6, 2.1, 1, 3, sharex=True, sharey=True)
    for ax, shape in zip(axes[0], shapes, strict=True):
        DRAWN.pulleys(ax, YAW)
        line = DRAWN.flat(np.array([[-0.2, 0.0, 0.0], [ROPE_EXAMPLE.centre_distance + 0.2, 0.0, 0.0]]))
        ax.plot(*line.T, color=FAINT, linewidth=0.8, linestyle=(0, (6, 3)))
        DRAWN.rope(ax, shape, BLUE)
        drawing.bare(ax)
        ax.set_title(f"{shape.travel:.1f} m of travel")
    style.title(fig, f"{TITLE}: 100 N/mm²")
    return style.save(fig, path)
