"""Figures 2 to 14 of the paper: what the laws of the belt say, and the stored belts in 3D beside them as dots."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from belt_sim.case import Schedule
from belt_sim.line.runup import sag_angle
from belt_sim.model import analytic_model
from belt_sim.show import style
from belt_sim.show.geometry import tilt
from belt_sim.show.style import AMBER, BLUE, CYCLE, FAINT, INK, POINT_NAMES, POINTS, RED
from belt_sim.space.loop import Catenary
from belt_sim.units import DEGREE, MM
from studies.closed_forms import steady_offsets
from studies.paper import drawing
from studies.paper.case import PAPER_BELT, ROPE_EXAMPLE, TEST_RIG, YAW
from studies.paper.drawing import bare, note, zero_line
from studies.paper.models import (
    LOOKS,
    MEASURED,
    MOVING,
    TRAVEL,
    SpanShape,
    case_at,
    moving,
    rate_mm_per_m,
    read_rate,
    span_shape,
    steady,
    x_m,
    y_mm,
)
from studies.paper.plate import Plate, column
from studies.paper.stored_runs import SETTLED, Shape, stored_run

TURN = 2.0 * math.pi * ROPE_EXAMPLE.tail_radius  # [m] of travel, a revolution of the pulleys
IN_SPACE = "mujoco_flex"


def moving_curve(in_space: bool) -> Plate:
    """Points 1 and 4 against travel, the steady rate and the steady offset (paper eq. 2)."""
    tension, name, travel, read, across = 100.0, "beam_th2", 45.0, (30.0, 38.0), 42.0  # [N/mm2]; [m]
    case, model = case_at(tension), analytic_model(name)
    curves, (upper, _) = model.run(case, travel=travel), steady_offsets(case, model)
    rate, offset = float(rate_mm_per_m(steady(name, tension))), float(y_mm(upper))
    s, y1, y4 = column(curves.travel), column(y_mm(curves.y[0])), column(y_mm(curves.y[3]))

    def draw() -> Any:
        fig, [[ax]] = style.figure(8.0, 4.6)
        ax.plot(s, y1, color=POINTS[0], label="run-up point 1")
        ax.plot(s, y4, color=POINTS[3], label="run-off point 4")
        zero_line(ax)
        (begin, end), (low, high) = read, np.interp(read, s, y4)
        ax.plot([begin, end, end], [low, low, high], color=POINTS[3], linewidth=1.0)
        words = f"Δx\nsteady-state velocity\nΔy/Δx = {rate:.3f} mm/m"
        note(ax, words, (0.5 * (begin + end), low), (0, -4), ha="center", va="top")
        note(ax, "Δy", (end, 0.5 * (low + high)), (5, 0), va="center")
        ends = [float(np.interp(across, s, y)) for y in (y4, y1)]
        ax.annotate("", (across, ends[1]), (across, ends[0]), arrowprops=drawing.BOTH_WAYS)
        words = f"steady-state\noffset {offset:.2f} mm"
        note(ax, words, (across, 0.5 * sum(ends)), (-6, 0), ha="right", va="center", color=INK)
        ax.set(xlabel=drawing.TRAVEL_LABEL, ylabel=drawing.Y_LABEL, xlim=(0.0, travel))
        ax.legend(loc="upper left")
        style.title(fig, f"Characteristic belt moving curve: {tension:g} N/mm², upper span")
        return fig

    return Plate(
        number=2, title="Characteristic belt moving curve", draw=draw,
        numbers={"tension_N_per_mm2": tension, "travel_m": s, "y1_mm": y1, "y4_mm": y4, "steady_rate_mm_per_m": rate,
                 "steady_offset_mm": offset},
        caption=f"Upper span of the test rig at {tension:g} N/mm2, beam of 2nd order: after the transient, both of its "
        f"ends move at {rate:.4f} mm per m of travel, {offset:.2f} mm apart (closed forms of rate and offset; eq. 2).",
    )  # fmt: skip


def rope_step_by_step(in_space: bool) -> Plate:
    """Points 1-4 of the rope model at six moments."""
    step, half = 0.01, 0.5 * TURN  # [m] of travel
    moments = {
        "I  tail pulley yawed": 0.0,
        "II  point 1 moves": 0.25,
        "III  point 2 begins": half + 2 * step,
        "IV  the lower span turns": half + 0.25,
        "V  point 3 speeds up": 2 * half - step,
        "VI  point 4 begins, all move": 2 * half + 0.35,
    }
    at = [*moments.values()]
    curves = replace(analytic_model("rope"), step=step, keep=step).run(case_at(100.0, short=True), travel=1.5)
    y = [column(y_mm([np.interp(s, curves.travel, row) for s in at])) for row in curves.y]
    a, radius = ROPE_EXAMPLE.centre_distance, ROPE_EXAMPLE.tail_radius

    def draw_moment(ax: Any, y: list[float]) -> None:
        for middle, turn in ((0.0, YAW), (a, 0.0)):
            ax.axvspan(middle - radius, middle + radius, color=FAINT, alpha=0.25, linewidth=0)
            ends = np.array([-radius, radius])
            for start in np.arange(-1.0, 1.4, 0.2):
                ax.plot(middle + ends, start + turn / MM * ends, color=FAINT, linewidth=0.7)
        ax.plot([0.0, a], [y[0], y[3]], color=INK, linewidth=1.6)
        ax.plot([0.0, a], [y[1], y[2]], color=INK, linewidth=1.4, linestyle=(0, (4, 2)))
        above = 7 if y[3] >= y[2] else -8  # of the two at the head pulley, where point 4 is written
        for place, k, up in ((0.0, 0, 7), (0.0, 1, -8), (a, 2, -1 - above), (a, 3, above)):
            ax.plot(place, y[k], "o", color=POINTS[k], markersize=6, zorder=3)
            beside = (-9 if place == 0.0 else 9, up)
            note(ax, f"{k + 1}", (place, y[k]), beside, ha="center", va="center", color=POINTS[k], fontweight="bold")
        ax.grid(False)
        ax.set(xlim=(-0.35, a + 0.35), ylim=(-0.35, 1.0))

    def draw() -> Any:
        fig, axes = style.figure(9.6, 5.0, 2, 3, sharex=True, sharey=True)
        for k, (ax, name) in enumerate(zip([*axes[0], *axes[1]], moments, strict=True)):
            draw_moment(ax, [row[k] for row in y])
            ax.set_title(f"{name}", fontsize=style.FONT)
            words, small = f"{at[k]:.2f} m of travel", style.FONT - 1.5
            ax.annotate(words, (0.5, 0.03), xycoords="axes fraction", ha="center", fontsize=small)
        for row in axes:
            row[0].set_ylabel("y [mm]")
        for ax in axes[1]:
            ax.set_xlabel("x from the tail pulley [m]")
        style.title(fig, "Lateral movement of the rope: rope model")
        return fig

    return Plate(
        number=5, title="Lateral movement of the rope", draw=draw,
        numbers={"travel_m": column(at)} | {f"y{k + 1}_mm": row for k, row in enumerate(y)},
        caption="Rope model seen from above, centre distance 2 m, pulley radius 170 mm: upper span full, lower span "
        "dashed. Strokes on the pulleys: the way on which their surface carries the upper span. All at one scale, "
        "y enlarged.",
    )  # fmt: skip


def rope_curves(in_space: bool) -> Plate:
    """Points 1-4 of the rope model on the short rig."""
    title, travel, record = "Moving curves of a limp rope on yawed pulleys", 10.0, 0.02  # [m]
    model, case = replace(analytic_model("rope"), step=record, keep=record), case_at(100.0, short=True)
    curves, rate = model.run(case, travel=travel), float(rate_mm_per_m(model.steady_rate(case)))
    s, y = column(curves.travel), [column(y_mm(row)) for row in curves.y]

    def draw() -> Any:
        fig, [[ax]] = style.figure(8.0, 4.6)
        for k, colour in enumerate(POINTS):
            ax.plot(s, y[k], color=colour, label=f"point {POINT_NAMES[k]}")
        zero_line(ax)
        above: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "va": "top", "fontsize": style.FONT - 1}
        for turns, name in ((0.5, "½"), (1.0, "1"), (1.5, "1½"), (2.0, "2")):
            ax.axvline(turns * TURN, color=FAINT, linewidth=0.8, linestyle=(0, (3, 3)), zorder=1)
            note(ax, name, (turns * TURN, 1.0), (3, -3), **above)
        note(ax, "revolutions of the pulleys", (2.0 * TURN, 1.0), (16, -3), **above)
        ax.set(xlabel=drawing.TRAVEL_LABEL, ylabel=drawing.Y_LABEL, xlim=(0.0, travel))
        ax.set_ylim(bottom=-0.15)
        ax.legend(loc="lower right", bbox_to_anchor=(1.0, 0.06), labelcolor="linecolor")
        style.title(fig, title)
        return fig

    return Plate(
        number=6, title=title, draw=draw,
        numbers={"travel_m": s} | {f"y{k + 1}_mm": row for k, row in enumerate(y)}
        | {"steady_rate_mm_per_m": rate, "revolution_m": TURN},
        caption="Rope model, centre distance 2 m, pulley radius 170 mm, yaw -0.042 degrees: point 2 begins after half "
        f"a revolution of the pulleys ({0.5 * TURN:.2f} m), point 4 after a whole one, and in the end all four move at "
        f"{rate:.4f} mm per m of travel.",
    )  # fmt: skip


def rope_direction(in_space: bool) -> Plate:
    """The upper span (points 1 and 4) on its way, for either sign of the yaw."""
    shown, enlarged, reach = (0.0, 5.0, 10.0, 15.0, 20.0), 150.0, 1.15  # [m]; [1]; [m] of a pulley to either side
    model, case = analytic_model("rope"), case_at(100.0, short=True)
    numbers: dict = {"travel_m": column(shown)}
    for yaw in (YAW, -YAW):
        turned = replace(case, settings=replace(case.settings, yaw=Schedule.step(yaw)))
        curves = model.run(turned, travel=shown[-1])
        at = {f"y{k}_mm": column(y_mm(np.interp(shown, curves.travel, curves.y[k - 1]))) for k in (1, 4)}
        numbers[f"yaw_{yaw / DEGREE:+.3f}_deg"] = at | {"shorter_side": "+y" if yaw < 0.0 else "-y"}
    a, radius = ROPE_EXAMPLE.centre_distance, ROPE_EXAMPLE.tail_radius

    def draw_from_above(ax: Any, yaw: float, at: dict) -> None:
        side = 1.0 if yaw < 0.0 else -1.0
        slack = side * np.array([0.0, reach])
        ax.fill_between([0.0, a], *slack, color=AMBER, alpha=0.15, linewidth=0)
        words = "axes nearer: lower tension"
        note(ax, words, (0.5 * a, slack[1]), (0, side * 4), ha="center", va="bottom" if side > 0 else "top")
        for x, turn, name in ((0.0, yaw * enlarged, "tail pulley"), (a, 0.0, "head pulley")):
            turned = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
            outline = [[-radius, -reach], [radius, -reach], [radius, reach], [-radius, reach], [-radius, -reach]]
            corners, axis = np.array(outline) @ turned + [x, 0.0], np.array([[0.0, -reach], [0.0, reach]]) @ turned
            ax.fill(*corners.T, facecolor=FAINT, alpha=0.25, linewidth=0)
            ax.plot(*corners.T, color=FAINT, linewidth=1.0)
            ax.plot(*(axis + np.array([x, 0.0])).T, color=INK, linewidth=0.8, linestyle=(0, (8, 2, 2, 2)))
            note(ax, name, (x, -side * reach), (0, -side * 12), ha="center", va="center")
        for k, s in enumerate(shown):
            y, shade = [at[f"y{p}_mm"][k] * MM * enlarged for p in (1, 4)], 0.35 + 0.65 * k / (len(shown) - 1)
            ax.plot([0.0, a], y, "o-", color=BLUE, markersize=4, linewidth=1.4, alpha=shade)
            note(ax, f"{s:g} m", (a, y[1]), (28, 0), va="center", fontsize=8.5)
        bare(ax)
        ax.set(xlim=(-0.5, a + 0.75), ylim=(-1.45, 1.45))

    def draw() -> Any:
        fig, axes = style.figure(9.6, 4.4, 1, 2, sharey=True)
        for ax, yaw in zip(axes[0], (YAW, -YAW), strict=True):
            draw_from_above(ax, yaw, numbers[f"yaw_{yaw / DEGREE:+.3f}_deg"])
            ax.set_title(f"yaw {yaw / DEGREE:+.3f}°")
        style.title(fig, "Direction of the rope movement: towards the lower belt tension")
        return fig

    return Plate(
        number=7, title="Direction of the rope movement", draw=draw, numbers=numbers,
        caption="Rope model seen from above: the yawed tail pulley brings the axes nearer to each other on one side, "
        "where a belt is less tight (shaded), and the rope runs there, for either sign of the yaw. Upper span every "
        f"5 m of travel; lateral movements and yaw {enlarged:g} times enlarged.",
    )  # fmt: skip


def beam_model(in_space: bool) -> Plate:
    """Bending lines with the boundary values of eq. 7, y(0) = y(a) = 0, y'(0) = beta, y'(a) = 0, and M = -EI y''."""
    tensions = (10.0, 40.0, 100.0)  # [N/mm2] of the beam of 2nd order
    shapes = {"beam_th1": ("beam_th1", 40.0)} | {f"beam_th2_{t:g}_N_per_mm2": ("beam_th2", t) for t in tensions}
    numbers: dict = {}
    for name, (model, tension) in shapes.items():
        case = case_at(tension)
        shape = span_shape(case, analytic_model(model), (0.0, 0.0), (0.0, YAW))
        numbers["x_m"] = column(x_m(shape.x, case.rig.centre_distance))
        moment = float(case.belt.bending_stiffness) * shape.curvature  # -EI y'', with y of the paper
        numbers[name] = {"y_mm": column(y_mm(shape.y)), "moment_Nm": column(moment)}
    entry = 4.0 * float(case_at(40.0).belt.bending_stiffness) * YAW / TEST_RIG.centre_distance  # eq. 17
    numbers["first_order_entry_moment_Nm"] = entry

    def draw() -> Any:
        fig, [[line], [moment]] = style.figure(8.0, 6.2, 2, 1, sharex=True)
        for k, name in enumerate(shapes):
            look: dict[str, Any] = LOOKS["beam_th1"].line | {"linewidth": 2.4}
            if k:
                words = f"beam, 2nd order, {tensions[k - 1]:g} N/mm²"
                look = {"color": RED, "alpha": 0.1 + 0.3 * k, "label": words, "linewidth": 1.5}
            line.plot(numbers["x_m"], numbers[name]["y_mm"], **look)
            moment.plot(numbers["x_m"], numbers[name]["moment_Nm"], **look)
        steep = np.array([0.0, 1.6])
        line.plot(steep, YAW * steep / MM, color=INK, linewidth=1.0, linestyle=(0, (4, 2)))
        note(line, "slope β", (steep[1], YAW * steep[1] / MM), (5, 0), va="center")
        ends = (0.0, "1: y = 0, y' = β", 8, "left"), (TEST_RIG.centre_distance, "4: y = 0, y' = 0", -8, "right")
        for place, name, aside, side in ends:
            line.plot(place, 0.0, "o", color=INK, markersize=6, clip_on=False, zorder=4)
            note(line, name, (place, 0.0), (aside, 8), ha=side)
        for ax in (line, moment):
            zero_line(ax)
        line.set(ylabel="y [mm]", title="Bending line", ylim=(-1.35, 0.25))
        moment.set(xlabel="x from run-up point 1 [m]", ylabel="bending moment M [N m]", title="Bending moment")
        moment.legend(loc="best")
        style.title(fig, "The beam model: a span between its pulleys, one of them yawed")
        return fig

    return Plate(
        number=8, title="The beam model", draw=draw, numbers=numbers,
        caption="Upper span of the test rig right after a yaw of -0.042 degrees, boundary values of eq. 7: run-up "
        f"point 1 at x = 0. The entry moment by Th 1. O is 4 EI β/a = {entry:.2f} N m.",
    )  # fmt: skip


BOUNDED = (1.0, 10.0, 40.0, 100.0, 1000.0, 10000.0)  # [N/mm2] of the beam of 2nd order


def bounds(in_space: bool) -> Plate:
    """y of point 1 on the test rig by the paper's three models."""
    numbers = {"travel_m": column(moving("rope", 40.0).travel)}
    numbers |= {f"{model}_y1_mm": column(y_mm(moving(model, 40.0).y[0])) for model in ("rope", "beam_th1")}
    numbers |= {f"beam_th2_{t:g}_N_per_mm2_y1_mm": column(y_mm(moving("beam_th2", t).y[0])) for t in BOUNDED}

    def draw() -> Any:
        fig, [[ax]] = style.figure(8.0, 5.0)
        s = numbers["travel_m"]
        ax.fill_between(s, numbers["beam_th1_y1_mm"], numbers["rope_y1_mm"], color=FAINT, alpha=0.18, linewidth=0)
        named: dict[str, Any] = {"color": RED, "annotation_clip": False}
        for k, tension in enumerate(BOUNDED):
            y, shade = numbers[f"beam_th2_{tension:g}_N_per_mm2_y1_mm"], 0.35 + 0.65 * k / (len(BOUNDED) - 1)
            ax.plot(s, y, color=RED, alpha=shade, linewidth=1.3, label="beam, 2nd order" if k == 3 else None)
            note(ax, f"{tension:g}", (TRAVEL, y[-1]), (5, 0), va="center", fontsize=style.FONT - 1, **named)
        for model in ("rope", "beam_th1"):
            ax.plot(s, numbers[f"{model}_y1_mm"], linewidth=2.2, **LOOKS[model].line)
        zero_line(ax)
        note(ax, "N/mm²", (TRAVEL, ax.get_ylim()[1]), (5, 0), va="top", **named)
        ax.set(xlabel=drawing.TRAVEL_LABEL, ylabel="lateral position y of point 1 [mm]", xlim=(0.0, TRAVEL))
        ax.legend(loc="upper left")
        style.title(fig, "Comparison of models: point 1, test rig")
        return fig

    return Plate(
        number=9, title="Comparison of models", draw=draw, numbers=numbers,
        caption="Run-up point 1, belt 200 x 0.3 mm, test rig, yaw -0.042 degrees. At low tension the beam of 2nd order "
        "runs into that of 1st order, at very high tension into the rope (10 000 N/mm2 is no belt's: it shows the "
        "limit).",
    )  # fmt: skip


