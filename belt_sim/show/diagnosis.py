"""Pictures of a comparison or diagnosis: overlays, failure maps, parameter drifts, candidates, visible effects."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from belt_sim.results.diagnosis import Discovery
from belt_sim.results.errors import WELL, Drift, FailureMap, Panel, Visible
from belt_sim.show import style
from belt_sim.show.style import AFTER_COLOUR, BEFORE_COLOUR, CYCLE, FAINT_INK, INK, MEASURED
from belt_sim.units import shop_unit

PANELS_ABREAST = 2
PANEL_WIDTH, PANEL_HEIGHT = 5.4, 3.5  # [inch] of a panel with what stands about it
#: [inch] around and between panels; a title stands above each
AROUND = {"left": 0.8, "right": 0.15, "top": 0.75, "bottom": 1.75, "across": 0.85, "down": 1.65}
RESIDUAL_GAP = 0.06  # between a panel and its residual, likewise
RESIDUAL = 0.4  # height of a panel's residual (model - measured), in heights of the panel

PANEL_DOTS = 60  # measured samples shown in one panel
MOST_PANELS = 36  # of a page, whose readers choose among them
FEW_PANELS = 6  # of a picture, as large as a screen


def shown_panels(panels: Sequence[Panel], most: int = MOST_PANELS) -> Sequence[Panel]:
    """Those that there is room for: of too many, those with the largest misfit."""
    if len(panels) <= most:
        return panels
    least = sorted((p.misfit for p in panels), reverse=True)[most - 1]
    return [p for p in panels if p.misfit >= least][:most]


@style.picture
def overlay_picture(
    path: str | os.PathLike | None,
    panels: Sequence[Panel],
    title: str,
    *,
    names: Mapping[str, str],
    most: int = FEW_PANELS,
) -> Path:
    """Small multiples of measured against modelled, of more than ``most`` panels those with the largest misfit; names:
    of "base" and "final" for the legend."""
    if len(panels) > most:
        title = f"{title}: the {most} largest misfits of {len(panels)} records"
        panels = shown_panels(panels, most)
    columns = min(PANELS_ABREAST, len(panels))
    rows = -(-len(panels) // columns)
    size = max(PANEL_WIDTH * columns, 6.5), PANEL_HEIGHT * rows + 1.0
    fig, axes = style.figure(*size, rows, columns, count=len(panels), layout=None, sharex=True)
    entries = {}
    band: dict[str, Any] = {"color": FAINT_INK, "alpha": 0.35, "linewidth": 0}
    dots: dict[str, Any] = {"markersize": 3.2, "markeredgewidth": 0.0, "color": MEASURED, "alpha": 0.55}
    for k, (ax, panel) in enumerate(zip(axes, panels, strict=True)):
        centre = panel.base if panel.final is None else panel.final
        ax.fill_between(panel.travel, centre - panel.band, centre + panel.band, label="uncertainty (2u)", **band)
        shown = slice(None, None, max(1, len(panel.travel) // PANEL_DOTS))
        ax.plot(panel.travel[shown], panel.measured[shown], "o", label=names.get("measured", "measured"), **dots)
        ax.plot(panel.travel, panel.base, color=BEFORE_COLOUR, linestyle=(0, (4, 2)), label=names["base"])
        if panel.final is not None:
            ax.plot(panel.travel, panel.final, color=AFTER_COLOUR, label=names["final"])
        ax.set(title=panel.title, ylabel=f"{'tilt' if panel.unit == 'mrad' else 'position y'} [{panel.unit}]")
        ax.set_gid(f"panel-{k}")
        ax.margins(x=0.02)
        ax.tick_params(labelbottom=False)
        ax.locator_params(nbins=6)
        entries.update(dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True)))

        # the residual below
        below = ax.inset_axes((0.0, -RESIDUAL - RESIDUAL_GAP, 1.0, RESIDUAL), sharex=ax)
        below.fill_between(panel.travel, -panel.band, panel.band, **band)
        below.plot(panel.travel, panel.base - panel.measured, color=BEFORE_COLOUR, linewidth=1.2)
        if panel.final is not None:
            below.plot(panel.travel, panel.final - panel.measured, color=AFTER_COLOUR, linewidth=1.2)
        below.set_ylabel(f"error [{panel.unit}]", fontsize=style.FONT - 2)
        below.tick_params(labelsize=style.FONT - 2)
        below.locator_params(axis="y", nbins=3)
        below.set_xlabel("belt travel [m]")
    fig.legend(entries.values(), entries.keys(), loc="lower center", ncols=len(entries))

    style.place(fig, title, rows, columns, **AROUND)
    return style.save(fig, path)


CELL_EDGE = "#fdfdfd"  # white that a page does not take for its paper: it turns all of a cell where it is dark
#: |E / u_val| inside of which nothing can be said (ASME V&V 20 with k = 2), and where the colour is full.
SAYS_NOTHING = 2.0
FULL_COLOUR = 10.0


@style.picture
def where_map_picture(path: str | os.PathLike | None, maps: Sequence[FailureMap], title: str) -> Path:
    """A heat map a signal and yaw sign; each cell holds E/u_val. Grey cells were not measured, white ones say
    nothing."""
    from matplotlib.colors import ListedColormap

    at = np.linspace(-FULL_COLOUR, FULL_COLOUR, 401)
    beyond = np.sign(at) * np.maximum(np.abs(at) - SAYS_NOTHING, 0.0) / (FULL_COLOUR - SAYS_NOTHING)
    colours = ListedColormap(style.diverging_map()(0.5 + 0.5 * beyond))
    look: dict[str, Any] = {"cmap": colours, "vmin": -FULL_COLOUR, "vmax": FULL_COLOUR, "edgecolors": CELL_EDGE}
    columns = min(2, len(maps))
    rows = -(-len(maps) // columns)
    most = max(len(m.tension) for m in maps)
    size = 5.6 * columns + 0.8, rows * (0.42 * most + 1.1) + 1.1
    fig, axes = style.figure(*size, rows, columns, count=len(maps), layout=None)
    for k, (ax, one) in enumerate(zip(axes, maps, strict=True)):
        ratio, below = np.asarray(one.ratio, float), np.arange(len(one.tension) + 1)
        ax.set_facecolor(style.GRID)
        mesh = ax.pcolormesh(one.edges, below, np.ma.masked_invalid(ratio), gid=f"cells-{k}", **look)
        middle = 0.5 * (np.asarray(one.edges)[1:] + np.asarray(one.edges)[:-1])
        for i, j in np.argwhere(np.isfinite(ratio)):
            size_of = abs(float(ratio[i, j]))
            strong = size_of - SAYS_NOTHING > 0.55 * (FULL_COLOUR - SAYS_NOTHING)
            number, colour = f"{ratio[i, j]:.0f}" if size_of >= 1.0 else "·", style.PAPER if strong else INK
            ax.text(middle[j], i + 0.5, number, color=colour, fontsize=style.FONT - 2, ha="center", va="center")
        ax.set_yticks(below[:-1] + 0.5, [f"{t:.4g}" for t in one.tension])
        ax.set(xlabel="belt travel [m]", ylabel="tension [N/mm²]", title=one.title)
        ax.grid(False)
    between = "\n" if rows * most < 6 else " "  # of a low bar
    inches = {"left": 0.75, "right": 1.3, "top": 0.75, "bottom": 0.6, "across": 0.85, "down": 0.95}
    style.place(fig, title, rows, columns, **inches)
    low, high, right = (axes[k].get_position() for k in (-1, 0, columns - 1))
    beside = fig.add_axes((right.x1 + 0.25 / size[0], low.y0, 0.18 / size[0], high.y1 - low.y0))
    bar = fig.colorbar(mesh, cax=beside, label=f"(model − measured){between}/ its uncertainty")
    bar.set_ticks([-FULL_COLOUR, -5, -SAYS_NOTHING, 0, SAYS_NOTHING, 5, FULL_COLOUR])
    bar.outline.set_visible(False)
    return style.save(fig, path)


@style.picture
def drift_chart_picture(
    path: str | os.PathLike, drifts: Sequence[Drift], title: str, *, names: Mapping[str, str]
) -> Path:
    """A parameter against tension, before the effects were added and after, if any were; names: as of an overlay. Bars
    are +-2 u, a triangle marks a value at the end of its range."""
    fig, [ax] = style.figure(5.2, 4.2, layout=None)
    before = drifts[0]
    if before.stated is not None:
        low, high = before.stated - 2 * before.u_stated, before.stated + 2 * before.u_stated
        ax.axhspan(low, high, color=FAINT_INK, alpha=0.3, linewidth=0)
        ax.axhline(before.stated, color=INK, linewidth=1.0, label="data sheet")
    looks = [(BEFORE_COLOUR, "o", 0.985, names["base"]), (AFTER_COLOUR, "s", 1.015, names["final"])]
    for drift, (colour, marker, aside, label) in zip(drifts, looks, strict=False):
        at, ended = np.asarray(drift.tension) * aside, np.asarray(drift.u) == 0.0
        bars: dict[str, Any] = {"fmt": marker, "color": colour, "capsize": 3.0, "markersize": 5.5, "elinewidth": 1.4}
        ax.errorbar(at[~ended], drift.value[~ended], 2 * drift.u[~ended], label=label, **bars)
        if ended.any():
            look: dict[str, Any] = {"color": colour, "markersize": 8.0, "markerfacecolor": "none"}
            ax.plot(at[ended], drift.value[ended], "^", label="at the limit of the fit", **look)
    ax.set_xscale("log")
    ticks = np.unique(before.tension)
    ax.set_xticks(ticks, [f"{t:.4g}" for t in ticks])
    ax.set_xticks([], minor=True)
    ax.margins(y=0.1)
    ax.set(xlabel="tension [N/mm²]", ylabel=f"{axis_label(before.parameter, before.unit)}, bars 2u")
    entries = dict(zip(*reversed(ax.get_legend_handles_labels()), strict=True))
    fig.legend(entries.values(), entries.keys(), loc="lower center", ncols=2)
    style.place(fig, title, 1, 1, left=0.75, right=0.15, top=0.5, bottom=1.2)
    return style.save(fig, path)


#: Shares of the largest plausible size between which bars are drawn.
LEAST_DRAWN, MOST_DRAWN = 1e-4, 10.0


@style.picture
def visible_picture(path: str | os.PathLike, visible: Sequence[Visible], title: str) -> Path:
    """A bar an effect, from its smallest visible size to the largest that a machine could have; none where it hides."""
    fig, [ax] = style.figure(8.0, 0.3 * len(visible) + 1.8, layout=None)
    rows = np.arange(len(visible))[::-1]
    ax.set_yticks(rows, [v.effect for v in visible])
    ax.grid(False, axis="y")
    share = np.array([v.share for v in visible])
    for some, alpha in ((share < WELL, 1.0), ((share >= WELL) & (share < 1.0), 0.45)):
        start = np.maximum(share[some], LEAST_DRAWN)
        ax.barh(rows[some], 1.0 - start, left=start, height=0.7, color=AFTER_COLOUR, alpha=alpha)
    for row in np.flatnonzero(share >= 1.0).tolist():
        said = "hidden" if visible[row].smallest is None else "only beyond"
        ax.annotate(said, (1.05, rows[row]), va="center", color=INK)
    ax.axvline(1.0, color=FAINT_INK, linewidth=1.2)
    ax.set(xscale="log", xlim=(LEAST_DRAWN, MOST_DRAWN), ylim=(-0.7, len(visible) - 0.3))
    decades = np.geomspace(LEAST_DRAWN, MOST_DRAWN, 6)
    ax.set_xticks(decades, [f"{share:g}" for share in decades])  # powers of ten would load a typesetter of formulas
    ax.set_xticks([], minor=True)
    ax.set_xlabel("size that shows, over the largest that a machine could have")
    left = 0.3 + 0.085 * max(len(v.effect) for v in visible)
    style.place(fig, f"What would show: {title}", 1, 1, left=left, right=0.2, top=0.5, bottom=0.6)
    return style.save(fig, path)


UNKNOWN_LABEL = "unknown input u"


def axis_label(name: str, unit: str) -> str:
    """The name of an axis with its unit, where it has one."""
    return f"{name} [{unit}]" if unit not in ("", "1") else name


@style.picture
def unknown_picture(path: str | os.PathLike[str], d: Discovery) -> Path:
    """u against travel, a line a tension (or run) with two sigma about it."""
    factor, unit = shop_unit(d.unit)
    many = len(d.courses) > len(CYCLE)
    fig, [ax] = style.figure(8.0, 4.4)
    for k, c in enumerate(d.courses):
        colour, sd = CYCLE[k % len(CYCLE)], 2.0 * c.sd
        band: Any = {"alpha": 0.10 if many else 0.18, "linewidth": 0}
        ax.fill_between(c.travel, factor * (c.u - sd), factor * (c.u + sd), color=colour, **band)
        ax.plot(c.travel, factor * c.u, color=colour, label=c.label)
    ax.axhline(0.0, color=INK, linewidth=0.8)
    ax.set(xlabel="belt travel [m]", ylabel=axis_label(UNKNOWN_LABEL, unit))
    if not many:
        fig.legend(loc="outside lower center", ncols=min(len(d.courses), 4))
    words = next((p.words for p in d.places if d.law is None or p.words in d.law.place), d.places[0].words)
    return style.save(fig, path, f"Unknown input at one place: {words}")


@style.picture
def law_picture(path: str | os.PathLike[str], d: Discovery) -> Path:
    """The unknown against the variable that it depends on: points as the data show them, the law as a line."""
    assert d.law is not None
    assert d.curve is not None
    factor, unit = shop_unit(d.unit)
    scale, xlabel, ylabel = 1.0, "belt travel [m]", axis_label(UNKNOWN_LABEL, unit)
    if "yaw" in d.law.variable:
        factor, ylabel = 1.0, axis_label(UNKNOWN_LABEL, "share of the yaw" if d.unit == "rad" else f"{d.unit} per rad")
    elif d.law.variable_unit != "1":
        scale, of = (1e3, "mm/s") if d.law.variable_unit == "m/s" else shop_unit(d.law.variable_unit)
        xlabel = axis_label(d.law.variable, of)
    fig, [ax] = style.figure(8.0, 4.6)
    for k, a in enumerate(d.against):
        look: Any = {"linestyle": "none", "marker": "o", "markersize": 3.6, "markeredgewidth": 0.0, "alpha": 0.6}
        label = f"{a.tension / 1e6:g} N/mm²"
        ax.plot(scale * a.x, factor * a.u, color=CYCLE[k % len(CYCLE)], label=label, **look)
    ax.plot(scale * d.curve.x, factor * d.curve.u, color=INK, label="the law")
    ax.set(xlabel=xlabel, ylabel=ylabel)
    fig.legend(loc="outside lower center", ncols=min(len(d.against) + 1, 5))
    return style.save(fig, path, f"The law: {d.law.formula}")
