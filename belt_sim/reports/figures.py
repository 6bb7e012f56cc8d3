"""The interactive figures of the report, as plain plotly data and layout."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from belt_sim.pictures.colours import AFTER, BEFORE, DIVERGING, FAINT, INK
from belt_sim.pictures.where import FULL, SAYS_NOTHING
from belt_sim.results.drawings import Drift, FailureMap, Panel

DIGITS = 6  # significant digits kept in the file
FONT = {"family": "system-ui, -apple-system, 'Segoe UI', 'DejaVu Sans', sans-serif", "size": 13, "color": INK}
AXIS = {"gridcolor": "#e4e7eb", "zerolinecolor": "#9aa5b1", "linecolor": "#9aa5b1", "automargin": True}
GREY = "#f1f3f5"


def numbers(values) -> list:
    """An array as JSON numbers of DIGITS digits, null where it is not finite."""
    values = np.asarray(values, float)
    if values.ndim > 1:
        return [numbers(row) for row in values]
    return [float(f"{v:.{DIGITS}g}") if np.isfinite(v) else None for v in values]


def _layout(height: int, **more) -> dict[str, Any]:
    """What all figures share."""
    plain = {"paper_bgcolor": "white", "plot_bgcolor": "white", "font": FONT, "height": height}
    legend = {"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0}
    return {**plain, "margin": {"l": 60, "r": 16, "t": 34, "b": 48}, "legend": legend, **more}


def overlay(panel: Panel, base: str, final: str) -> dict[str, Any]:
    """Above: measured, model before and after with the band. Below: model - measured and the same band."""
    travel, centre = numbers(panel.travel), panel.base if panel.final is None else panel.final
    band, unit = np.asarray(panel.band, float), panel.unit
    data = [
        *_band(travel, centre - band, centre + band, "y"),
        _line(travel, panel.base, base, BEFORE, "y", dash="dash"),
        _dots(travel, panel.measured),
        *_band(travel, -band, band, "y2", legend=False),
        _line(travel, panel.base - panel.measured, base, BEFORE, "y2", legend=False),
    ]
    if panel.final is not None:
        data.append(_line(travel, panel.final, final, AFTER, "y"))
        data.append(_line(travel, panel.final - panel.measured, final, AFTER, "y2", legend=False))
    layout = _layout(
        560,
        xaxis={**AXIS, "anchor": "y2", "title": {"text": "belt travel [m]"}},
        yaxis={**AXIS, "domain": [0.42, 1.0], "title": {"text": f"{panel.title} [{unit}]"}},
        yaxis2={**AXIS, "domain": [0.0, 0.34], "title": {"text": f"model − measured [{unit}]"}},
        hovermode="x unified",
    )
    return {"data": data, "layout": layout}


def _line(x: list, y, name: str, colour: str, axis: str, *, dash: str = "solid", legend: bool = True) -> dict:
    look = {"color": colour, "width": 2, "dash": dash}
    common = {"mode": "lines", "name": name, "line": look, "yaxis": axis, "showlegend": legend}
    return {"type": "scatter", "x": x, "y": numbers(y), **common}


def _dots(x: list, y) -> dict:
    marker = {"color": INK, "size": 4, "opacity": 0.55}
    return {
        "type": "scatter",
        "x": x,
        "y": numbers(y),
        "mode": "markers",
        "name": "measured",
        "marker": marker,
    }


def _band(x: list, low, high, axis: str, legend: bool = True) -> list[dict]:
    """The region in which model and measurement cannot be told apart."""
    hidden = {
        "mode": "lines",
        "line": {"width": 0},
        "hoverinfo": "skip",
        "yaxis": axis,
        "type": "scatter",
        "x": x,
    }
    fill = {"fill": "tonexty", "fillcolor": "rgba(154,165,177,0.30)", "name": "cannot say"}
    return [
        {**hidden, "y": numbers(low), "showlegend": False},
        {**hidden, "y": numbers(high), "showlegend": legend, **fill},
    ]


def colour_scale() -> list[list]:
    """Blue - white - red, white where |E/u_val| says nothing."""
    edge = SAYS_NOTHING / FULL
    at = [(0.5 * (1 - edge) * 2 * p if p < 0.5 else 1 - 0.5 * (1 - edge) * 2 * (1 - p), c) for p, c in DIVERGING]
    white = DIVERGING[len(DIVERGING) // 2][1]
    scale = [(p, c) for p, c in at if c != white] + [(0.5 - edge / 2, white), (0.5 + edge / 2, white)]
    return [[p, c] for p, c in sorted(scale)]


def where(maps: Sequence[FailureMap]) -> dict[str, Any]:
    """Heat maps of E/u_val, two in a row, one colour axis."""
    columns = min(2, len(maps))
    rows = -(-len(maps) // columns)
    high = 70 + 34 * max(len(m.tension) for m in maps)
    layout = _layout(rows * high + 60, annotations=[], margin={"l": 70, "r": 16, "t": 30, "b": 48})
    ticks = [-FULL, -5, -SAYS_NOTHING, 0, SAYS_NOTHING, 5, FULL]
    bar = {"title": {"text": "E / u_val"}, "tickvals": ticks, "thickness": 14, "outlinewidth": 0}
    layout["coloraxis"] = {"colorscale": colour_scale(), "cmin": -FULL, "cmax": FULL, "colorbar": bar}
    data = []
    for k, one in enumerate(maps):
        row, column = divmod(k, columns)
        data.append(_heat(one, k))
        gap_x, gap_y = 0.10 / max(columns - 1, 1), 0.34 / rows
        x0, y1 = column * (1 + gap_x) / columns, 1 - row * (1 + gap_y) / rows
        x1 = x0 + (1 + gap_x) / columns - gap_x if columns > 1 else 1.0
        y0 = y1 - ((1 + gap_y) / rows - gap_y)
        _heat_axes(layout, k, one, (x0, x1), (max(y0, 0.0), y1))
    return {"data": data, "layout": layout}


def _key(k: int) -> str:
    """Plotly's suffix of the k-th axis."""
    return "" if k == 0 else str(k + 1)


