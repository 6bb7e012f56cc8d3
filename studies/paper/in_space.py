"""Figures 15 to 20 of the paper: stored particle chains and belts in three dimensions."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from belt_sim.case import Case
from belt_sim.curves import late_rates
from belt_sim.model import analytic_model
from belt_sim.show import style
from belt_sim.show.style import AMBER, BLUE, FAINT, INK, PINK, POINTS, RED
from belt_sim.space.mesh import Lattice, calibrate
from studies.closed_forms import steady_offsets
from studies.paper import drawing
from studies.paper.case import ROPE_EXAMPLE, YAW
from studies.paper.drawing import ROPE_DRAWN, bare, zero_line
from studies.paper.models import LOOKS, case_at, moving, rate_mm_per_m, y_mm
from studies.paper.plate import Plate, column
from studies.paper.stored_runs import Shape, stored_run

SHOWN = {1: "run-up point 1", 4: "run-off point 4"}
DOTS: dict[str, Any] = {"markersize": 3.2, "markeredgewidth": 0.0}


def _chain_numbers(shape: Shape) -> dict[str, list[float]]:
    x, y, z = shape.middle.T
    return {"x_m": column(shape.tail_x - x), "y_mm": column(y_mm(y)), "z_m": column(z)}


def _draw_chains(ax: Any, chains: list[tuple[Shape, str, str | None]]) -> None:
    """Chains with their colours and names, and a dashed line through both pulleys' middles."""
    ROPE_DRAWN.pulleys(ax, YAW)
    line = ROPE_DRAWN.flat(np.array([[-0.2, 0.0, 0.0], [ROPE_EXAMPLE.centre_distance + 0.2, 0.0, 0.0]]))
    ax.plot(*line.T, color=FAINT, linewidth=0.8, linestyle=(0, (6, 3)))
    for shape, colour, label in chains:
        place = ROPE_DRAWN.flat(shape.middle * [1.0, ROPE_DRAWN.lateral, 1.0])
        ax.plot(*place.T, "o", color=colour, markersize=2.6, markeredgewidth=0.0, zorder=3, label=label)
    bare(ax)


def chain() -> Plate:
    """Particles of the stored rope in 3D at three travels."""
    title = "Lateral movement of a particle chain"
    shapes = [stored_run("rope_100").shape_at(travel) for travel in (0.0, 5.0, 21.4)]
    particles = len(shapes[0].left)

    def draw() -> Any:
        fig, axes = style.figure(9.6, 2.1, 1, 3, sharex=True, sharey=True)
        for ax, shape in zip(axes[0], shapes, strict=True):
            _draw_chains(ax, [(shape, BLUE, None)])
            ax.set_title(f"{shape.travel:.1f} m of travel")
        style.title(fig, f"{title}: 100 N/mm²")
        return fig

    return Plate(
        number=15, title=title, draw=draw, stored=("rope_100",),
        numbers={"travel_m": column([s.travel for s in shapes]), "particles": particles}
        | {f"moment_{k + 1}": _chain_numbers(shape) for k, shape in enumerate(shapes)},
        caption=f"A chain of {particles} particles at 100 N/mm2 in three dimensions, centre distance 2 m, tail pulley "
        f"yawed by -0.042 degrees; sideways movements and yaw {ROPE_DRAWN.lateral:g} times enlarged.",
    )  # fmt: skip


