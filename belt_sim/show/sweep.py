"""A finished sweep: pictures keyed by what was swept, and one recording of all its runs."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from belt_sim.case import Case
from belt_sim.curves import Curves, read_curves
from belt_sim.io import read_json
from belt_sim.results import words
from belt_sim.settings import case_from
from belt_sim.show import style
from belt_sim.show.style import CYCLE, INK, POINT_NAMES

DASHES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1.5, 1.5)), (0, (6, 2, 1.5, 2)))
MOST = 8  # values of one key that a picture tells apart, spread evenly over those that there are
LEAST = 3  # values of a number, from which on rates are drawn against it
#: keys of a run that say what it is, in the order in which they get colours; others follow
KEYS = ("tension", "yaw", "yaw_head", "effects", "travel", "speed", "direction")
AXES = {
    "tension": "tension [N/mm$^2$]",
    "yaw": "yaw of the tail pulley [degrees]",
    "yaw_head": "yaw of the head pulley [degrees]",
    "speed": "belt speed [m/s]",
    "rig.centre_distance": "distance of the pulleys' axes [m]",
    "belt.width": "belt width [m]",
    "belt.thickness": "belt thickness [m]",
}
STEADY, LATE = "steady rate [mm per m of travel]", "late rate of point 1 [mm per m of travel]"


@dataclass(frozen=True, kw_only=True)
class FinishedRun:
    """A run of a sweep: keys, what was set in it, by name; steady: the steady rate [m/m], where it is known; late: of
    point 1 [m/m], settled or not. curves: None of a model that gives rates only."""

    keys: Mapping[str, Any]
    case: Case
    model: str
    curves: Curves | None
    late: float
    steady: float | None
    settled: bool

    @property
    def rate(self) -> float:
        return self.late if self.steady is None else self.steady

    @property
    def is_steady(self) -> bool:
        """Whether the rate that is drawn is the steady one."""
        return self.steady is not None or self.settled


def read_run(folder: Path) -> FinishedRun:
    """Read a finished run from its folder; raises BeltError, OSError, KeyError where its files are damaged."""
    from omegaconf import OmegaConf  # Hydra notes references as they are written

    config: Any = OmegaConf.to_container(OmegaConf.load(folder / ".hydra" / "config.yaml"), resolve=True)
    typed = yaml.safe_load((folder / ".hydra" / "overrides.yaml").read_text(encoding="utf-8")) or []
    summary = read_json(folder / "summary.json")
    own = dict(o.lstrip("+").split("=", 1) for o in typed if "=" in o)
    keys = {k: _plain(config.get(k)) for k in KEYS} | {"model": summary["model"]}
    keys |= {k: _plain(yaml.safe_load(v)) for k, v in own.items() if k not in keys}
    keys["effects"] = words.join_effects([e["id"] for e in summary["effects"]]) if own.get("effects") else ""
    if own.get("effects") and summary["effects"]:
        keys["effects"] = own["effects"]
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


def _plain(value: Any) -> Any:
    return value if isinstance(value, int | float | str) else "" if value is None else str(value)


def swept_keys(runs: Sequence[FinishedRun]) -> list[str]:
    """The keys whose values differ, the model last."""
    names = [*KEYS, *dict.fromkeys(k for run in runs for k in run.keys if k not in KEYS and k != "model"), "model"]
    return [k for k in names if len({str(run.keys.get(k)) for run in runs}) > 1]


def in_words(key: str, value: Any) -> str:
    """A value of a key as a legend says it."""
    if key == "tension":
        return f"{value:g} N/mm²"
    if key in ("yaw", "yaw_head") and isinstance(value, int | float):
        return f"{'yaw' if key == 'yaw' else 'head yaw'} {value:+g}°".replace("-", "−")
    if key == "model":
        return str(value)
    return f"{key} {value}" if value != "" else f"no {key}"


@dataclass(frozen=True)
class Looks:
    """How the values of up to three keys look: colours, dashes, widths; a key that is not swept has one look."""

    keys: tuple[str, ...]
    values: tuple[tuple[Any, ...], ...]

    def of(self, run: FinishedRun) -> dict[str, Any] | None:
        """The look of a run; None where it is not among those that are shown."""
        looks: dict[str, Any] = {"color": CYCLE[0], "linestyle": "-", "linewidth": 1.8}
        for how, (key, values) in enumerate(zip(self.keys, self.values, strict=True)):
            value = run.keys.get(key)
            if value not in values:
                return None
            looks |= self._one(how, values.index(value))
        return looks

    def _one(self, how: int, k: int) -> dict[str, Any]:
        choices: tuple[tuple[str, Sequence[Any]], ...]
        choices = (("color", CYCLE), ("linestyle", DASHES), ("linewidth", (1.8, 0.9, 3.0, 0.5)))
        name, of = choices[min(how, 2)]
        return {name: of[k % len(of)]}

    def legend(self) -> list[Any]:
        """A handle a value, key by key."""
        from matplotlib.lines import Line2D

        handles = []
        for how, (key, values) in enumerate(zip(self.keys, self.values, strict=True)):
            for k, value in enumerate(values):
                plain = {"color": INK, "linestyle": "-", "linewidth": 1.8}
                handles.append(Line2D([], [], **{**plain, **self._one(how, k)}, label=in_words(key, value)))
        return handles


def looks_of(runs: Sequence[FinishedRun], keys: Sequence[str]) -> Looks:
    """Colour = the first key (tension, where it is swept), dash = the model, else the second key; width = a third."""
    others, models = [k for k in keys if k != "model"], [k for k in keys if k == "model"]
    chosen = (*others[:1], *(models or others[1:2]), *(others[1:2] if models else others[2:3]))
    if models and not others:
        chosen = ("model",)
    values = []
    for key in chosen:
        there = list(dict.fromkeys(run.keys.get(key) for run in runs))
        there = sorted(there, key=lambda v: (isinstance(v, str), v)) if key != "model" else there
        kept = sorted({round(k) for k in np.linspace(0, len(there) - 1, min(MOST, len(there)))})
        values.append(tuple(there[k] for k in kept))
    return Looks(chosen, tuple(values))


def draw_sweep(folder: Path, runs: Sequence[FinishedRun]) -> list[Path]:
    """Draw sweep_curves.png and, against a number of at least LEAST values, sweep_rates.png; returns their paths."""
    keys = swept_keys(runs)
    curved = [run for run in runs if run.curves is not None]
    drawn = [sweep_curves(folder / "sweep_curves.png", curved, keys)] if keys and len(curved) > 1 else []
    for key in keys:
        numbers = {run.keys[key] for run in runs if isinstance(run.keys.get(key), int | float)}
        if len(numbers) >= LEAST:
            return [*drawn, sweep_rates(folder / "sweep_rates.png", runs, key, [k for k in keys if k != key])]
    return drawn


@style.picture
def sweep_curves(path: Path | None, runs: Sequence[FinishedRun], keys: Sequence[str]) -> Any:
    """A plot a point, placed as on the machine: head left, tail right, upper span above."""
    fig, axes = style.figure(10.0, 6.6, 2, 2, sharex=True, sharey=True)
    looks = looks_of(runs, keys)
    for k, ax in {3: axes[0][0], 0: axes[0][1], 2: axes[1][0], 1: axes[1][1]}.items():
        for run in runs:
            if (look := looks.of(run)) is not None and run.curves is not None:
                ax.plot(run.curves.travel, 1e3 * np.asarray(run.curves.y)[k], **look)
        ax.set_title(f"Point {POINT_NAMES[k]}")
        ax.axhline(0.0, color=INK, linewidth=0.8, zorder=1)
        ax.margins(x=0.0)
    for row in axes:
        row[0].set_ylabel("lateral position y [mm]")
    for ax in axes[1]:
        ax.set_xlabel("belt travel [m]")
    handles = looks.legend()
    fig.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 6))
    shown = sum(looks.of(run) is not None for run in runs)
    some = f" ({shown} of {len(runs)} runs)" if shown < len(runs) else ""
    return style.finish(fig, path, f"Points 1-4 against belt travel, by {_and(keys)}{some}")


@style.picture
def sweep_rates(path: Path | None, runs: Sequence[FinishedRun], along: str, keys: Sequence[str]) -> Any:
    """Rates against one number, a line a set of the other keys; hollow where a run has not settled."""
    fig, [[ax]] = style.figure(8.4, 4.8)
    looks = looks_of(runs, keys)
    lines: dict[str, list[FinishedRun]] = {}
    for run in runs:
        if looks.of(run) is not None and isinstance(run.keys.get(along), int | float):
            lines.setdefault(str([run.keys.get(k) for k in keys]), []).append(run)
    hollow = False
    for mine in lines.values():
        mine.sort(key=lambda run: run.keys[along])
        x, rate = np.array([run.keys[along] for run in mine]), 1e3 * np.array([run.rate for run in mine])
        look, steady = looks.of(mine[0]), np.array([run.is_steady for run in mine])
        assert look is not None
        ax.plot(x, rate, **look)
        ax.plot(x[steady], rate[steady], "o", color=look["color"], markersize=5)
        ax.plot(x[~steady], rate[~steady], "o", color=look["color"], markersize=5, markerfacecolor="white")
        hollow = hollow or not steady.all()
    handles = looks.legend()
    if hollow:
        from matplotlib.lines import Line2D

        dot: dict[str, Any] = {"marker": "o", "linestyle": "none", "color": INK, "markerfacecolor": "white"}
        handles.append(Line2D([], [], **dot, label="not settled: late rate of point 1"))
    if handles:
        fig.legend(handles=handles, loc="outside lower center", ncols=min(len(handles), 5))
    ax.axhline(0.0, color=INK, linewidth=0.8, zorder=1)
    ax.margins(x=0.03)
    all_late = all(not run.is_steady for run in runs)
    ax.set(xlabel=AXES.get(along, along.replace("_", " ")), ylabel=LATE if all_late else STEADY)
    title = f"{'Late' if all_late else 'Steady'} rate against {_word(along)}"
    return style.finish(fig, path, f"{title}, by {_and(keys)}" if keys else title)


def _word(key: str) -> str:
    return {"yaw": "yaw", "yaw_head": "yaw of the head pulley"}.get(key, key.split(".")[-1].replace("_", " "))


def _and(keys: Sequence[str]) -> str:
    return words.join_words([_word(key) for key in keys])


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