def catenaries(in_space: bool) -> Plate:
    """Catenaries that touch the pulleys, the angle psi at which they do, effective yaw and roll."""
    title = "Real position of points 1 - 4 at low belt tension"
    fine, before, beside = np.arange(4.0, 60.5, 0.5), 0.9, 0.045  # [N/mm2]; [m] drawn before the pulley; by its top
    a, radius = TEST_RIG.centre_distance, TEST_RIG.tail_radius
    psi = np.array([float(sag_angle(case_at(t))) for t in fine])
    numbers: dict = {"tension_N_per_mm2": column(fine), "psi_mrad": column(psi * 1e3)}
    numbers |= {"yaw_share": column(np.cos(psi)), "roll_share": column(np.sin(psi))}
    for tension in MEASURED:
        at = numbers[f"{tension:g}_N_per_mm2"] = {}
        for name, side in (("upper", 1.0), ("lower", -1.0)):
            curvature = float(case_at(tension).sag_curvature)
            span = Catenary.from_circles(a, side * radius, side * radius, curvature)
            end = span.start + np.array([span.run, span.run * np.sinh(span.middle) * (np.sinh(span.half) / span.half)])
            x, z = np.concatenate([span.start[None], span.divide(400), end[None]]).T
            near = x >= a - before
            at |= {f"{name}_x_m": column(x_m(x[near], a)), f"{name}_z_m": column(z[near])}
            at |= {f"{name}_psi_mrad": 1e3 * span.slopes[1], f"{name}_sag_mm": 1e3 * (side * radius - float(z.min()))}

    def draw_side(ax: Any, points: bool) -> None:
        turn = np.linspace(0.0, 2.0 * np.pi, 2000)
        ax.fill(radius * np.sin(turn), radius * np.cos(turn), facecolor=FAINT, alpha=0.25, edgecolor=FAINT)
        ax.plot(0.0, 0.0, "+", color=INK)
        for k, tension in enumerate(MEASURED):
            at = numbers[f"{tension:g}_N_per_mm2"]
            for name, point, up in (("upper", "1", 8), ("lower", "2", -16)):
                x, z = at[f"{name}_x_m"], at[f"{name}_z_m"]
                ax.plot(x, z, color=CYCLE[k], linewidth=1.5, label=f"{tension:g} N/mm²" if point == "1" else None)
                ax.plot(x[-1], z[-1], "o", color=CYCLE[k], markersize=5, zorder=4)
                if k == 0 and points:
                    note(ax, point, (x[-1], z[-1]), (0, up), ha="center", fontweight="bold")
        ax.set(xlabel="x from the tail pulley [m]", ylabel="z [m]")

    def draw() -> Any:
        fig, axes = drawing.mosaic(9.6, 6.4, [["side", "psi"], ["top", "share"]], width_ratios=[1.35, 1.0])
        side, top, angle, share = (axes[name] for name in ("side", "top", "psi", "share"))
        draw_side(side, True)
        draw_side(top, False)
        side.set(xlim=(-0.22, before), ylim=(-0.26, 0.26), aspect="equal", title="Tail pulley from the side")
        side.legend(loc="center right")
        top.set(xlim=(-0.02, beside), ylim=(radius - 0.0055, radius + 0.0012), title="Its top, z enlarged")
        for k, tension in enumerate(MEASURED):
            both = [abs(numbers[f"{tension:g}_N_per_mm2"][f"{n}_psi_mrad"]) for n in ("upper", "lower")]
            angle.plot([tension] * 2, both, "o", color=CYCLE[k], markersize=5, zorder=4)
        angle.plot(fine, numbers["psi_mrad"], color=INK, linewidth=1.4)
        angle.set(ylabel="ψ [mrad]", title="Angle of points 1-4", xlim=(0, 60), ylim=(0, None))
        share.plot(fine, 100.0 * np.sin(psi), color=INK, label="acts as roll, sin ψ")
        share.plot(fine, 100.0 * (1.0 - np.cos(psi)), color=INK, linestyle=(0, (4, 2)), label="lost as yaw, 1 - cos ψ")
        share.set(ylabel="of the yaw β [%]", xlabel="belt tension [N/mm²]", xlim=(0, 60), ylim=(0, None))
        share.set_title(f"What a yaw of {np.degrees(YAW):.3f}° does there")
        share.legend(loc="upper right")
        style.title(fig, title)
        return fig

    return Plate(
        number=10, title=title, draw=draw, numbers=numbers,
        caption="Left: the tail pulley of the test rig from the side, spans as catenaries that touch both pulleys, "
        "dots at points 1 and 2. Right: the angle psi between the point and the top of the pulley, and what is left "
        "there of the yaw: beta cos(psi) as yaw, beta sin(psi) as roll. At 7 N/mm2 "
        f"{100.0 * (1.0 - np.cos(float(sag_angle(case_at(7.0))))):.2f} % of the yaw is lost.",
    )  # fmt: skip


