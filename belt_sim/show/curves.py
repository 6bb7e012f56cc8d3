"""Curves and rates: points 1-4 against travel, late rates against tension, maps of cases, the plant's response."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.campaign import Campaign, Run
from belt_sim.curves import Curves
from belt_sim.results.errors import SteadyError
from belt_sim.show import style
from belt_sim.show.style import BLUE, CYCLE, FAINT, INK, MEASURED, POINT_NAMES, POINTS
from belt_sim.units import DEGREE, MM, MM_PER_M, N_PER_MM2

DASHES = ("-", (0, (5, 2)), (0, (1.5, 1.5)), (0, (6, 2, 1.5, 2)))


@style.picture
def curves_picture(path: str | os.PathLike, curves: Mapping[str, Curves], title: str = "") -> Path:
    """Lateral position of points 1-4 [mm] against travel [m] for any number of named curves.

    One set of curves: one plot, a colour a point. Several: a plot a point, a colour a set.
    """
    fig = (_one if len(curves) == 1 else _several)(curves)
    return style.finish(fig, path, title or ", ".join(curves))


def _one(curves: Mapping[str, Curves]):
    """All points in one plot, each named at the end of its curve."""
    fig, [[ax]] = style.figure(8.0, 4.6)
    (only,) = curves.values()
    for k, colour in enumerate(POINTS):
        ax.plot(only.travel, np.asarray(only.y)[k] / MM, color=colour, label=POINT_NAMES[k])
    _axes(ax)
    ax.legend(loc="best", labelcolor="linecolor")
    ax.set_ylabel("lateral position y [mm]")
    ax.set_xlabel("belt travel [m]")
    return fig


def _several(curves: Mapping[str, Curves]):
    """A plot a point, placed as on the machine: head left, tail right, upper span above."""
    fig, axes = style.figure(10.0, 6.4, 2, 2, sharex=True, sharey=True)
    places = {3: axes[0][0], 0: axes[0][1], 2: axes[1][0], 1: axes[1][1]}
    for k, ax in places.items():
        for n, (name, run) in enumerate(curves.items()):
            look: dict[str, Any] = {"color": CYCLE[n % len(CYCLE)], "linestyle": DASHES[n % len(DASHES)]}
            ax.plot(run.travel, np.asarray(run.y)[k] / MM, label=name, **look)
        ax.set_title(f"Point {POINT_NAMES[k]}")
        _axes(ax)
    for row in axes:
        row[0].set_ylabel("y [mm]")
    for ax in axes[1]:
        ax.set_xlabel("belt travel [m]")
    handles, labels = axes[0][0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower center", ncols=min(len(curves), 5))
    return fig


def _axes(ax) -> None:
    """A zero line and tight travel."""
    ax.axhline(0.0, color=INK, linewidth=0.8, zorder=1)
    ax.margins(x=0.0)


@style.picture
def steady_picture(path: str | os.PathLike | None, rows: Sequence[SteadyError], name: str, title: str) -> Path:
    """Draw measured (dots with bars of 2u) and modelled late rates of the first measured point; name: of the model."""
    point = min(r.point for r in rows)
    mine = sorted((r for r in rows if r.point == point), key=lambda r: r.tension)
    tension = np.array([r.tension for r in mine]) / N_PER_MM2
    modelled, measured, u = np.array([(r.modelled, r.measured, r.u) for r in mine]).T / MM_PER_M
    fig, [[ax]] = style.figure(8.4, 4.8)
    ax.plot(tension, modelled, color=BLUE, marker=".", label=name)
    look: dict[str, Any] = {"fmt": "o", "color": MEASURED, "capsize": 3.0, "markersize": 5.5}
    ax.errorbar(tension, measured, 2 * u, label="measured", **look)
    ax.legend(loc="best")
    ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]))
    ax.margins(x=0.02)
    ax.set(xlabel="tension [N/mm$^2$]", ylabel=f"late rate of point {point} [mm per m of travel]")
    return style.finish(fig, path, title)


ACROSS, MOST = 4, 24


@style.picture
def understood_picture(path: str | os.PathLike | None, campaign: Campaign) -> Path:
    """A panel a run: readings [mm or mrad] over travel [m]; a dashed line where the yaw is applied."""
    recorded = [r for r in campaign.runs if len(r.travel)]
    if not recorded:
        return _rates(path, campaign)
    shown, kinds = recorded[:MOST], {s.kind for s in campaign.signals}
    label = "y [mm]" if kinds == {"lateral"} else "roll [mrad]" if kinds == {"tilt"} else "y [mm], roll [mrad]"
    across = min(ACROSS, len(shown))
    down = -(-len(shown) // across)
    fig, axes = style.panels(3.1 * across + 0.6, 2.3 * down + 1.2, down, across, len(shown), sharex=True)
    for k, (ax, run) in enumerate(zip(axes, shown, strict=True)):
        _panel(ax, run, campaign)
        if k % across == 0:
            ax.set_ylabel(label)
        if k + across >= len(shown):
            ax.set_xlabel("belt travel [m]")
            ax.tick_params(labelbottom=True)
    fig.legend(*axes[0].get_legend_handles_labels(), loc="outside lower left", ncols=6)
    left = len(recorded) - len(shown)
    return style.finish(fig, path, campaign.title[:90] + (f" ({left} more runs)" if left else ""))


def _panel(ax, run: Run, campaign: Campaign) -> None:
    for k, signal in enumerate(campaign.signals):
        y = run.signals.get(signal.name)
        colour = POINTS[int(signal.at[-1]) - 1] if signal.at.startswith("point") else CYCLE[4 + k % 3]
        name = f"{signal.name} at {signal.at.replace('_', ' ')}"
        values = np.full(len(run.travel), np.nan) if y is None else y / MM
        there = np.isfinite(values)
        marker = "." if there.sum() < 30 else None
        ax.plot(run.travel[there], values[there], color=colour, label=name, linewidth=1.3, marker=marker)
    ax.axvline(run.yaw_at, color=FAINT, linestyle="--", linewidth=1.0)
    repeat = f", repeats {run.repeat_of}" if run.repeat_of else ""
    turned = ", reversed" if run.direction < 0 else ""
    settings = f"{run.tension / N_PER_MM2:.3g} N/mm2, {run.yaw / DEGREE:+.3g} deg{turned}{repeat}"
    ax.set_title(f"{run.name[:28]}\n{settings}", fontsize=style.FONT - 2)


def _rates(path: str | os.PathLike | None, campaign: Campaign) -> Path:
    """Steady rates over tension, one mark a run."""
    fig, [[ax]] = style.figure(7.0, 4.2)
    runs = {r.name: r for r in campaign.runs}
    for point in range(4):
        stated: Sequence = [s for s in campaign.steady if np.isfinite(s.rates[point])]
        if stated:
            x = [runs[s.run].tension / N_PER_MM2 for s in stated]
            y, u = [s.rates[point] / MM for s in stated], [s.u / MM for s in stated]
            ax.errorbar(x, y, u, fmt="o", color=POINTS[point], capsize=3, label=f"point {point + 1}")
    ax.set(xlabel="tension [N/mm2]", ylabel="steady rate [mm/m]")
    ax.legend()
    return style.finish(fig, path, campaign.title[:70])


WORDS = {
    "tension_n_per_mm2": "tension [N/mm$^2$]",
    "yaw_deg": "yaw of the tail pulley [degrees]",
    "yaw_head_deg": "yaw of the head pulley [degrees]",
    "rate1_mm_per_m": "late rate of point 1 [mm per m of travel]",
    "steady_rate_mm_per_m": "steady rate [mm per m of travel]",
    "overshoot1_mm": "overshoot of point 1 [mm]",
    "retreat1_mm": "retreat of point 1 [mm]",
}


@style.picture
def map_picture(path: Path, columns: Mapping[str, np.ndarray], grid: tuple[int, ...] | None) -> Path:
    """Draw the last of ``columns`` (n,) of a map of cases against the one before it, or over the two before it.

    Over two, the first is across and the second up, with colours: cells of a ``grid`` of that shape, else (None) means
    over hexagons.
    """
    *axes, values = columns.values()
    *names, label = (WORDS.get(column, column.replace("_", " ")) for column in columns)
    title = label.split(" [")[0].capitalize()
    if len(axes) == 1:
        fig, [[ax]] = style.figure(7.2, 4.4)
        order = np.argsort(axes[0])
        ax.plot(axes[0][order], values[order], color=BLUE)
        ax.set(xlabel=names[0], ylabel=label)
        return style.finish(fig, path, title)
    fig, [[ax]] = style.figure(7.6, 5.0)
    limit = float(np.nanmax(np.abs(values))) or 1.0
    look: dict[str, Any] = {"cmap": style.diverging_map(), "vmin": -limit, "vmax": limit}
    if grid is None:
        drawn: Any = ax.hexbin(axes[0], axes[1], C=values, gridsize=60, **look)
    else:
        across, up, z = (a.reshape(grid) for a in (*axes, values))
        drawn = ax.pcolormesh(across[:, 0], up[0], z.T, shading="nearest", rasterized=True, **look)
        if min(grid) > 1 and np.ptp(z):
            lines = ax.contour(across[:, 0], up[0], z.T, levels=10, colors=INK, linewidths=0.6)
            ax.clabel(lines, fontsize=style.FONT - 2)
    ax.grid(visible=False)
    fig.colorbar(drawn, ax=ax, label=label)
    ax.set(xlabel=names[0], ylabel=names[1])
    return style.finish(fig, path, f"{title}, {len(values):,} cases")


_LINES = ("-", "--", "-", "--")  # points 1 and 2 lie close together, and so do 3 and 4


@style.picture
def bode_picture(path: str | os.PathLike, space: Any, highest: float) -> Path:
    """Gain [mm per degree of tail yaw] and phase [degrees] of points 1-4 over rad/s at the plant's speed.

    highest: wavenumber [rad/m] up to which it is drawn. Lines: delays exact; dots: the state space.
    """
    plant = space.plant
    k = np.geomspace(highest / 1e3, highest, 240)
    at = slice(None, None, 16)
    exact, rational = plant.response(k)[:, :, 0], space.response(k[at])[:, :, 0]
    w = k * plant.speed
    fig, [[gain], [phase]] = style.figure(8.0, 6.4, 2, 1, sharex=True)
    for n, colour in enumerate(POINTS):
        gain.loglog(w, np.abs(exact[:, n]) * DEGREE / MM, _LINES[n], color=colour, label=POINT_NAMES[n])
        gain.loglog(w[at], np.abs(rational[:, n]) * DEGREE / MM, "o", color=colour, markersize=3)
        turned = np.degrees(np.unwrap(np.angle(exact[:, n])))
        turned -= 360.0 * np.round((turned[0] + 90.0) / 360.0)  # an integrator begins at -90 or at 90 degrees
        phase.semilogx(w, turned, _LINES[n], color=colour)
        shown = turned[at] + np.degrees(np.angle(rational[:, n] / exact[at, n]))
        phase.semilogx(w[at], shown, "o", color=colour, markersize=3)
    gain.plot([], [], "o", color="black", markersize=3, label=f"state space ({space.delay}, order {space.order})")
    gain.set_ylabel("belt position per yaw [mm/degree]")
    gain.legend(loc="best", labelcolor="linecolor")
    low, high = phase.get_ylim()
    step = 90.0 * max(1, round((high - low) / 90.0 / 8.0))
    phase.set_yticks(np.arange(step * np.floor(low / step), high + step, step))
    phase.set_ylabel("phase [degrees]")
    phase.set_xlabel(f"frequency of the yaw [rad/s] at {plant.speed:g} m/s")
    effort = f"{plant.tension / N_PER_MM2:g} N/mm2"
    return style.finish(fig, path, f"Belt position at points 1-4 per yaw of the tail pulley ({plant.model}, {effort})")
