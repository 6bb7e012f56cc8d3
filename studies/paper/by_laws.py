"""Figures of the paper: what the laws of the belt say, and the stored belts in 3D beside them as dots."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from belt_sim.model import analytic_model
from belt_sim.show import style
from belt_sim.show.geometry import tilt
from belt_sim.show.style import BLUE, CYCLE, FAINT_INK, INK, POINT_COLOURS, POINT_NAMES, RED
from studies.closed_forms import steady_offsets
from studies.paper import drawing
from studies.paper.case import PAPER_BELT, ROPE_EXAMPLE, TEST_RIG, YAW
from studies.paper.drawing import Plate, column, note, zero_line
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
        fig, [ax] = style.figure(8.0, 4.6)
        ax.plot(s, y1, color=POINT_COLOURS[0], label="run-up point 1")
        ax.plot(s, y4, color=POINT_COLOURS[3], label="run-off point 4")
        zero_line(ax)
        (begin, end), (low, high) = read, np.interp(read, s, y4)
        ax.plot([begin, end, end], [low, low, high], color=POINT_COLOURS[3], linewidth=1.0)
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


def rope_curves(in_space: bool) -> Plate:
    """Points 1-4 of the rope model on the short rig."""
    title, travel, record = "Moving curves of a limp rope on yawed pulleys", 10.0, 0.02  # [m]
    model, case = replace(analytic_model("rope"), step=record, keep=record), case_at(100.0, short=True)
    curves, rate = model.run(case, travel=travel), float(rate_mm_per_m(model.steady_rate(case)))
    s, y = column(curves.travel), [column(y_mm(row)) for row in curves.y]

    def draw() -> Any:
        fig, [ax] = style.figure(8.0, 4.6)
        for k, colour in enumerate(POINT_COLOURS):
            ax.plot(s, y[k], color=colour, label=f"point {POINT_NAMES[k]}")
        zero_line(ax)
        above: dict[str, Any] = {"xycoords": ("data", "axes fraction"), "va": "top", "fontsize": style.FONT - 1}
        for turns, name in ((0.5, "½"), (1.0, "1"), (1.5, "1½"), (2.0, "2")):
            ax.axvline(turns * TURN, color=FAINT_INK, linewidth=0.8, linestyle=(0, (3, 3)), zorder=1)
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


BOUNDED = (1.0, 10.0, 40.0, 100.0, 1000.0, 10000.0)  # [N/mm2] of the beam of 2nd order


def bounds(in_space: bool) -> Plate:
    """y of point 1 on the test rig by the paper's three models."""
    numbers = {"travel_m": column(moving("rope", 40.0).travel)}
    numbers |= {f"{model}_y1_mm": column(y_mm(moving(model, 40.0).y[0])) for model in ("rope", "beam_th1")}
    numbers |= {f"beam_th2_{t:g}_N_per_mm2_y1_mm": column(y_mm(moving("beam_th2", t).y[0])) for t in BOUNDED}

    def draw() -> Any:
        fig, [ax] = style.figure(8.0, 5.0)
        s = numbers["travel_m"]
        ax.fill_between(s, numbers["beam_th1_y1_mm"], numbers["rope_y1_mm"], color=FAINT_INK, alpha=0.18, linewidth=0)
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
        fig, [left, right] = style.figure(9.6, 5.4, 1, 2, sharey=True)
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
    6: rope_curves,
    9: bounds,
    12: starts,
    13: rates,
    14: tilted_belt,
}