def starts(in_space: bool) -> Plate:
    """y of point 1 after the yaw step; Ritzinger's formula knows a rate alone, drawn as a slope."""
    s = column(moving("strip", 7.0).travel)
    by_tension: dict[str, dict] = {}
    for tension in MEASURED:
        at: dict = {f"{m}_y1_mm": column(y_mm(moving(m, tension).y[0])) for m in MOVING}
        at["ritzinger_rate_mm_per_m"] = float(rate_mm_per_m(steady("ritzinger", tension)))
        if in_space:
            curves = stored_run(f"flex_{tension:g}").curves
            early = np.asarray(curves.travel) <= TRAVEL
            at["mujoco_flex_travel_m"] = column(np.asarray(curves.travel)[early])
            at["mujoco_flex_y1_mm"] = column(y_mm(np.asarray(curves.y)[0, early]))
        by_tension[f"{tension:g}"] = at

    def draw_dots(ax: Any, at: dict, label: str | None = None) -> None:
        if in_space:
            dots = [at[f"{IN_SPACE}_{k}"][::8] for k in ("travel_m", "y1_mm")]
            ax.plot(*dots, "o", color=INK, markersize=2.6, markeredgewidth=0.0, zorder=4, label=label)

    def draw_together(ax: Any) -> None:
        dashed: dict[str, Any] = {"linewidth": 1.2, "linestyle": (0, (4, 2))}
        for colour, (tension, at) in zip(CYCLE, by_tension.items(), strict=False):
            ax.plot(s, at["beam_th2_y1_mm"], color=colour, **dashed)
            ax.plot(s, at["strip_y1_mm"], color=colour, label=f"{tension} N/mm²")
            draw_dots(ax, at)
        zero_line(ax)
        ax.set(xlim=(0.0, TRAVEL), xlabel=drawing.TRAVEL_LABEL, ylabel="lateral position y of point 1 [mm]")
        keys = [*ax.get_legend_handles_labels()[0], *ax.plot([], [], color=INK, label="beam, 2nd order", **dashed)]
        keys += ax.plot([], [], color=INK, label="hanging strip")
        if in_space:
            keys += ax.plot([], [], "o", color=INK, markersize=3, label="belt in 3D (stored)")
        ax.legend(handles=keys, loc="upper left", ncols=2)

    def draw_each(ax: Any, at: dict) -> None:
        for model in MOVING:
            front = {"zorder": 3, "linewidth": 2.0} if model in ("beam_th2", "strip") else {"linewidth": 1.4}
            ax.plot(s, at[f"{model}_y1_mm"], **LOOKS[model].line, **front)
        end = at["ritzinger_rate_mm_per_m"] * TRAVEL
        ax.plot([0.0, TRAVEL], [0.0, end], linewidth=1.2, **LOOKS["ritzinger"].line)
        draw_dots(ax, at, LOOKS[IN_SPACE].words)
        zero_line(ax)
        ax.set(xlim=(0.0, TRAVEL), ylim=(-0.3, 6.3), xlabel=drawing.TRAVEL_LABEL)

    def draw() -> Any:
        fig, axes = drawing.mosaic(9.6, 8.4, [["all"] * 4, [*by_tension]], height_ratios=[1.15, 1.0])
        draw_together(axes.pop("all"))
        for name, ax in axes.items():
            draw_each(ax, by_tension[name])
            ax.set_title(f"{name} N/mm²")
            ax.tick_params(labelleft=name == "7")
        axes["7"].set_ylabel("y of point 1 [mm]")
        fig.legend(*axes["40"].get_legend_handles_labels(), loc="outside lower center", ncols=4)
        style.title(fig, "Models beside one another: point 1, test rig")
        return fig

    return Plate(
        number=12, title="Comparison of models and measurement", draw=draw,
        numbers={"travel_m": s} | {f"{tension}_N_per_mm2": at for tension, at in by_tension.items()},
        stored=tuple(f"flex_{t:g}" for t in MEASURED) if in_space else (),
        caption="Run-up point 1 on the test rig after a yaw of -0.042 degrees. Above, as in the paper, all tensions "
        "together; below, every model at each. The paper's measured curves are not in its text and are not drawn. "
        "Ritzinger's formula gives a steady rate alone: a line of that slope from the origin.",
    )  # fmt: skip


