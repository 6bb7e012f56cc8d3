"""Fig. 10: the real position of points 1-4 at low belt tension."""

from pathlib import Path

import numpy as np

from belt_sim.line.runup import sag_angle
from belt_sim.show import style
from belt_sim.show.style import CYCLE, FAINT, INK
from belt_sim.space.loop import Catenary
from studies.paper import drawing
from studies.paper.case import TEST_RIG, YAW
from studies.paper.models import MEASURED, case_at, x_m
from studies.paper.plate import Plate, column

NUMBER, TITLE = 10, "Real position of points 1 - 4 at low belt tension"
FINE = np.arange(4.0, 60.5, 0.5)  # [N/mm2]
NEAR, TOP = 0.9, 0.045  # [m] of the machine that is drawn in front of the tail pulley; beside its top
LINKS = 400


def plate(in_space: bool = True) -> Plate:
    """Catenaries that touch the pulleys, the angle psi at which they do, effective yaw and roll."""
    numbers: dict = {"tension_N_per_mm2": column(FINE)}
    psi = np.array([float(sag_angle(case_at(t))) for t in FINE])
    numbers |= {"psi_mrad": column(psi * 1e3), "yaw_share": column(np.cos(psi)), "roll_share": column(np.sin(psi))}
    for tension in MEASURED:
        numbers[f"{tension:g}_N_per_mm2"] = _spans(tension)
    caption = (
        "Left: the tail pulley of the test rig from the side, spans as catenaries that touch both pulleys, dots at "
        "points 1 and 2. Right: the angle psi between the point and the top of the pulley, and what is left there of "
        "the yaw: beta cos(psi) as yaw, beta sin(psi) as roll. At 7 N/mm2 "
        f"{100.0 * (1.0 - np.cos(float(sag_angle(case_at(7.0))))):.2f} % of the yaw is lost."
    )
    return Plate(number=NUMBER, title=TITLE, caption=caption, numbers=numbers, draw=lambda p: _draw(p, numbers))


def _spans(tension: float) -> dict:
    case, a, radius = case_at(tension), TEST_RIG.centre_distance, TEST_RIG.tail_radius
    found: dict = {}
    for name, side in (("upper", 1.0), ("lower", -1.0)):
        span = Catenary.from_circles(a, side * radius, side * radius, float(case.sag_curvature))
        x, z = np.concatenate([span.start[None], span.divide(LINKS), _end(span)[None]]).T
        near = x >= a - NEAR
        found |= {f"{name}_x_m": column(x_m(x[near], a)), f"{name}_z_m": column(z[near])}
        found[f"{name}_psi_mrad"] = 1e3 * span.slopes[1]
        found[f"{name}_sag_mm"] = 1e3 * (side * radius - float(z.min()))
    return found


def _end(span: Catenary) -> np.ndarray:
    """Where it meets the tail pulley, x and z [m]."""
    rise = span.run * np.sinh(span.middle) * (np.sinh(span.half) / span.half)
    return span.start + np.array([span.run, rise])


@style.picture
def _draw(path: Path, n: dict) -> Path:
    fig, axes = drawing.mosaic(9.6, 6.4, [["side", "psi"], ["top", "share"]], width_ratios=[1.35, 1.0])
    for ax in (axes["side"], axes["top"]):
        _pulley_and_spans(ax, n, points=ax is axes["side"])
        ax.set(xlabel="x from the tail pulley [m]", ylabel="z [m]")
    axes["side"].set(xlim=(-0.22, NEAR), ylim=(-0.26, 0.26), aspect="equal", title="Tail pulley from the side")
    axes["side"].legend(loc="center right")
    radius = TEST_RIG.tail_radius
    axes["top"].set(xlim=(-0.02, TOP), ylim=(radius - 0.0055, radius + 0.0012), title="Its top, z enlarged")
    for k, tension in enumerate(MEASURED):
        psi = [n[f"{tension:g}_N_per_mm2"][f"{name}_psi_mrad"] for name in ("upper", "lower")]
        axes["psi"].plot([tension] * 2, np.abs(psi), "o", color=CYCLE[k], markersize=5, zorder=4)
    _against_tension(axes, n)
    style.title(fig, TITLE)
    return style.save(fig, path)


def _pulley_and_spans(ax, n: dict, *, points: bool) -> None:
    """The circle of the tail pulley, both spans at each tension, dots where they meet."""
    turn, radius = np.linspace(0.0, 2.0 * np.pi, 2000), TEST_RIG.tail_radius
    ax.fill(radius * np.sin(turn), radius * np.cos(turn), facecolor=FAINT, alpha=0.25, edgecolor=FAINT)
    ax.plot(0.0, 0.0, "+", color=INK)
    for k, tension in enumerate(MEASURED):
        at = n[f"{tension:g}_N_per_mm2"]
        for name, point in (("upper", "1"), ("lower", "2")):
            x, z = at[f"{name}_x_m"], at[f"{name}_z_m"]
            ax.plot(x, z, color=CYCLE[k], linewidth=1.5, label=f"{tension:g} N/mm²" if point == "1" else None)
            ax.plot(x[-1], z[-1], "o", color=CYCLE[k], markersize=5, zorder=4)
            if k == 0 and points:
                ax.annotate(point, (x[-1], z[-1]), xytext=(0, 8 if point == "1" else -16), textcoords="offset points",
                            ha="center", fontweight="bold")  # fmt: skip


def _against_tension(axes: dict, n: dict) -> None:
    s, share = n["tension_N_per_mm2"], np.array(n["yaw_share"])
    axes["psi"].plot(s, n["psi_mrad"], color=INK, linewidth=1.4)
    axes["psi"].set(ylabel="ψ [mrad]", title="Angle of points 1-4", xlim=(0, 60), ylim=(0, None))
    axes["share"].plot(s, 100.0 * np.array(n["roll_share"]), color=INK, label="acts as roll, sin ψ")
    axes["share"].plot(s, 100.0 * (1.0 - share), color=INK, linestyle=(0, (4, 2)), label="lost as yaw, 1 - cos ψ")
    axes["share"].set(ylabel="of the yaw β [%]", xlabel="belt tension [N/mm²]", xlim=(0, 60), ylim=(0, None))
    axes["share"].set_title(f"What a yaw of {np.degrees(YAW):.3f}° does there")
    axes["share"].legend(loc="upper right")