def chain_curves() -> Plate:
    """Points 1 and 4 of the stored rope in 3D, and of the rope model."""
    title, tension = "Moving diagram for the upper rope span", 100.0  # [N/mm2]
    curves, case, model = stored_run("rope_100").curves, case_at(tension, short=True), analytic_model("rope")
    law = model.run(case, travel=float(curves.travel[-1]))
    numbers: dict = {"travel_m": column(curves.travel), "law_travel_m": column(law.travel)}
    for k in SHOWN:
        numbers |= {f"y{k}_mm": column(y_mm(curves.y[k - 1])), f"law_y{k}_mm": column(y_mm(law.y[k - 1]))}
    late, steady = (float(rate_mm_per_m(r)) for r in (late_rates(curves)[0], model.steady_rate(case)))
    offsets = np.asarray(curves.y)[0, -1] - np.asarray(curves.y)[3, -1], steady_offsets(case, model)[0]
    apart, steady_apart = (float(y_mm(offset)) for offset in offsets)
    numbers |= {"late_rate_mm_per_m": late, "law_steady_rate_mm_per_m": steady}
    numbers |= {"late_offset_mm": apart, "law_steady_offset_mm": steady_apart}

    def draw() -> Any:
        fig, [[ax]] = style.figure(8.0, 4.6)
        for k, name in SHOWN.items():
            ax.plot(numbers["law_travel_m"], numbers[f"law_y{k}_mm"], color=POINTS[k - 1], linewidth=1.2)
            dots = numbers["travel_m"][::4], numbers[f"y{k}_mm"][::4]
            ax.plot(*dots, "o", label=name, color=POINTS[k - 1], **DOTS)
        zero_line(ax)
        ax.plot([], [], color=INK, linewidth=1.2, label="rope model")
        ax.set(xlabel=drawing.TRAVEL_LABEL, ylabel=drawing.Y_LABEL, xlim=(0.0, numbers["travel_m"][-1]))
        ax.legend(loc="upper left")
        style.title(fig, f"{title}: particle chain, {tension:g} N/mm²")
        return fig

    return Plate(
        number=16, title=title, draw=draw, numbers=numbers, stored=("rope_100",),
        caption="Particle chain in three dimensions (dots) and rope model (lines): steady-state velocity "
        f"{late:.4f} and {steady:.4f} mm/m, steady-state offset {apart:.3f} and {steady_apart:.3f} mm.",
    )  # fmt: skip


def two_chains() -> Plate:
    """Both stored ropes at the same travel."""
    looks = {"rope_100": ("100 N/mm²", BLUE), "rope_1": ("1 N/mm²", RED)}
    travel = 20 * 2.0 * math.pi * ROPE_EXAMPLE.tail_radius  # [m]
    numbers: dict = {"travel_m": travel}
    for name in looks:
        run = stored_run(name)
        points = column(y_mm([np.interp(travel, run.curves.travel, row) for row in np.asarray(run.curves.y)]))
        numbers[name] = {"points_1_to_4_y_mm": points, "sag_mm": column(run.made["sag_mm"])}
        numbers[name] |= _chain_numbers(run.shapes[-1])
    both = np.array([numbers[name]["points_1_to_4_y_mm"] for name in looks])
    difference = numbers["greatest_difference_mm"] = float(np.abs(both[0] - both[1]).max())

    def draw() -> Any:
        fig, [[ax]] = style.figure(8.6, 3.6)
        chains: list[tuple[Shape, str, str | None]] = [
            (stored_run(name).shapes[-1], colour, words) for name, (words, colour) in looks.items()
        ]
        _draw_chains(ax, chains)
        ROPE_DRAWN.name_pulleys(ax)
        fig.legend(loc="outside lower center", ncols=2, markerscale=2.0)
        style.title(fig, "Particle chains after 20 revolutions of the pulleys")
        return fig

    return Plate(
        number=17, title="High and low tensioned particle chains on two pulleys", draw=draw, numbers=numbers,
        stored=tuple(looks),
        caption=f"Chains tensioned by their length, after 20 revolutions of the pulleys ({travel:.1f} m of travel), "
        f"sideways movements {ROPE_DRAWN.lateral:g} times enlarged. Points 1-4 of the two differ by at most "
        f"{difference:.3f} mm, {100.0 * difference / float(np.abs(both).max()):.1f} % of the way: about the same "
        "place, as in the paper.",
    )  # fmt: skip