def rates(in_space: bool) -> Plate:
    """Closed forms; stored runs in three dimensions as dots, their bars from the slowest to the fastest point."""
    fine = np.round(np.concatenate([np.arange(4.0, 15.0, 0.5), np.arange(15.0, 61.0, 1.5)]), 6)  # [N/mm2]
    read_at, read_over = (5.0, 6.0, *fine[6:23], 17.5, *np.arange(20.0, 61.0, 5.0)), (10.0, 15.0)  # [N/mm2]; [m]
    closed = [name for name in LOOKS if name != IN_SPACE]
    runs = {7.0: "flex_7_far", 10.0: "flex_10_far", 20.0: "flex_20", 40.0: "flex_40"} if in_space else {}
    late = {m: column([rate_mm_per_m(steady(m, t)) for t in fine]) for m in closed}
    read = {m: column([rate_mm_per_m(read_rate(moving(m, t), *read_over)) for t in read_at]) for m in MOVING}
    dots: dict[str, dict[str, float]] = {}
    for tension, name in runs.items():
        run = stored_run(name)
        mean, *ends = (float(rate_mm_per_m(r)) for r in run.rates())
        dots[f"{tension:g}_N_per_mm2"] = {
            "mm_per_m": mean,
            "slowest_point_mm_per_m": min(ends),
            "fastest_point_mm_per_m": max(ends),
            "read_over_10_to_15_m_mm_per_m": float(rate_mm_per_m(read_rate(run.curves, *read_over))),
        }

    def draw() -> Any:
        fig, [[left, right]] = style.figure(9.6, 5.4, 1, 2, sharey=True)
        for model in closed:
            left.plot(fine, late[model], **LOOKS[model].line)
        for model in MOVING:
            right.plot(read_at, read[model], **LOOKS[model].line)
        if dots:
            mean, low, high, early = np.array([[*row.values()] for row in dots.values()]).T
            look: dict[str, Any] = {"color": INK, "markersize": 5, "zorder": 5}
            bars: dict[str, Any] = {"capsize": 3, "elinewidth": 1.2, "label": LOOKS[IN_SPACE].words}
            left.errorbar([*runs], mean, [mean - low, high - mean], fmt="o", **bars, **look)
            right.plot([*runs], early, "o", **look)
        for ax in (left, right):
            zero_line(ax)
            ax.set(xlim=(0.0, 60.0), xlabel="belt tension [N/mm²]")
        left.set(ylabel="rate of point 1 [mm per m of travel]", title="Steady rate")
        right.set_title(f"As read over {read_over[0]:g} to {read_over[1]:g} m")
        fig.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=4)
        style.title(fig, "Steady rates against tension: point 1, test rig")
        return fig

    return Plate(
        number=13, title="Comparison of steady-state velocities", draw=draw, stored=tuple(runs.values()),
        numbers={"tension_N_per_mm2": column(fine), "read_tension_N_per_mm2": column(read_at)}
        | {f"{m}_mm_per_m": row for m, row in late.items()}
        | {f"{m}_read_over_10_to_15_m_mm_per_m": row for m, row in read.items()}
        | ({IN_SPACE: dots} if dots else {}),
        caption="Left: steady rates of point 1 on the test rig, yaw -0.042 degrees, by closed forms; 3D: mean of "
        f"points 1-4 from {SETTLED:g} m to the end of the record (70 m, 200 m at 7 and 10 N/mm2), bars from the "
        "slowest point to the fastest. Right: what point 1 does over 10 to 15 m of travel, which a short record takes "
        "for steady. The paper's measured rates are not in its text and are not drawn.",
    )  # fmt: skip


