"""The interactive figures of the report, as plain plotly data and layout.

Colours are names of the page's style (--ink, --before ...), which the page looks up: light or dark as the reader has
them.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from belt_sim.results.diagnosis import Discovery
from belt_sim.results.drawings import Drift, FailureMap, Panel
from belt_sim.results.json import DIGITS, round_numbers
from belt_sim.show.diagnosis import FULL, SAYS_NOTHING, UNKNOWN, axis_label, law_axes
from belt_sim.si import shop_unit

INK, BEFORE, AFTER, FAINT = "--ink", "--before", "--after", "--faint"
FONT = {"family": "system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif", "size": 13, "color": INK}
AXIS = {"gridcolor": "--line", "zerolinecolor": FAINT, "linecolor": FAINT, "automargin": True}
CLEAR = "rgba(0,0,0,0)"
DOTS = {"color": INK, "size": 4, "opacity": 0.55}
CYCLE = tuple(f"--c{k}" for k in range(1, 7))  # tensions, in order
#: from far below zero to far above it, with what says nothing in the middle
DIVERGING = ((0.0, "--far-below"), (0.25, "--below"), (0.5, "--middle"), (0.75, "--above"), (1.0, "--far-above"))


def numbers(values) -> list:
    """An array as JSON numbers of DIGITS digits, null where it is not finite."""
    return round_numbers(np.asarray(values, float).tolist(), DIGITS)


def _layout(height: int, **more) -> dict[str, Any]:
    plain = {"paper_bgcolor": CLEAR, "plot_bgcolor": CLEAR, "font": FONT, "height": height, "showlegend": False}
    return {**plain, "margin": {"l": 54, "r": 16, "t": 12, "b": 44}, **more}


def overlay(panel: Panel, base: str, final: str) -> dict[str, Any]:
    """Above: measured, model before and after with the band. Below: model - measured and the same band."""
    travel, centre = numbers(panel.travel), panel.base if panel.final is None else panel.final
    band, unit = np.asarray(panel.band, float), panel.unit
    data = [
        *_band(travel, centre - band, centre + band, "y"),
        _line(travel, panel.base, base, BEFORE, "y", dash="dash"),
        {**_line(travel, panel.measured, "measured", INK, "y"), "mode": "markers", "marker": DOTS},
        *_band(travel, -band, band, "y2"),
        _line(travel, panel.base - panel.measured, base, BEFORE, "y2"),
    ]
    if panel.final is not None:
        data.append(_line(travel, panel.final, final, AFTER, "y"))
        data.append(_line(travel, panel.final - panel.measured, final, AFTER, "y2"))
    layout = _layout(
        480,
        xaxis={**AXIS, "anchor": "y2", "title": {"text": "belt travel [m]"}},
        yaxis={
            **AXIS,
            "domain": [0.42, 1.0],
            "title": {"text": f"{'tilt' if unit == 'mrad' else 'position y'} [{unit}]"},
        },
        yaxis2={**AXIS, "domain": [0.0, 0.34], "title": {"text": f"error [{unit}]"}},
        hovermode="x unified",
    )
    return {"data": data, "layout": layout}


def _line(x: list, y, name: str, colour: str, axis: str, *, dash: str = "solid") -> dict:
    look = {"color": colour, "width": 2, "dash": dash}
    return {"type": "scatter", "x": x, "y": numbers(y), "mode": "lines", "name": name, "line": look, "yaxis": axis}


def _band(x: list, low, high, axis: str) -> list[dict]:
    """The region in which model and measurement cannot be told apart."""
    hidden = {"type": "scatter", "x": x, "yaxis": axis, "mode": "lines", "line": {"width": 0}, "hoverinfo": "skip"}
    fill = {"fill": "tonexty", "fillcolor": "--band", "name": "uncertainty (2u)"}
    return [{**hidden, "y": numbers(low)}, {**hidden, "y": numbers(high), **fill}]


def colour_scale() -> list[list]:
    """Blue - white - red, white where |E/u_val| says nothing."""
    edge = SAYS_NOTHING / FULL
    at = [(0.5 * (1 - edge) * 2 * p if p < 0.5 else 1 - 0.5 * (1 - edge) * 2 * (1 - p), c) for p, c in DIVERGING]
    white = DIVERGING[len(DIVERGING) // 2][1]
    scale = [(p, c) for p, c in at if c != white] + [(0.5 - edge / 2, white), (0.5 + edge / 2, white)]
    return [[p, c] for p, c in sorted(scale)]


def where(one: FailureMap) -> dict[str, Any]:
    """A heat map of E/u_val over tension and travel; what was not measured is left empty."""
    ratio, edges = np.asarray(one.ratio, float), np.asarray(one.edges, float)
    heat = {
        "type": "heatmap",
        "x": numbers(0.5 * (edges[1:] + edges[:-1])),
        "y": [f"{t:.4g}" for t in one.tension],
        "z": numbers(ratio),
        "text": [["" if not np.isfinite(v) else f"{v:.0f}" if abs(v) >= 1 else "·" for v in row] for row in ratio],
        "texttemplate": "%{text}",
        "textfont": {"size": 11},
        "xgap": 2,
        "ygap": 2,
        "coloraxis": "coloraxis",
        "hovertemplate": f"{one.title}<br>%{{y}} N/mm²<br>travel about %{{x:.3~g}} m<br>"
        "E/u_val = %{z:.1f}<extra></extra>",
        "hoverongaps": False,
    }
    bare = {"showgrid": False, "zeroline": False, "automargin": True}
    layout = _layout(
        90 + 32 * len(one.tension),
        xaxis={
            **bare,
            "tickvals": numbers(edges),
            "tickformat": ".3~g",
            "title": {"text": "belt travel [m]", "standoff": 4},
        },
        yaxis={**bare, "type": "category", "title": {"text": "tension [N/mm²]", "standoff": 4}},
        plot_bgcolor="--track",
        coloraxis={"colorscale": colour_scale(), "cmin": -FULL, "cmax": FULL, "showscale": False},
    )
    return {"data": [heat], "layout": layout}


def drift(before: Drift, after: Drift | None) -> dict[str, Any]:
    """A parameter fitted tension by tension, before and after; bars are ±2u."""
    ticks = [float(t) for t in np.unique(before.tension)]
    shown = [(before, BEFORE, "circle", "before"), (after, AFTER, "square", "after")]
    data = [_bars(one, colour, symbol, name) for one, colour, symbol, name in shown if one is not None]
    log = {"type": "log", "tickvals": ticks, "ticktext": [f"{t:.4g}" for t in ticks]}
    layout = _layout(
        320,
        shapes=_stated_band(before),
        xaxis={**AXIS, **log, "title": {"text": "tension [N/mm²]"}},
        yaxis={**AXIS, "title": {"text": axis_label(before.parameter, before.unit)}},
    )
    return {"data": data, "layout": layout}


def _bars(one: Drift, colour: str, symbol: str, name: str) -> dict[str, Any]:
    error = {"type": "data", "array": numbers(2 * np.asarray(one.u)), "color": colour, "thickness": 1.6}
    marker = {"color": colour, "symbol": ["triangle-up-open" if end else symbol for end in one.at_limit], "size": 9}
    xy = {"x": numbers(one.tension), "y": numbers(one.value)}
    return {"type": "scatter", "mode": "markers", "name": name, **xy, "error_y": error, "marker": marker}


def _stated_band(one: Drift) -> list[dict]:
    """The data sheet's value as a band of ±2u and a line."""
    if one.stated is None:
        return []
    where_ = {"xref": "x domain", "x0": 0, "x1": 1, "yref": "y", "layer": "below"}
    low, high = one.stated - 2 * one.u_stated, one.stated + 2 * one.u_stated
    band = {"type": "rect", "y0": low, "y1": high, "fillcolor": FAINT, "opacity": 0.3, "line": {"width": 0}}
    line = {"type": "line", "y0": one.stated, "y1": one.stated, "line": {"color": INK, "width": 1}}
    return [{**where_, **band}, {**where_, **line}]


