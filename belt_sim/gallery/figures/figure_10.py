"""Fig. 10: the real position of points 1-4 at low belt tension."""

from pathlib import Path

import numpy as np

from belt_sim.gallery import canvas
from belt_sim.gallery.frame import x_m
from belt_sim.gallery.models import MEASURED, case_at
from belt_sim.gallery.plate import Plate, View, column
from belt_sim.laws.run_up_angle import sag_angle
from belt_sim.mujoco3d.mesh.catenary import Catenary
from belt_sim.paper import TEST_RIG, YAW
from belt_sim.pictures import style
from belt_sim.pictures.colours import CYCLE, FAINT, INK

NUMBER, TITLE = 10, "Real position of points 1 - 4 at low belt tension"
FINE = np.arange(4.0, 60.5, 0.5)  # [N/mm2]
NEAR = 0.9  # [m] of the machine that is drawn in front of the tail pulley
LINKS = 400


def plate(view: View) -> Plate:
    """Catenaries that touch the pulleys, the angle psi at which they do, effective yaw and roll."""
    numbers: dict = {"tension_N_per_mm2": column(FINE)}
    psi = np.array([float(sag_angle(case_at(t))) for t in FINE])
    numbers |= {"psi_mrad": column(psi * 1e3), "yaw_share": column(np.cos(psi)), "roll_share": column(np.sin(psi))}
    for tension in MEASURED:
        numbers[f"{tension:g}_N_per_mm2"] = _spans(tension)
    caption = (
        "Left: the tail pulley of the test rig from the side, spans as catenaries that touch both pulleys, dots at "
        "points 1 and 2. Right: the angle psi between the point and the top of the pulley, and what is left there of "
        "the yaw: beta cos(psi) as yaw, beta sin(psi) as roll. Below 0.2 % of the yaw is lost at 7 N/mm2."
    )
    return Plate(number=NUMBER, title=TITLE, caption=caption, numbers=numbers, draw=lambda p: _draw(p, numbers))


def _spans(tension: float) -> dict:
    case, a, radius = case_at(tension), TEST_RIG.centre_distance, TEST_RIG.tail_radius
    found: dict = {}
    for name, side in (("upper", 1.0), ("lower", -1.0)):
        span = Catenary.touching(a, side * radius, side * radius, float(case.sag_curvature))
        x, z = np.concatenate([span.start[None], span.divide(LINKS), _end(span)[None]]).T
        near = x >= a - NEAR
        found |= {f"{name}_x_m": column(x_m(x[near], a)), f"{name}_z_m": column(z[near])}
        found[f"{name}_psi_mrad"] = 1e3 * span.slopes[1]
        found[f"{name}_sag_mm"] = 1e3 * (side * radius - float(z.min()))
    return found


def _end(span: Catenary) -> np.ndarray:
    """Where it meets the tail pulley, x and z [m]."""
    rise = span.run * np.sinh(span.middle) * (np.sinh(span.half) / span.half)
    return span.start + [span.run, rise]


@style.picture
def _draw(path: Path, n: dict) -> Path:
    fig, axes = canvas.mosaic(9.6, 5.2, [["side", "psi"], ["side", "share"]], width_ratios=[1.35, 1.0])
    side = axes["side"]
    turn, radius = np.linspace(0.0, 2.0 * np.pi, 200), TEST_RIG.tail_radius
    side.fill(radius * np.sin(turn), radius * np.cos(turn), facecolor=FAINT, alpha=0.25, edgecolor=FAINT)
    side.plot(0.0, 0.0, "+", color=INK)
    for k, tension in enumerate(MEASURED):
        at = n[f"{tension:g}_N_per_mm2"]
        for name, point in (("upper", "1"), ("lower", "2")):
            x, z = at[f"{name}_x_m"], at[f"{name}_z_m"]
            side.plot(x, z, color=CYCLE[k], linewidth=1.5, label=f"{tension:g} N/mm²" if point == "1" else None)
            side.plot(x[-1], z[-1], "o", color=CYCLE[k], markersize=5, zorder=4)
            axes["psi"].plot(tension, at[f"{name}_psi_mrad"], "o", color=CYCLE[k], markersize=5, zorder=4)
            if k == 0:
                side.annotate(point, (x[-1], z[-1]), xytext=(2, 8 if point == "1" else -14), textcoords="offset points",
                              fontweight="bold")  # fmt: skip
    side.set(xlabel="x from the tail pulley [m]", ylabel="z [m]", xlim=(-0.22, NEAR), aspect="equal")
    side.legend(loc="center right")
    _against_tension(axes, n)
    style.title(fig, TITLE)
    return style.save(fig, path)


def _against_tension(axes: dict, n: dict) -> None:
    s, share = n["tension_N_per_mm2"], np.array(n["yaw_share"])
    axes["psi"].plot(s, n["psi_mrad"], color=INK, linewidth=1.4)
    axes["psi"].set(ylabel="ψ [mrad]", title="Angle of points 1-4", xlim=(0, 60), ylim=(0, None))
    axes["share"].plot(s, 100.0 * np.array(n["roll_share"]), color=INK, label="acts as roll, sin ψ")
    axes["share"].plot(s, 100.0 * (1.0 - share), color=INK, linestyle=(0, (4, 2)), label="lost as yaw, 1 - cos ψ")
    axes["share"].set(ylabel="of the yaw β [%]", xlabel="belt tension [N/mm²]", xlim=(0, 60), ylim=(0, None))
    axes["share"].set_title(f"What a yaw of {np.degrees(YAW):.3f}° does there")
    axes["share"].legend(loc="upper right")