TILTED, TILTED_AT = 10.0, 3.0  # [N/mm2]; [m] of travel, near the greatest tilt of the upper span
SPANS = {"upper": (3, 0), "lower": (1, 2)}  # run-off and run-up point, from 0


def tilted_span(name: str) -> SpanShape:
    """A span by the strip law, from what the march holds at its ends; tilt about the machine's x."""
    off, up = SPANS[name]
    curves = moving("strip", TILTED)
    k = int(np.argmin(np.abs(np.asarray(curves.travel) - TILTED_AT)))
    ends = [(float(r[off, k]), float(r[up, k])) for r in (np.asarray(curves.y), np.asarray(curves.angle))]
    return span_shape(case_at(TILTED), analytic_model("strip"), *ends)


def tilted_ribbon(up: SpanShape, low: SpanShape) -> Shape:
    """The belt of the strip law as edges in space: both spans hanging, and the wraps."""
    a, radius, sag = TEST_RIG.centre_distance, TEST_RIG.tail_radius, float(case_at(TILTED).sag_curvature)
    turn = np.linspace(0.0, np.pi, 24)[1:-1]
    wrap = radius * np.array([np.sin(turn), np.cos(turn)])
    level = np.zeros(len(turn))
    rows = [
        np.stack([up.x, up.y, radius - 0.5 * sag * up.x * (a - up.x), up.tilt]),
        np.stack([a + wrap[0], np.linspace(up.y[-1], low.y[0], len(turn)), wrap[1], level]),
        np.stack([a - low.x, low.y, -radius - 0.5 * sag * low.x * (a - low.x), low.tilt]),
        np.stack([-wrap[0], np.linspace(low.y[-1], up.y[0], len(turn)), -wrap[1], level]),
    ]
    x, y, z, roll = np.concatenate(rows, axis=1)
    half = 0.5 * PAPER_BELT.width
    across = np.stack([np.zeros_like(x), np.full_like(x, half), half * np.sin(roll)], axis=1)
    middle = np.stack([x, y, z], axis=1)
    return Shape(travel=TILTED_AT, tail_x=a, yaw=YAW, left=middle + across, right=middle - across)


