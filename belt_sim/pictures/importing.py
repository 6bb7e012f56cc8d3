"""What an import understood: every run with its signals, its yaw and its settings."""

import os
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from belt_sim.campaign import Campaign, Run
from belt_sim.pictures import style
from belt_sim.pictures.style import CYCLE, FAINT, POINTS
from belt_sim.si import DEGREE, MM, N_PER_MM2

ACROSS, MOST = 4, 24


@style.picture
def understood_picture(path: str | os.PathLike, campaign: Campaign) -> Path:
    """A panel a run: readings [mm or mrad] over travel [m]; a dashed line where the yaw is applied."""
    shown = [r for r in campaign.runs if len(r.travel)][:MOST]
    if not shown:
        return _rates(path, campaign)
    across = min(ACROSS, len(shown))
    down = -(-len(shown) // across)
    fig, axes = style.figure(3.1 * across + 0.6, 2.3 * down + 1.2, down, across, sharex=True)
    flat = [ax for row in axes for ax in row]
    for ax, run in zip(flat, shown, strict=False):
        _panel(ax, run, campaign)
    for ax in flat[len(shown) :]:
        ax.set_visible(False)
    for k, ax in enumerate(flat[: len(shown)]):
        if k % across == 0:
            ax.set_ylabel(_ylabel(campaign))
        if k + across >= len(shown):
            ax.set_xlabel("belt travel [m]")
            ax.tick_params(labelbottom=True)
    fig.legend(*flat[0].get_legend_handles_labels(), loc="outside lower left", ncols=6)
    left = len([r for r in campaign.runs if len(r.travel)]) - len(shown)
    style.title(fig, campaign.title[:90] + (f" ({left} more runs)" if left else ""))
    return style.save(fig, path)


def _panel(ax, run: Run, campaign: Campaign) -> None:
    for k, signal in enumerate(campaign.signals):
        y = run.signals.get(signal.name)
        colour = POINTS[int(signal.at[-1]) - 1] if signal.at.startswith("point") else CYCLE[4 + k % 3]
        name = f"{signal.name} at {signal.at.replace('_', ' ')}"
        values = np.full(len(run.travel), np.nan) if y is None else y / MM
        marker = "." if np.isfinite(values).sum() < 30 else None
        there = np.isfinite(values)
        ax.plot(run.travel[there], values[there], color=colour, label=name, linewidth=1.3, marker=marker)
    ax.axvline(run.yaw_at, color=FAINT, linestyle="--", linewidth=1.0)
    repeat = f", repeats {run.repeat_of}" if run.repeat_of else ""
    turned = ", reversed" if run.direction < 0 else ""
    settings = f"{run.tension / N_PER_MM2:.3g} N/mm2, {run.yaw / DEGREE:+.3g} deg{turned}{repeat}"
    ax.set_title(f"{run.name[:28]}\n{settings}", fontsize=style.FONT - 2)


def _ylabel(campaign: Campaign) -> str:
    kinds = {s.kind for s in campaign.signals}
    return "y [mm]" if kinds == {"lateral"} else "roll [mrad]" if kinds == {"tilt"} else "y [mm], roll [mrad]"


def _rates(path: str | os.PathLike, campaign: Campaign) -> Path:
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
    style.title(fig, campaign.title[:70])
    return style.save(fig, path)
