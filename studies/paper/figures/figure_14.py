"""Fig. 14: a slack belt at 10 N/mm2 tilts when its pulley is yawed."""

from pathlib import Path

import numpy as np

from belt_sim.model import analytic_model
from belt_sim.show import style
from belt_sim.show.geometry import tilt
from belt_sim.show.style import BLUE, INK, RED
from studies.paper import drawing
from studies.paper.case import PAPER_BELT, TEST_RIG, YAW
from studies.paper.drawing import Oblique
from studies.paper.models import case_at, moving, x_m
from studies.paper.plate import Plate, column
from studies.paper.span_shape import SpanShape, span_shape
from studies.paper.stored_runs import Shape, stored_run

NUMBER, TITLE = 14, "Low tensioned belt at 10 N/mm², deformation after yawing the pulley"
TENSION, AT = 10.0, 3.0  # [N/mm2]; [m] of travel, near the greatest tilt of the upper span
IN_SPACE = "flex_10_tilted"
SPANS = {"upper": (3, 0), "lower": (1, 2)}  # run-off and run-up point, from 0
DRAWN = Oblique(width=5.0, lateral=60.0, height=3.0, tilt=15.0, radius=TEST_RIG.tail_radius,
                centre_distance=TEST_RIG.centre_distance, half_width=0.5 * PAPER_BELT.width)  # fmt: skip


def plate(in_space: bool = True) -> Plate:
    """Tilt of every cross-section by the strip law, and of the stored belt in 3D."""
    numbers: dict = {"tension_N_per_mm2": TENSION, "travel_m": AT}
    shapes = {name: _span(name) for name in SPANS}
    for name, shape in shapes.items():
        numbers[name] = {"x_m": column(_machine_x(name, shape)), "tilt_mrad": column(1e3 * shape.tilt)}
    greatest = max(float(np.abs(s.tilt).max()) for s in shapes.values())
    numbers["greatest_tilt_mrad"] = 1e3 * greatest
    numbers["edges_apart_in_height_mm"] = 1e3 * greatest * PAPER_BELT.width
    if in_space:
        numbers["mujoco_flex"] = _in_space()
    caption = (
        f"{AT:g} m after a yaw of -0.042 degrees. Above: the belt by the strip law, its width 5, sag 3, sideways "
        "movement 60 and tilt 45 times enlarged. Below: tilt of its cross-sections, positive where the edge at the "
        f"paper's +y hangs lower: up to {numbers['greatest_tilt_mrad']:.1f} mrad, which is "
        f"{numbers['edges_apart_in_height_mm']:.1f} mm between the edges. In the paper this is a photograph of the rig."
    )
    return Plate(number=NUMBER, title=TITLE, caption=caption, numbers=numbers, draw=lambda p: _draw(p, numbers, shapes),
                 stored=(IN_SPACE,) if in_space else ())  # fmt: skip


def _span(name: str) -> SpanShape:
    """By the strip law, from what the march holds at its ends; tilt about the machine's x."""
    off, up = SPANS[name]
    curves = moving("strip", TENSION)
    k = int(np.argmin(np.abs(np.asarray(curves.travel) - AT)))
    ends = [(float(r[off, k]), float(r[up, k])) for r in (np.asarray(curves.y), np.asarray(curves.angle))]
    return span_shape(case_at(TENSION), analytic_model("strip"), *ends)


def _machine_x(name: str, shape: SpanShape) -> np.ndarray:
    """From the tail pulley [m]: the upper span runs towards it, the lower away from it."""
    return x_m(shape.x, TEST_RIG.centre_distance) if name == "upper" else shape.x


def _in_space() -> dict:
    """Tilt along both spans of the stored belt."""
    shape = stored_run(IN_SPACE).shape_at(AT)
    x, z = shape.middle[:, 0], shape.middle[:, 2]
    angle = tilt(shape.left, shape.right)
    found: dict = {"travel_m": shape.travel}
    for name, side in (("upper", z > 0.0), ("lower", z <= 0.0)):
        free = side & (x > 0.0) & (x < shape.tail_x)
        found[name] = {"x_m": column(x_m(x[free], shape.tail_x)), "tilt_mrad": column(1e3 * angle[free])}
    return found


@style.picture
def _draw(path: Path, n: dict, shapes: dict[str, SpanShape]) -> Path:
    fig, axes = drawing.mosaic(9.6, 5.8, [["belt", "belt"], ["upper", "lower"]], height_ratios=[0.9, 1.0])
    belt = _ribbon(shapes)
    DRAWN.pulleys(axes["belt"], YAW)
    drawn = DRAWN.belt(axes["belt"], belt, 1e3 * tilt(belt.left, belt.right))
    fig.colorbar(drawn, ax=axes["belt"], label="tilt [mrad]", shrink=0.8, pad=0.01)
    DRAWN.name_pulleys(axes["belt"])
    drawing.bare(axes["belt"])
    for name, title in (("upper", "Upper span"), ("lower", "Lower span")):
        ax = axes[name]
        ax.plot(n[name]["x_m"], n[name]["tilt_mrad"], color=BLUE, label="hanging strip")
        if "mujoco_flex" in n:
            at = n["mujoco_flex"][name]
            ax.plot(at["x_m"][::6], at["tilt_mrad"][::6], "o", color=INK, markersize=2.6, label="belt in 3D (stored)")
        ax.plot([0.0, TEST_RIG.centre_distance], [0.0, 0.0], color=RED, linewidth=1.2, label="beams: no tilt")
        ax.set(xlabel="x from the tail pulley [m]", title=title, xlim=(0.0, TEST_RIG.centre_distance))
    axes["upper"].set_ylabel("tilt [mrad]")
    axes["upper"].legend(loc="best")
    style.title(fig, "The belt tilts: 10 N/mm² after a yaw")
    return style.save(fig, path)


def _ribbon(shapes: dict[str, SpanShape]) -> Shape:
    """The belt of the strip law as edges in space: both spans hanging, and the wraps."""
    a, radius, sag = TEST_RIG.centre_distance, TEST_RIG.tail_radius, float(case_at(TENSION).sag_curvature)
    up, low = shapes["upper"], shapes["lower"]
    turn = np.linspace(0.0, np.pi, 24)[1:-1]
    rows = [np.stack([up.x, up.y, radius - 0.5 * sag * up.x * (a - up.x), up.tilt], axis=1),
            _wrap(a, radius * np.array([np.sin(turn), np.cos(turn)]), up.y[-1], low.y[0]),
            np.stack([a - low.x, low.y, -radius - 0.5 * sag * low.x * (a - low.x), low.tilt], axis=1),
            _wrap(0.0, -radius * np.array([np.sin(turn), np.cos(turn)]), low.y[-1], up.y[0])]  # fmt: skip
    x, y, z, roll = np.concatenate(rows).T
    half = 0.5 * PAPER_BELT.width
    across = np.stack([np.zeros_like(x), np.full_like(x, half), half * np.sin(roll)], axis=1)
    middle = np.stack([x, y, z], axis=1)
    return Shape(travel=AT, tail_x=a, yaw=YAW, left=middle + across, right=middle - across)


def _wrap(x: float, circle: np.ndarray, begin: float, end: float) -> np.ndarray:
    """Half a turn on a pulley, rows of x, y, z, tilt."""
    steps = circle.shape[1]
    return np.stack([x + circle[0], np.linspace(begin, end, steps), circle[1], np.zeros(steps)], axis=1)