def tilted_belt(in_space: bool) -> Plate:
    """Tilt along both spans by the strip law, and that of the stored belt."""
    a, run = TEST_RIG.centre_distance, "flex_10_tilted"
    shapes = {name: tilted_span(name) for name in SPANS}
    places = {"upper": x_m(shapes["upper"].x, a), "lower": shapes["lower"].x}  # from the tail pulley
    numbers: dict = {"travel_m": TILTED_AT, "tension_N_per_mm2": TILTED}
    numbers |= {n: {"x_m": column(places[n]), "tilt_mrad": column(1e3 * shapes[n].tilt)} for n in SPANS}
    greatest = max(float(np.abs(s.tilt).max()) for s in shapes.values())
    numbers |= {"greatest_tilt_mrad": 1e3 * greatest, "edges_apart_in_height_mm": 1e3 * greatest * PAPER_BELT.width}
    if in_space:
        shape = stored_run(run).shape_at(TILTED_AT)
        x, z = shape.middle[:, 0], shape.middle[:, 2]
        angle = tilt(shape.left, shape.right)
        numbers[IN_SPACE] = {"travel_m": shape.travel}
        for name, side in (("upper", z > 0.0), ("lower", z <= 0.0)):
            free = side & (x > 0.0) & (x < shape.tail_x)
            at = {"x_m": column(x_m(x[free], shape.tail_x)), "tilt_mrad": column(1e3 * angle[free])}
            numbers[IN_SPACE][name] = at

    def draw() -> Any:
        fig, axes = drawing.mosaic(9.6, 5.8, [["belt", "belt"], ["upper", "lower"]], height_ratios=[0.9, 1.0])
        drawing.TEST_RIG_DRAWN.tilted_belt(fig, axes["belt"], tilted_ribbon(*shapes.values()))
        for name, title in (("upper", "Upper span"), ("lower", "Lower span")):
            ax = axes[name]
            ax.plot(numbers[name]["x_m"], numbers[name]["tilt_mrad"], color=BLUE, label="hanging strip")
            if in_space:
                dots = [numbers[IN_SPACE][name][k][::6] for k in ("x_m", "tilt_mrad")]
                ax.plot(*dots, "o", color=INK, markersize=2.6, label="belt in 3D (stored)")
            ax.plot([0.0, a], [0.0, 0.0], color=RED, linewidth=1.2, label="beams: no tilt")
            ax.set(xlabel="x from the tail pulley [m]", title=title, xlim=(0.0, a))
        axes["upper"].set_ylabel("tilt [mrad]")
        axes["upper"].legend(loc="best")
        style.title(fig, "The belt tilts: 10 N/mm² after a yaw")
        return fig

    return Plate(
        number=14, title="Low tensioned belt at 10 N/mm², deformation after yawing the pulley", draw=draw,
        numbers=numbers, stored=(run,) if in_space else (),
        caption=f"{TILTED_AT:g} m after a yaw of -0.042 degrees. Above: the belt by the strip law, its width 5, sag 3, "
        "sideways movement 60 and tilt 45 times enlarged. Below: tilt of its cross-sections, positive where the edge "
        f"at the paper's +y hangs lower: up to {numbers['greatest_tilt_mrad']:.1f} mrad, which is "
        f"{numbers['edges_apart_in_height_mm']:.1f} mm between the edges. In the paper this is a photograph of the "
        "rig.",
    )  # fmt: skip


FIGURES: dict[int, Callable[[bool], Plate]] = {
    2: moving_curve,
    5: rope_step_by_step,
    6: rope_curves,
    7: rope_direction,
    8: beam_model,
    9: bounds,
    10: catenaries,
    12: starts,
    13: rates,
    14: tilted_belt,
}
