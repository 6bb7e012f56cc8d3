"""Curves and rates: points 1-4 against travel, late rates against tension, maps and sweeps of cases, the plant's
response; and one recording of a sweep's runs."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from belt_sim.campaign import Campaign
from belt_sim.case import Case
from belt_sim.curves import Curves, read_curves
from belt_sim.io import read_json
from belt_sim.results import words
from belt_sim.settings import case_from
from belt_sim.show import style
from belt_sim.show.style import BLUE, CYCLE, FAINT_INK, INK, MEASURED, POINT_COLOURS, POINT_NAMES
from belt_sim.units import DEGREE, MM, MM_PER_M, N_PER_MM2

if TYPE_CHECKING:
    from belt_sim.results.errors import SteadyError

DASHES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1.5, 1.5)), (0, (6, 2, 1.5, 2)))


@style.picture
def curves_picture(path: str | os.PathLike | None, curves: Mapping[str, Curves], title: str) -> Path:
    """Lateral position of points 1-4 [mm] against travel [m] of named curves: of one set a plot with a colour a point,
    of several a plot a point with a colour a set."""
    if len(curves) == 1:
        fig, [ax] = style.figure(8.0, 4.6, layout=None)
        (only,) = curves.values()
        for k, colour in enumerate(POINT_COLOURS):
            ax.plot(only.travel, np.asarray(only.y)[k] / MM, color=colour, label=POINT_NAMES[k])
        ax.axhline(0.0, color=INK, linewidth=0.8, zorder=1)
        ax.margins(x=0.0)
        ax.legend(loc="best", labelcolor="linecolor")
        ax.set(xlabel="belt travel [m]", ylabel="lateral position y [mm]")
        ax.ticklabel_format(axis="y", scilimits=(-3, 5), useMathText=True)  # longer numbers push the label out
        style.place(fig, title, 1, 1, left=0.85, right=0.2, top=0.5, bottom=0.6)
    else:
        looks = [{"color": CYCLE[n % len(CYCLE)], "linestyle": DASHES[n % len(DASHES)]} for n in range(len(curves))]
        runs = zip(curves.values(), looks, curves, strict=True)
        fig = _four_points([(run, {**look, "label": name}) for run, look, name in runs])
        fig.legend(*fig.axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=min(len(curves), 5))
        style.title(fig, title)
    return style.save(fig, path)


def _four_points(lines: Sequence[tuple[Curves, Mapping[str, Any]]]) -> Any:
    """A plot a point of curves with their looks, placed as on the machine: head left, tail right, upper span above."""
    fig, axes = style.figure(10.0, 6.6, 2, 2, sharex=True, sharey=True)
    for k, ax in zip((3, 0, 2, 1), axes, strict=True):
        ax.set_title(f"Point {POINT_NAMES[k]}")
        ax.axhline(0.0, color=INK, linewidth=0.8, zorder=1)
        ax.margins(x=0.0)
        for curves, look in lines:
            ax.plot(curves.travel, np.asarray(curves.y)[k] / MM, **look)
        if k > 1:
            ax.set_ylabel("lateral position y [mm]")
        if k in (1, 2):
            ax.set_xlabel("belt travel [m]")
    return fig


@style.picture
def steady_picture(path: str | os.PathLike | None, rows: "Sequence[SteadyError]", name: str, title: str) -> Path:
    """Draw measured (dots with bars of 2u) and modelled late rates of the first measured point; name: of the model."""
    point = min(r.point for r in rows)
    mine = sorted((r for r in rows if r.point == point), key=lambda r: r.tension)
    tension = np.array([r.tension for r in mine]) / N_PER_MM2
    modelled, measured, u = np.array([(r.modelled, r.measured, r.u) for r in mine]).T / MM_PER_M
    fig, [ax] = style.figure(8.4, 4.8)
    ax.plot(tension, modelled, color=BLUE, marker=".", label=name)
    look: dict[str, Any] = {"fmt": "o", "color": MEASURED, "capsize": 3.0, "markersize": 5.5}
    ax.errorbar(tension, measured, 2 * u, label="measured", **look)
    ax.legend(loc="best")
    ax.set_ylim(bottom=min(0.0, ax.get_ylim()[0]))
    ax.margins(x=0.02)
    ax.set(xlabel="tension [N/mm²]", ylabel=f"late rate of point {point} [mm per m of travel]")
    return style.save(fig, path, title)


ACROSS, PANELS = 4, 24


@style.picture
def understood_picture(path: str | os.PathLike | None, campaign: Campaign) -> Path:
    """A panel a run: readings [mm or mrad] over travel [m]; a dashed line where the yaw is applied. Of a campaign of
    steady rates these over tension, one mark a run."""
    recorded = [r for r in campaign.runs if len(r.travel)]
    if not recorded:
        fig, [ax] = style.figure(7.0, 4.2)
        tensions = {r.name: r.tension / N_PER_MM2 for r in campaign.runs}
        for point in range(4):
            if stated := [s for s in campaign.steady if np.isfinite(s.rates[point])]:
                y, u = [s.rates[point] / MM for s in stated], [s.u / MM for s in stated]
                look: dict[str, Any] = {"fmt": "o", "capsize": 3, "label": f"point {point + 1}"}
                ax.errorbar([tensions[s.run] for s in stated], y, u, color=POINT_COLOURS[point], **look)
        ax.set(xlabel="tension [N/mm²]", ylabel="steady rate [mm/m]")
        ax.legend()
        return style.save(fig, path, campaign.title[:70])
    shown, kinds = recorded[:PANELS], {s.kind for s in campaign.signals}
    label = "y [mm]" if kinds == {"lateral"} else "roll [mrad]" if kinds == {"tilt"} else "y [mm], roll [mrad]"
    across = min(ACROSS, len(shown))
    down = -(-len(shown) // across)
    fig, axes = style.figure(3.1 * across + 0.6, 2.3 * down + 1.2, down, across, count=len(shown), sharex=True)
    for n, (ax, run) in enumerate(zip(axes, shown, strict=True)):
        for k, signal in enumerate(campaign.signals):
            readings = run.signals.get(signal.name)
            colour = POINT_COLOURS[int(signal.at[-1]) - 1] if signal.at.startswith("point") else CYCLE[4 + k % 3]
            values = np.full(len(run.travel), np.nan) if readings is None else readings / MM
            there = np.isfinite(values)
            look = {"linewidth": 1.3, "marker": "." if there.sum() < 30 else None, "color": colour}
            ax.plot(run.travel[there], values[there], label=f"{signal.name} at {signal.at.replace('_', ' ')}", **look)
        ax.axvline(run.yaw_at, color=FAINT_INK, linestyle="--", linewidth=1.0)
        repeat = f", repeats {run.repeat_of}" if run.repeat_of else ""
        turned = ", reversed" if run.direction < 0 else ""
        settings = f"{run.tension / N_PER_MM2:.3g} N/mm², {run.yaw / DEGREE:+.3g} deg{turned}{repeat}"
        ax.set_title(f"{run.name[:28]}\n{settings}", fontsize=style.FONT - 2)
        if n % across == 0:
            ax.set_ylabel(label)
        if n + across >= len(shown):
            ax.set_xlabel("belt travel [m]")
            ax.tick_params(labelbottom=True)
    fig.legend(*axes[0].get_legend_handles_labels(), loc="outside lower left", ncols=6)
    left = len(recorded) - len(shown)
    return style.save(fig, path, campaign.title[:90] + (f" ({left} more runs)" if left else ""))


MAP_DOTS = 60  # late rates that a line of a map marks, at most
#: column of a table or setting -> label of its axis
AXIS_LABELS = {
    "tension": "tension [N/mm²]",
    "yaw": "yaw of the tail pulley [degrees]",
    "yaw_head": "yaw of the head pulley [degrees]",
    "speed": "belt speed [m/s]",
    "rig.centre_distance": "distance of the pulleys' axes [m]",
    "belt.width": "belt width [m]",
    "belt.thickness": "belt thickness [m]",
    "rate1_mm_per_m": "late rate of point 1 [mm per m of travel]",
    "steady_rate_mm_per_m": "steady rate [mm per m of travel]",
    "overshoot1_mm": "overshoot of point 1 [mm]",
    "retreat1_mm": "retreat of point 1 [mm]",
}


@style.picture
def map_picture(
    path: Path,
    columns: Mapping[str, np.ndarray],
    grid: tuple[int, ...],
    settled: np.ndarray | None = None,
    steady: np.ndarray | None = None,
) -> Path:
    """Draw the last of ``columns`` (n,) of a map of cases against the one before it, or over the two before it, the
    first across and the second up, as cells of a ``grid`` of that shape.

    settled (n,): of late rates, hollow against one number where they have not; steady (n,): beside them.
    """
    *axes, values = columns.values()
    known = [column.removesuffix("_n_per_mm2").removesuffix("_deg") for column in columns]
    *names, label = (AXIS_LABELS.get(k, column.replace("_", " ")) for k, column in zip(known, columns, strict=True))
    title = label.split(" [")[0].capitalize()
    if len(axes) == 1:
        fig, [ax] = style.figure(7.2, 4.4)
        order = np.argsort(axes[0])
        x, z = axes[0][order], values[order]
        ax.plot(x, z if steady is None else steady[order], color=BLUE, label=None if steady is None else "steady rate")
        if settled is not None:
            kept = np.unique(np.linspace(0, len(x) - 1, min(len(x), MAP_DOTS)).round().astype(int))
            there = settled[order][kept]
            dot: dict[str, Any] = {"marker": "o", "markersize": 5, "linestyle": "none", "color": BLUE}
            for some, face, name in ((there, BLUE, "late rate, settled"), (~there, "white", "late rate, not settled")):
                if some.any():
                    ax.plot(x[kept][some], z[kept][some], **dot, markerfacecolor=face, label=name)
            ax.legend(loc="best")
        ax.set(xlabel=names[0], ylabel=label)
        return style.save(fig, path, title)
    fig, [ax] = style.figure(7.6, 5.0)
    limit = float(np.nanmax(np.abs(values))) or 1.0
    look: dict[str, Any] = {"cmap": style.diverging_map(), "vmin": -limit, "vmax": limit}
    across, up, z = (a.reshape(grid) for a in (*axes, values))
    drawn = ax.pcolormesh(across[:, 0], up[0], z.T, shading="nearest", rasterized=True, **look)
    for limit_to, own in ((ax.set_xlim, across), (ax.set_ylim, up)):  # nothing beyond what was computed
        if np.ptp(own):
            limit_to(own.min(), own.max())
    if min(grid) > 1 and np.ptp(z):
        lines = ax.contour(across[:, 0], up[0], z.T, levels=10, colors=INK, linewidths=0.6)
        ax.clabel(lines, fontsize=style.FONT - 2)
    ax.grid(visible=False)
    fig.colorbar(drawn, ax=ax, label=label)
    ax.set(xlabel=names[0], ylabel=names[1])
    late = "" if settled is None or settled.all() else f", {np.count_nonzero(~settled):,} of them not settled"
    return style.save(fig, path, f"{title}, {len(values):,} cases{late}")


_LINES = ("-", "--", "-", "--")  # points 1 and 2 lie close together, and so do 3 and 4


@style.picture
def bode_picture(path: str | os.PathLike, space: Any, highest: float) -> Path:
    """Gain [mm per degree of tail yaw] and phase [degrees] of points 1-4 over rad/s at the plant's speed, up to
    ``highest`` [rad/m]: lines with exact delays, dots of the state space."""
    plant = space.plant
    k = np.geomspace(highest / 1e3, highest, 240)
    at = slice(None, None, 16)
    exact, rational = plant.response(k)[:, :, 0], space.response(k[at])[:, :, 0]
    w = k * plant.speed
    fig, [gain, phase] = style.figure(8.0, 6.4, 2, 1, sharex=True)
    for n, colour in enumerate(POINT_COLOURS):
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
    return style.save(fig, path, f"Belt position at points 1-4 per yaw of the tail pulley ({plant.model}, {effort})")


# ---- a finished sweep: pictures keyed by what was swept, and one recording of all its runs

SHOWN_VALUES = 8  # values of one key that a picture tells apart, spread evenly over those that there are
LEAST_VALUES = 3  # values of a number, from which on rates are drawn against it
#: keys of a run that say what it is, in the order in which they get colours; others follow
RUN_KEYS = ("tension", "yaw", "yaw_head", "effects", "travel", "speed", "direction")
KEY_NAMES = {"yaw_head": "yaw of the head pulley"}  # of keys that do not say it themselves
PLAIN_LINE: dict[str, Any] = {"color": INK, "linestyle": "-", "linewidth": 1.8}
#: what tells the values of the first, second and third key apart
KEY_LOOKS: tuple[tuple[str, Sequence[Any]], ...]
KEY_LOOKS = (("color", CYCLE), ("linestyle", DASHES), ("linewidth", (1.8, 0.9, 3.0, 0.5)))


@dataclass(frozen=True, kw_only=True)
class FinishedRun:
    """A run of a sweep: what was set in it, by key; steady rate [m/m], where it is known; late rate of point 1
    [m/m]."""

    keys: Mapping[str, Any]
    case: Case
    model: str
    curves: Curves | None
    late: float
    steady: float | None
    settled: bool


def read_run(folder: Path) -> FinishedRun:
    """Read a finished run from its folder; raises BeltError, OSError, KeyError where its files are damaged."""
    from omegaconf import OmegaConf  # Hydra notes references as they are written

    config: Any = OmegaConf.to_container(OmegaConf.load(folder / ".hydra" / "config.yaml"), resolve=True)
    typed = yaml.safe_load((folder / ".hydra" / "overrides.yaml").read_text(encoding="utf-8")) or []
    summary = read_json(folder / "summary.json")
    own = dict(o.lstrip("+").split("=", 1) for o in typed if "=" in o)
    stated = {k: yaml.safe_load(v) for k, v in own.items()} | {k: config.get(k) for k in RUN_KEYS}
    keys = {k: v if isinstance(v, int | float | str) else "" if v is None else str(v) for k, v in stated.items()}
    keys |= {"model": summary["model"], "effects": own.get("effects", "") if summary["effects"] else ""}
    there, steady = folder / "curves.csv", summary.get("steady_rate_mm_per_m")
    return FinishedRun(
        keys=keys,
        case=case_from(config),
        model=summary["model"],
        curves=read_curves(there) if there.is_file() else None,
        late=1e-3 * summary["rate_mm_per_m"]["1"],
        steady=None if steady is None else 1e-3 * steady,
        settled=summary["settled"],
    )


def swept_keys(runs: Sequence[FinishedRun]) -> list[str]:
    """The keys whose values differ, the model last."""
    others = dict.fromkeys(k for run in runs for k in run.keys if k not in RUN_KEYS and k != "model")
    names = [*RUN_KEYS, *others, "model"]
    return [k for k in names if len({str(run.keys.get(k)) for run in runs}) > 1]


def in_words(key: str, value: Any) -> str:
    """A value of a key as a legend says it."""
    if key == "tension":
        return f"{value:g} N/mm²"
    if key in ("yaw", "yaw_head") and isinstance(value, int | float):
        return f"{'yaw' if key == 'yaw' else 'head yaw'} {value:+g}°".replace("-", "−")
    return str(value) if key == "model" else f"{key} {value}" if value != "" else f"no {key}"


def looks_of(runs: Sequence[FinishedRun], keys: Sequence[str]) -> tuple[list[dict[str, Any] | None], list[Any]]:
    """The look of each run, None where one of its values is not among those that are shown; and a line a value for a
    legend: colour of the first key (the tension, where it is swept), dash of the model, else of the second, width of a
    third."""
    from matplotlib.lines import Line2D

    others, models = [k for k in keys if k != "model"], [k for k in keys if k == "model"]
    looks: list[dict[str, Any] | None] = [PLAIN_LINE | {"color": CYCLE[0]} for _ in runs]
    lines = []
    for key, (name, means) in zip([*others[:1], *models, *others[1:]], KEY_LOOKS, strict=False):
        there = list(dict.fromkeys(run.keys.get(key) for run in runs))
        there = there if key == "model" else sorted(there, key=lambda v: (isinstance(v, str), v))
        kept = sorted({round(k) for k in np.linspace(0, len(there) - 1, min(SHOWN_VALUES, len(there)))})
        values = {there[at]: {name: means[k % len(means)]} for k, at in enumerate(kept)}
        lines += [Line2D([], [], label=in_words(key, value), **PLAIN_LINE | look) for value, look in values.items()]
        for k, (run, look) in enumerate(zip(runs, looks, strict=True)):
            mine = values.get(run.keys.get(key))
            looks[k] = None if look is None or mine is None else look | mine
    return looks, lines


def draw_sweep(folder: Path, runs: Sequence[FinishedRun]) -> list[Path]:
    """Draw sweep_curves.png and, against a number of at least LEAST_VALUES, sweep_rates.png; returns their paths."""
    keys = swept_keys(runs)
    curved = [run for run in runs if run.curves is not None]
    drawn = [sweep_curves(folder / "sweep_curves.png", curved, keys)] if keys and len(curved) > 1 else []
    for key in keys:
        numbers = {run.keys[key] for run in runs if isinstance(run.keys.get(key), int | float)}
        if len(numbers) >= LEAST_VALUES:
            return [*drawn, sweep_rates(folder / "sweep_rates.png", runs, key, [k for k in keys if k != key])]
    return drawn


@style.picture
def sweep_curves(path: Path | None, runs: Sequence[FinishedRun], keys: Sequence[str]) -> Any:
    """A plot a point, a line a run that has curves."""
    looks, handles = looks_of(runs, keys)
    shown = [(run.curves, look) for run, look in zip(runs, looks, strict=True) if run.curves is not None and look]
    fig = _four_points(shown)
    if handles:
        fig.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6))
    names = [KEY_NAMES.get(k, k.split(".")[-1].replace("_", " ")) for k in keys]
    some = f" ({len(shown)} of {len(runs)} runs)" if len(shown) < len(runs) else ""
    return style.save(fig, path, f"Points 1-4 against belt travel, by {words.join_words(names)}{some}")


@style.picture
def sweep_rates(path: Path | None, runs: Sequence[FinishedRun], along: str, keys: Sequence[str]) -> Any:
    """Rates against one number, a line a set of the other keys; hollow where a run has not settled."""
    from matplotlib.lines import Line2D

    fig, [ax] = style.figure(8.4, 4.8)
    looks, handles = looks_of(runs, keys)
    lines: dict[str, tuple[dict[str, Any], list[FinishedRun]]] = {}
    for run, look in zip(runs, looks, strict=True):
        if look is not None and isinstance(run.keys.get(along), int | float):
            lines.setdefault(str([run.keys.get(k) for k in keys]), (look, []))[1].append(run)
    settled = np.ones(0, bool)
    for look, mine in lines.values():
        mine.sort(key=lambda run: run.keys[along])
        rate = np.array([run.late if run.steady is None else run.steady for run in mine]) / MM_PER_M
        x, own = np.array([run.keys[along] for run in mine]), np.array([run.settled for run in mine])
        ax.plot(x, rate, **look)
        for some, face in ((own, look["color"]), (~own, "white")):
            ax.plot(x[some], rate[some], "o", color=look["color"], markersize=5, markerfacecolor=face)
        settled = np.append(settled, own)
    steady = [run.steady is not None or run.settled for run in runs]  # whether the rate that is drawn is the steady one
    late = "" if all(steady) else ": late rate of point 1 where the steady one is unknown"
    if not settled.all():
        hollow: dict[str, Any] = {"marker": "o", "linestyle": "none", "color": INK, "markerfacecolor": "white"}
        handles.append(Line2D([], [], label=f"not settled{late}", **hollow))
    if handles:
        fig.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 5))
    ax.axhline(0.0, color=INK, linewidth=0.8, zorder=1)
    ax.margins(x=0.03)
    column = "steady_rate_mm_per_m" if any(steady) else "rate1_mm_per_m"
    ax.set(xlabel=AXIS_LABELS.get(along, along.replace("_", " ")), ylabel=AXIS_LABELS[column])
    name, *names = (KEY_NAMES.get(k, k.split(".")[-1].replace("_", " ")) for k in (along, *keys))
    title = f"{'Steady' if any(steady) else 'Late'} rate against {name}"
    return style.save(fig, path, f"{title}, by {words.join_words(names)}" if keys else title)


def record_sweep(path: Path, runs: Sequence[FinishedRun]) -> Path:
    """Write one recording of all runs that have curves: a view and a tab a set of settings, its models together."""
    from belt_sim.show.rerun import Overlay, record_runs, run_title

    keys = [k for k in swept_keys(runs) if k not in ("tension", "yaw", "yaw_head", "direction", "model")]
    overlays: dict[str, Overlay] = {}
    for run in sorted(runs, key=lambda r: (r.case.settings.tension, float(r.case.settings.yaw.last()))):
        if run.curves is None:
            continue
        title = ", ".join([run_title(run.case), *(in_words(k, run.keys.get(k)) for k in keys)])
        there = overlays.get(title, Overlay(modelled={}, case=run.case))
        overlays[title] = replace(there, modelled={**there.modelled, run.model: run.curves})
    models = words.join_words(list(dict.fromkeys(run.model for run in runs)))
    return record_runs(path, overlays, name=f"sweep of {len(runs)} runs, {models}")