def particle_belt(number: int, title: str, run_name: str, remark: str = "") -> Plate:
    """The stored run of a grid of bonded particles; beside it what the strip law says of points 1 and 4."""
    run = stored_run(run_name)
    shape, law = run.shapes[-1], moving("strip", run.tension)
    within = np.asarray(law.travel) <= run.curves.travel[-1] + 1e-9
    s, s_law = column(run.curves.travel), column(np.asarray(law.travel)[within])
    numbers: dict = {"tension_N_per_mm2": run.tension, "travel_m": s, "strip_travel_m": s_law}
    for k in SHOWN:
        numbers[f"y{k}_mm"] = column(y_mm(run.curves.y[k - 1]))
        numbers[f"strip_y{k}_mm"] = column(y_mm(np.asarray(law.y)[k - 1, within]))
    beside = np.interp(s, s_law, numbers["strip_y1_mm"])
    off = float(np.abs(np.array(numbers["y1_mm"]) - beside).max() / np.abs(beside).max())
    numbers["point_1_off_the_strip_law"] = off
    made, spacing = run.made, 1e3 * run.made["options"]["dx"]

    def draw() -> Any:
        fig, axes = drawing.mosaic(9.6, 6.0, [["belt"], ["curves"]], height_ratios=[1.0, 1.1])
        belt, curves = axes["belt"], axes["curves"]
        drawing.TEST_RIG_DRAWN.tilted_belt(fig, belt, shape)
        for edge in drawing.TEST_RIG_DRAWN.edges(shape):
            belt.plot(*edge[::2].T, "o", color=INK, markersize=1.3, markeredgewidth=0.0, zorder=4)
        for k, name in SHOWN.items():
            curves.plot(s[::2], numbers[f"y{k}_mm"][::2], "o", color=POINTS[k - 1], label=name, **DOTS)
            curves.plot(s_law, numbers[f"strip_y{k}_mm"], color=POINTS[k - 1], linewidth=1.2)
        curves.plot([], [], color=INK, linewidth=1.2, label=LOOKS["strip"].words)
        zero_line(curves)
        curves.set(xlabel=drawing.TRAVEL_LABEL, ylabel=drawing.Y_LABEL, xlim=(0.0, s[-1]))
        curves.legend(loc="upper left")
        style.title(fig, f"{title}: {run.tension:g} N/mm²")
        return fig

    return Plate(
        number=number, title=title, draw=draw, numbers=numbers, stored=(run_name,),
        caption=f"Two lines of particles {spacing:g} mm apart with longitudinal, transverse and diagonal bonds, on the "
        f"whole test rig ({2 * len(shape.left)} particles) at {run.tension:g} N/mm2, {made['travel_m']:g} m after a "
        "yaw of -0.042 degrees; width 5, sag 3, sideways movement 60, tilt 45 times enlarged. Point 1 stays within "
        f"{100 * off:.1f} % of the strip law's greatest y. The run cost {made['cpu_s']:.0f} CPU s, 60 m would cost "
        f"about {made['cpu_s'] / made['travel_m']:.0f} min.{remark}",
    )  # fmt: skip


def tight_particle_belt() -> Plate:
    """Fig. 18."""
    return particle_belt(18, "High tensioned particle belt", "grid_40")


def slack_particle_belt() -> Plate:
    """Fig. 20."""
    ripples = " The ripples are waves along the spans at that instant; particles nearer to each other were not run."
    return particle_belt(20, "Low tensioned particle belt", "grid_10", ripples)


ACROSS = 2  # lines of particles
LONG, SQUARE, BRACED = (("longitudinal", "transverse", "diagonal")[:n] for n in (1, 2, 3))
#: bonds -> (stored run, name, colour)
ARRANGEMENTS = {
    LONG: ("grid_40_lines", "longitudinal", PINK),
    SQUARE: ("grid_40_square", "longitudinal and transverse", AMBER),
    BRACED: ("grid_40", "longitudinal, transverse and diagonal", BLUE),
}