def _heat(one: FailureMap, k: int) -> dict[str, Any]:
    """One heat map; the number in each cell, the whole story on hovering."""
    ratio = np.asarray(one.ratio, float)
    told = f"{one.title}<br>%{{y}} N/mm²<br>travel about %{{x}} m<br>E/u_val = %{{z:.1f}}<extra></extra>"
    edges = np.asarray(one.edges, float)
    return {
        "type": "heatmap",
        "x": numbers(0.5 * (edges[1:] + edges[:-1])),
        "y": [f"{t:g}" for t in one.tension],
        "z": numbers(ratio),
        "text": [["" if not np.isfinite(v) else f"{v:.0f}" if abs(v) >= 1 else "·" for v in row] for row in ratio],
        "texttemplate": "%{text}",
        "textfont": {"size": 11},
        "xgap": 2,
        "ygap": 2,
        "coloraxis": "coloraxis",
        "hovertemplate": told,
        "hoverongaps": False,
        "xaxis": f"x{_key(k)}",
        "yaxis": f"y{_key(k)}",
    }


def _heat_axes(layout: dict, k: int, one: FailureMap, x: tuple[float, float], y: tuple[float, float]) -> None:
    """Axes and headline of the k-th map."""
    bare = {"showgrid": False, "zeroline": False, "automargin": True}
    ticks = numbers(np.asarray(one.edges))
    travel = {"anchor": f"y{_key(k)}", "tickvals": ticks, "title": {"text": "belt travel [m]", "standoff": 4}}
    tension = {
        "anchor": f"x{_key(k)}",
        "type": "category",
        "title": {"text": "tension [N/mm²]", "standoff": 4},
    }
    layout[f"xaxis{_key(k)}"] = {**bare, **travel, "domain": list(x)}
    layout[f"yaxis{_key(k)}"] = {**bare, **tension, "domain": list(y)}
    place = {"x": x[0], "y": y[1], "xref": "paper", "yref": "paper", "xanchor": "left", "yanchor": "bottom"}
    layout["annotations"].append({"text": f"<b>{one.title}</b>", "showarrow": False, **place})
    layout["plot_bgcolor"] = GREY


def drift(pairs: Sequence[tuple[Drift, Drift | None]]) -> dict[str, Any]:
    """Parameters fitted tension by tension, before and after; bars are ±2u."""
    count = len(pairs)
    layout, data = _layout(380, shapes=[]), []
    for k, (before, after) in enumerate(pairs):
        at = {"xaxis": f"x{_key(k)}", "yaxis": f"y{_key(k)}"}
        for one, colour, symbol, name in (
            (before, BEFORE, "circle", "before"),
            (after, AFTER, "square", "after"),
        ):
            if one is not None:
                data.append({**_bars(one, colour, symbol, name), **at, "showlegend": k == 0})
        width = 1.0 / count
        gap = 0.045 if count > 1 else 0.0
        unit = f" [{before.unit}]" if before.unit not in ("", "1") else ""
        ticks = [float(t) for t in np.unique(before.tension)]
        layout[f"xaxis{_key(k)}"] = {
            **AXIS,
            "type": "log",
            "anchor": f"y{_key(k)}",
            "domain": [k * width + gap * (k > 0), (k + 1) * width - gap * (k < count - 1)],
            "tickvals": ticks,
            "ticktext": [f"{t:g}" for t in ticks],
            "title": {"text": "tension [N/mm²]"},
        }
        layout[f"yaxis{_key(k)}"] = {
            **AXIS,
            "anchor": f"x{_key(k)}",
            "title": {"text": f"{before.parameter}{unit}"},
        }
        layout["shapes"] += _stated(before, k)
    return {"data": data, "layout": layout}


def _bars(one: Drift, colour: str, symbol: str, name: str) -> dict[str, Any]:
    """Values with bars of two sigma."""
    error = {"type": "data", "array": numbers(2 * np.asarray(one.u)), "color": colour, "thickness": 1.6}
    marker = {"color": colour, "symbol": symbol, "size": 9}
    xy = {"x": numbers(one.tension), "y": numbers(one.value)}
    return {"type": "scatter", "mode": "markers", "name": name, **xy, "error_y": error, "marker": marker}


def _stated(one: Drift, k: int) -> list[dict]:
    """The data sheet's value as a band of ±2u and a line."""
    if one.stated is None:
        return []
    where_ = {"xref": f"x{_key(k)} domain", "x0": 0, "x1": 1, "yref": f"y{_key(k)}", "layer": "below"}
    low, high = one.stated - 2 * one.u_stated, one.stated + 2 * one.u_stated
    band = {"type": "rect", "y0": low, "y1": high, "fillcolor": FAINT, "opacity": 0.3, "line": {"width": 0}}
    line = {"type": "line", "y0": one.stated, "y1": one.stated, "line": {"color": INK, "width": 1}}
    return [{**where_, **band}, {**where_, **line}]