def course(courses: Sequence[Any], unit: str) -> dict[str, Any]:
    """An unknown u against travel, a line and a band of ±2 sigma a group of runs."""
    data, (factor, shown) = [], shop_unit(unit)
    for one, colour in _with_colours(courses):
        x, u, sd = numbers(one.travel), factor * np.asarray(one.u, float), factor * np.asarray(one.sd, float)
        low, high = _band(x, u - 2 * sd, u + 2 * sd, "y")
        data += [low, {**high, "name": one.label, "opacity": 0.5}]
        data.append(_line(x, u, one.label, colour, "y"))
    return {"data": data, "layout": _unknown("belt travel [m]", axis_label(UNKNOWN, shown))}


def law(d: Discovery) -> dict[str, Any]:
    """An unknown u against the variable of its law, points by tension, and the law as a line."""
    (scale, variable), (factor, unknown) = law_axes(d)
    data = []
    for one, colour in _with_colours(d.against):
        look = {"mode": "markers", "marker": {"color": colour, "size": 5, "opacity": 0.7}}
        points = {"x": numbers(scale * one.x), "y": numbers(factor * one.u), "name": f"{one.tension / 1e6:g} N/mm²"}
        data.append({"type": "scatter", **points, **look})
    if d.curve is not None:
        data.append(_line(numbers(scale * d.curve.x), factor * d.curve.u, "law", INK, "y"))
    return {"data": data, "layout": _unknown(variable, unknown)}


def _with_colours(rows: Sequence[Any]) -> list[tuple[Any, str]]:
    """Rows with colours that mean their tensions."""
    tensions = tensions_of(rows)
    return [(one, CYCLE[tensions.index(float(one.tension)) % len(CYCLE)]) for one in rows]


def tensions_of(rows: Sequence[Any]) -> list[float]:
    """Tensions [Pa] of some rows, in the order of their colours."""
    return sorted({float(one.tension) for one in rows})


def _unknown(variable: str, unknown: str) -> dict[str, Any]:
    axes = {"xaxis": {**AXIS, "title": {"text": variable}}, "yaxis": {**AXIS, "title": {"text": unknown}}}
    return _layout(320, **axes)