@dataclass(frozen=True, kw_only=True)
class PushedSpan:
    """rest, moved (n, 2, 2): x and y [m] of the particles of both lines; force [N] in its middle."""

    rest: np.ndarray
    moved: np.ndarray
    force: float

    @property
    def give(self) -> float:
        """Deflection of its middle per newton [m/N]."""
        middle = len(self.rest) // 2
        return float((self.moved - self.rest)[middle, :, 1].mean()) / self.force


def pushed_span(case: Case, chord: float, bonds: tuple[str, ...], force: float = 1.0) -> PushedSpan:
    """Equilibrium in the plane, linear about the belt at its tension, whose pull the lines carry.

    A bond with stiffness k and pull P answers a stretch with k and a turn with P / length.
    """
    stations = 2 * round(0.5 * float(case.rig.span_length) / chord) + 1
    lattice = calibrate(case.belt, chord, ACROSS, bonds)
    y = 0.5 * lattice.width * np.array([-1.0, 1.0])
    rest = np.stack(np.broadcast_arrays(np.arange(stations)[:, None] * chord, y), axis=2)
    places, whole = rest.reshape(-1, 2), np.zeros((rest.size, rest.size))
    for a, b, stretch, pull in _bonds(stations, lattice, 0.5 * float(case.tension_force)):
        way = places[b] - places[a]
        length = float(np.hypot(*way))
        along = np.outer(way, way) / length**2
        block = stretch / length * along + pull / length * (np.eye(2) - along)
        for p, q, sign in ((a, a, 1.0), (b, b, 1.0), (a, b, -1.0), (b, a, -1.0)):
            whole[2 * p : 2 * p + 2, 2 * q : 2 * q + 2] += sign * block
    load = np.zeros((stations, ACROSS, 2))
    load[stations // 2, :, 1] = force / ACROSS
    free = np.ones(load.shape, bool)
    free[[0, -1]] = False
    moved, flat = np.zeros(load.size), free.ravel()
    moved[flat] = np.linalg.solve(whole[np.ix_(flat, flat)], load.ravel()[flat])
    return PushedSpan(rest=rest, moved=rest + moved.reshape(rest.shape), force=force)


def _bonds(stations: int, lattice: Lattice, pull: float) -> list[tuple[int, int, float, float]]:
    """(node, node, EA [N], pull [N]) of every bond; node = 2 station + line."""
    found = [(2 * i + j, 2 * i + 2 + j, lattice.lines / ACROSS, pull) for i in range(stations - 1) for j in (0, 1)]
    if lattice.transverse:
        found += [(2 * i, 2 * i + 1, lattice.transverse, 0.0) for i in range(stations)]
    if lattice.diagonal:
        pairs = [(2 * i + j, 2 * i + 3 - j) for i in range(stations - 1) for j in (0, 1)]
        found += [(a, b, lattice.diagonal, 0.0) for a, b in pairs]
    return found


def bond_arrangements() -> Plate:
    """Give of a piece and of a whole span, by statics; stored runs of the three belts on the whole test rig."""
    title, tension, chord, length = "Different types of bond arrangement", 40.0, 0.04, 0.48  # [N/mm2]; [m]
    case = case_at(tension)
    piece = replace(case, rig=replace(case.rig, centre_distance=length))
    pieces = {bonds: pushed_span(piece, chord, bonds) for bonds in ARRANGEMENTS}
    numbers: dict = {"tension_N_per_mm2": tension, "distance_of_particles_m": chord}
    for bonds, (run, name, _) in ARRANGEMENTS.items():
        curves = stored_run(run).curves
        numbers[name] = {
            "piece_give_um_per_N": 1e6 * pieces[bonds].give,
            "span_give_um_per_N": 1e6 * pushed_span(case, chord, bonds).give,
            "travel_m": column(curves.travel),
            "y1_mm": column(y_mm(curves.y[0])),
        }
    enlarged = 0.08 / max(p.give for p in pieces.values())  # [m], the deflection of the softest in the drawing

    def draw_piece(ax: Any, bonds: tuple[str, ...], colour: str) -> None:
        rest = pieces[bonds].rest
        place = rest + (pieces[bonds].moved - rest) * [0.0, enlarged]
        ties = [(0, 0, 1, 0), (0, 1, 1, 1)]
        ties += [(0, 0, 0, 1)] if "transverse" in bonds else []
        ties += [(0, 0, 1, 1), (0, 1, 1, 0)] if "diagonal" in bonds else []
        for i in range(len(place)):
            for a, j, b, k in ties:
                if i + b < len(place):
                    ax.plot(*np.stack([place[i + a, j], place[i + b, k]]).T, color=colour, linewidth=1.0, zorder=2)
        ax.plot(*rest.reshape(-1, 2).T, "o", color=FAINT, markersize=3, zorder=1)
        ax.plot(*place.reshape(-1, 2).T, "o", color=INK, markersize=4, zorder=3)
        bare(ax)
        half = 0.5 * float(np.ptp(rest[..., 1])) + 0.02
        ax.set(xlim=(-0.02, length + 0.02), ylim=(-half, half + 0.08))

    def draw() -> Any:
        names = [name for _, name, _ in ARRANGEMENTS.values()]
        fig, axes = drawing.mosaic(9.6, 6.6, [names, ["runs"] * 3], height_ratios=[0.85, 1.7])
        runs = axes["runs"]
        for bonds, (_, name, colour) in ARRANGEMENTS.items():
            draw_piece(axes[name], bonds, colour)
            axes[name].set_title(f"{name}\n{numbers[name]['piece_give_um_per_N']:.2g} µm/N", fontsize=style.FONT)
            look: dict[str, Any] = {"markersize": 3.4, "markeredgewidth": 0.0}
            if bonds == LONG:  # it runs as the next one does, which would hide it
                look = {"markersize": 7.0, "markerfacecolor": "none"}
            dots = numbers[name]["travel_m"][::2], numbers[name]["y1_mm"][::2]
            runs.plot(*dots, "o", color=colour, label=f"bonds {name}", zorder=3, **look)
        end = max(numbers[name]["travel_m"][-1] for name in names)
        for model, colour in (("rope", FAINT), ("strip", INK)):
            law = moving(model, tension)
            near = np.asarray(law.travel) <= end + 1e-9
            y = y_mm(np.asarray(law.y)[0, near])
            runs.plot(np.asarray(law.travel)[near], y, color=colour, linewidth=1.4, label=LOOKS[model].words)
        zero_line(runs)
        runs.set(xlabel=drawing.TRAVEL_LABEL, ylabel="lateral position y of point 1 [mm]")
        runs.legend(loc="upper left")
        style.title(fig, f"{title}: {tension:g} N/mm²")
        return fig

    return Plate(
        number=19, title=title, draw=draw, numbers=numbers, stored=tuple(run for run, _, _ in ARRANGEMENTS.values()),
        caption=f"Two lines of particles {1e3 * chord:g} mm apart at {tension:g} N/mm2. Above: a piece of "
        f"{length:g} m, its ends held, pushed sideways by 1 N in its middle (statics of the bonds, all at the same "
        f"enlargement): without diagonals it gives {pieces[SQUARE].give / pieces[BRACED].give:.0f} times as much. "
        "Below: such belts on the whole test rig after a yaw of -0.042 degrees, point 1 in 3D: without diagonals they "
        "run like a rope, with them like a strip.",
    )  # fmt: skip


FIGURES: dict[int, Callable[[], Plate]] = {
    15: chain,
    16: chain_curves,
    17: two_chains,
    18: tight_particle_belt,
    19: bond_arrangements,
    20: slack_particle_belt,
}
