"""Which single causes, and which with a wrong load cell, agree with the paper: ``python -m studies.open_question``.

The statements M2, M3, M4 and M6 are judged as in studies/paper/statements, on the hanging strip with each candidate.
M3 and M4 are read in three ways: at the steady rate, over each curve's own straightest stretch, and over one window
that all four curves share. The paper does not say how its authors read their rates.

An even effect adds a response of its own that is proportional to its size (superposition, checked by
tests/studies/test_open_question.py), so that one run per tension gives every size. ``document=FILE.md`` writes the
tables, ``picture=FILE.png`` draws the readings of the strip alone against the length of the record.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from rich.console import Console

import belt_sim as bs
from belt_sim.io import write_text
from belt_sim.show import style
from studies.application import application

TENSIONS = (7.0, 10.0, 20.0, 40.0)  # [N/mm2], at which the paper measured
YAW = -0.042  # [deg]
START, SLOWER = 3.0, 0.9  # M2: y_1 after so many m, over that at 40, is at most this share of the beam's ratio
A_LOT = 1.2  # M3: rate at 7 and at 10 over that at 40
QUITE = 0.2  # M4: rate at 20 and at 40 off that of the beam of 2nd order
EARLY = 25.0  # [m], M6: over which curves should stay between rope and beam of 1st order
TRAVEL, LATE = 400.0, 0.2  # [m], and the share of it that gives the steady rate: 7 N/mm2 has settled within 1 %
STEP = 0.25  # [m] of the grid of readings
RECORDS = (20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 80.0, 100.0, 120.0, 150.0, 200.0)  # [m] of travel recorded
WINDOWS = (4.0, 6.0, 8.0, 10.0)  # [m] of a stretch over which a rate is read
CELL_ERRORS = (-1.0, 0.0, 1.0, 2.0)  # [N/mm2] that the load cell shows too much
SIZES = 400  # sizes tried between null and the largest
GRID = np.arange(0.0, TRAVEL + 0.5 * STEP, STEP)


@dataclass(frozen=True)
class Candidate:
    """An even effect: ``fields`` of an effects entry at ``unit``; sizes up to ``largest`` units are tried."""

    name: str
    fields: Mapping[str, Any]
    parameter: tuple[str, ...]
    unit: float
    largest: float
    words: str
    check: str

    def entry(self, size: float) -> list[dict[str, Any]]:
        """The effects entry at ``size`` units."""
        return [{**self.fields, **dict.fromkeys(self.parameter, size * self.unit)}]


EVEN = (
    Candidate("camber", {"id": "camber"}, ("kappa_c",), -1e-5, 20.0, "1e-5 1/m", "turn the belt over"),
    Candidate("taper of the tail pulley", {"id": "taper"}, ("kappa_t",), -1e-5, 20.0, "1e-5 1/m", "pi tape"),
    Candidate("taper of both pulleys, or a belt of uneven thickness", {"id": "taper"}, ("kappa_t", "kappa_t_head"),
              -1e-5, 20.0, "1e-5 1/m", "turn the belt over; pi tape"),
    Candidate("machine leans", {"id": "machine_tilt"}, ("angle",), -1e-3, 50.0, "mrad", "a level on the axles"),
    Candidate("roller askew at mid-span", {"id": "idler_skew"}, ("force",), -0.1, 100.0, "0.1 N", "lower the rollers"),
    Candidate("scraper or skirt at one edge", {"id": "side_drag"}, ("moment",), -1.0, 50.0, "N m", "lift the scraper"),
    Candidate("load beside the middle", {"id": "off_centre_load"}, ("moment",), 1e-3, 200.0, "mN", "run it empty"),
    Candidate("kink at the weld", {"id": "weld", "at": 3.0}, ("angle",), -1e-4, 20.0, "0.1 mrad", "turn the belt over"),
    Candidate("cant of the tail pulley", {"id": "cant"}, ("gamma",), -1e-3, 5.0, "mrad", "a level on the axle"),
    Candidate("cant, the other way", {"id": "cant"}, ("gamma",), 1e-3, 5.0, "mrad", "a level on the axle"),
)  # fmt: skip

LAYER, COVER = {"id": "lift_off"}, {"id": "soft_cover"}
#: Causes that turn with the sign of the yaw, as (name, unit in words, sizes, settings of ``march`` at a size).
ODD: tuple[tuple[str, str, tuple[float, ...], Callable[[float], dict[str, Any]]], ...] = (
    ("load cell shows too much", "N/mm2", (1.0, 2.0, 3.0, 4.0, 5.0, 6.0), lambda s: {"cell": s}),
    ("load cell shows too little", "N/mm2", (1.0, 2.0, 4.0, 8.0), lambda s: {"cell": -s}),
    ("load cell's gain too large", "%", (5.0, 10.0, 20.0, 30.0, 40.0), lambda s: {"gain": s / 100}),
    ("long edges (residual stress)", "N/mm2", (2.0, 4.0, 6.0, 8.0),
     lambda s: {"effects": [{"id": "flatness", "amplitude": 1e6 * s}]}),
    ("crossbow: a longer bending layer", "times", (1.0, 2.0, 4.0, 8.0, 16.0),
     lambda s: {"effects": [{**LAYER, "strength": s}]}),
    ("soft cover", "1e-6 1/(N m2)", (1.0, 3.0, 10.0, 30.0, 100.0), lambda s: {"effects": [{**COVER, "c": 1e-6 * s}]}),
    ("yaw compliance", "urad/(N m)", (1.0, 3.0, 10.0),  # at 30 the belt runs away
     lambda s: {"effects": [{"id": "yaw_compliance", "c_m": 1e-6 * s}]}),
    ("slip", "1/mu", (2.0, 5.0, 10.0, 20.0), lambda s: {"effects": [{"id": "slip", "inverse_friction": s}]}),
    ("supports take the sag", "a span", (1.0, 2.0, 4.0), lambda s: {"gravity": 9.81 / (1.0 + s)}),
)  # fmt: skip


@dataclass(frozen=True)
class Curves:
    """Point 1 at the four tensions towards where the yaw drives it: y (4, n) [m] on GRID, steady rate (4,) [m/m]."""

    y: np.ndarray
    rate: np.ndarray

    def plus(self, response: "Curves", size: float) -> "Curves":
        """The curves with an even effect of ``size`` units of its response."""
        return Curves(self.y + size * response.y, self.rate + size * response.rate)


def point_1(at: np.ndarray, **asked: Any) -> np.ndarray:
    """y of point 1 [m] of a run at some places of its travel [m]."""
    curves: Any = bs.simulate(**asked).curves
    return np.interp(at, np.asarray(curves.travel), np.asarray(curves.y)[0])


def march(
    model: str, effects: Sequence[Mapping[str, Any]] = (), cell: float = 0.0, gain: float = 0.0, gravity: float = 9.81
) -> Curves:
    """Run the four tensions. A load cell that shows ``cell`` [N/mm2] or ``gain`` too much lowers the true tension."""
    y = []
    for shown in TENSIONS:
        asked = {"tension": shown / (1.0 + gain) - cell, "effects": [*effects], "rig": {"gravity": gravity}}
        y.append(np.sign(YAW) * point_1(GRID, model=model, yaw=YAW, travel=TRAVEL, **asked))
    late = GRID >= (1.0 - LATE) * TRAVEL
    return Curves(np.array(y), np.polyfit(GRID[late], np.array(y)[:, late].T, 1)[0])


@cache
def strip(cell: float) -> Curves:
    """The hanging strip alone at a load-cell error."""
    return march("strip", cell=cell)


@cache
def beams() -> dict[str, Curves]:
    """Rope, beam of 1st and of 2nd order."""
    return {name: march(name) for name in ("rope", "beam_th1", "beam_th2")}


def starts_slowly(own: Curves) -> tuple[bool, np.ndarray]:
    """M2, with y after START m at 7 and 10 over that at 40, as a share of the beam's."""
    at, beam = round(START / STEP), beams()["beam_th2"].y
    share = (own.y[:2, at] / own.y[3, at]) / (beam[:2, at] / beam[3, at])
    return bool(share.max() <= SLOWER), share


def faster_and_realistic(rates: np.ndarray) -> np.ndarray:
    """M3 and M4 of rates (..., 4) [m/m], against the steady rate of the beam of 2nd order."""
    beam = beams()["beam_th2"].rate
    slack = (rates[..., 3:] > 0) & (rates[..., :2] >= A_LOT * rates[..., 3:])
    tight = np.abs(rates[..., 2:] / beam[2:] - 1.0) <= QUITE
    return slack.all(axis=-1) & tight.all(axis=-1)


def outside(own: Curves) -> float:
    """M6: how far the curves leave the area between rope and beam of 1st order, of the rope's largest y."""
    early = GRID <= EARLY
    rope, first = (beams()[name].y[3, early] for name in ("rope", "beam_th1"))
    y = own.y[:, early]
    return float(max((y - rope).max(), (first - y).max(), 0.0) / rope.max())


def slopes(own: Curves, window: float) -> tuple[np.ndarray, np.ndarray]:
    """Straight-line slope (4, places) [m/m] and rms deviation [m] of each stretch of ``window`` m, from 1 m on."""
    count, first = round(window / STEP) + 1, round(1.0 / STEP)
    x = STEP * (np.arange(count) - (count - 1) / 2)
    views = sliding_window_view(own.y[:, first:], count, axis=1)
    slope = views @ x / (x @ x)
    rest = views - views.mean(axis=-1, keepdims=True) - slope[..., None] * x
    return slope, np.sqrt((rest**2).mean(axis=-1))


def straightest(own: Curves, window: float, record: float) -> np.ndarray:
    """Rate (4,) of each curve's straightest rising stretch within ``record`` m; nan where none rises."""
    slope, rms = slopes(own, window)
    ends = 1.0 + window + STEP * np.arange(slope.shape[1])
    rms = np.where((slope > 0) & (ends <= record), rms, np.inf)
    best = rms.argmin(axis=1)
    rates = slope[np.arange(4), best]
    return np.where(np.isfinite(rms.min(axis=1)), rates, np.nan)


def common(own: Curves, window: float, record: float) -> float:
    """Share of the windows within ``record`` m, the same for all four curves, in which M3 and M4 hold."""
    slope, _ = slopes(own, window)
    inside = 1.0 + window + STEP * np.arange(slope.shape[1]) <= record
    return float(faster_and_realistic(slope[:, inside].T).mean()) if inside.any() else np.nan


def passing_sizes(base: Curves, response: Curves, largest: float) -> np.ndarray:
    """Sizes from null to ``largest`` at which M2 holds, and M3 and M4 at the steady rate."""
    sizes = np.linspace(0.0, largest, SIZES + 1)[1:]
    held = [starts_slowly(c := base.plus(response, s))[0] and faster_and_realistic(c.rate) for s in sizes]
    return sizes[np.array(held)]


def trimmed(candidate: Candidate, size: float) -> float:
    """Largest difference [m] to the strip alone over EARLY m, if the operator trims the yaw before the step.

    At each tension the yaw is first set so that the belt with the effect stands still, then stepped by YAW.
    """
    settle, worst = 1200.0, 0.0
    for row, tension in enumerate(TENSIONS):
        asked = {"model": "strip", "tension": tension}

        def late(yaw: Any, effects: list[dict[str, Any]], asked: dict[str, Any] = asked) -> float:
            ends = np.array([0.8 * settle, settle])
            return float(np.diff(point_1(ends, yaw=yaw, travel=settle, effects=effects, **asked))[0])

        entry, early = candidate.entry(size), GRID[GRID <= EARLY]
        trim = -YAW * late(0.0, entry) / late(YAW, [])
        step = [{"at": 0.0, "yaw": trim}, {"at": settle, "yaw": trim + YAW}]
        y = point_1(settle + early, yaw=step, travel=settle + EARLY, effects=entry, **asked)
        worst = max(worst, np.abs(np.sign(YAW) * (y - y[0]) - strip(0.0).y[row, : len(early)]).max())
    return worst


def judged(name: str, agree: str, own: Curves, check: str) -> list[str]:
    """One row of the first table: all statements of a candidate's curves."""
    # of records of 40 to 80 m and windows: do M3 and M4 hold on each curve's own straightest stretch?
    read = np.mean([faster_and_realistic(straightest(own, w, r)) for w in WINDOWS for r in RECORDS if 40 <= r <= 80])
    shared = np.mean([common(own, w, 60.0) for w in WINDOWS])
    tight = own.rate[2:] / beams()["beam_th2"].rate[2:] - 1
    return [
        name, agree, *(f"{v:.2f}" for v in starts_slowly(own)[1]), *(f"{v:.2f}" for v in own.rate[:2] / own.rate[3]),
        *(f"{100 * v:+.0f}" for v in tight), f"{100 * outside(own):.0f}", f"{100 * read:.0f}", f"{100 * shared:.0f}",
        check,
    ]  # fmt: skip


def rows() -> tuple[list[list[str]], list[list[str]]]:
    """The table of candidates, and that of pairs with a load-cell error."""
    single, pairs = [judged("strip alone", "", strip(0.0), "")], []
    for c in EVEN:
        agree = {}
        for cell in CELL_ERRORS:
            response = march("strip", c.entry(1.0), cell).plus(strip(cell), -1.0)
            sizes = passing_sizes(strip(cell), response, c.largest)
            agree[cell] = f"{sizes[0]:.3g} to {sizes[-1]:.3g} {c.words}" if len(sizes) else "none"
            if cell == 0.0:
                own = strip(0.0).plus(response, sizes[0] if len(sizes) else 0.0)
        single.append(judged(c.name, agree[0.0], own, c.check))
        pairs.append([c.name, *agree.values()])
    for name, words, steps, settings in ODD:
        cells = []
        for cell in CELL_ERRORS:
            curves = {s: march("strip", **{"cell": cell, **settings(s)}) for s in steps}
            held = [s for s, own in curves.items() if starts_slowly(own)[0] and faster_and_realistic(own.rate)]
            best = held[0] if held else max(steps, key=lambda s: curves[s].rate[1] / curves[s].rate[3])
            own, agreed = curves[best], f"{held[0]:g} to {held[-1]:g} {words}" if held else "none"
            if cell == 0.0:
                single.append(judged(f"{name}, {best:g} {words}", agreed, own, "turns with the yaw"))
            off = 100 * (own.rate[2] / beams()["beam_th2"].rate[2] - 1)
            nearest = f"none (at {best:g} {words}: {own.rate[1] / own.rate[3]:.2f}, {off:+.0f} %)"
            cells.append(agreed if held else nearest)
        if "cell" not in settings(steps[0]):
            pairs.append([name, *cells])
    return single, pairs


def record_rows() -> list[list[str]]:
    """The strip alone, read on each curve's own straightest stretch: ratio at 7, at 10, percent off at 20, at 40."""
    own, beam, lines = strip(0.0), beams()["beam_th2"].rate, []
    for record in RECORDS:
        cells = []
        for window in WINDOWS:
            r = straightest(own, window, record)
            slack, tight = r[:2] / r[3], 100 * (r[2:] / beam[2:] - 1)
            text = " ".join([*(f"{v:.2f}" for v in slack), *(f"{v:+.0f}" for v in tight)])
            cells.append(f"**{text}**" if faster_and_realistic(r) else text)
        lines.append([f"{record:g}", *cells, f"{100 * common(own, 5.0, record):.0f}"])
    return lines


def markdown(header: Iterable[str], lines: Iterable[Iterable[str]]) -> str:
    """A pipe table."""
    head = list(header)
    return "\n".join("| " + " | ".join(cells) + " |" for cells in (head, ["---"] * len(head), *lines))


DOCUMENT = """# The open question: every candidate under every reading

Written by `python -m studies.open_question document=docs/data/open_question.md picture=docs/images/reading_windows.png`
with the criteria of `studies/paper/statements.py`. M2: y after 3 m at 7 and 10 N/mm2, over that at 40, is at most
0.9 of the beam's ratio. M3: the rates at 7 and 10 are at least 1.2 times that at 40. M4: the rates at 20 and 40 are
within 20 % of those of the beam of 2nd order. M6: the curves stay between rope and beam of 1st order over 25 m.

## Single causes

Sizes at which M2, M3 and M4 hold at the steady rate. The other columns are taken at the smallest of these sizes;
without any, at null (even causes) or at the size with the largest M3 at 10 N/mm2 (odd causes). "Own stretch": share of
readings in which M3 and M4 hold where each curve is read on its own straightest stretch (4 to 10 m, records of 40 to
80 m). "Common window": share of common windows within 60 m in which they hold.

{single}

The candidates with a direct check are even: they push to the same side whatever the sign of the yaw. A pair of opposite
yaws therefore tells them from the strip and from a wrong tension, and not from one another. An operator who trims the
belt at each tension before the step cancels every one of them: a belt with a camber of 3e-5 1/m, so trimmed, stays
within {trim:.1f} um of the strip alone over 25 m.

## With a load cell that shows too much

Sizes at which M2, M3 and M4 hold at the steady rate, by the error of the load cell. Odd causes without any: M3 at
10 N/mm2 and M4 at 20 N/mm2, at the size with the largest M3 at 10 N/mm2.

{pairs}

## The strip alone, by the length of the record

Each curve read on its own straightest rising stretch: rates at 7 and at 10 over that at 40, then the rates at 20 and 40
against those of the beam [%]. Bold: M3 and M4 hold. Last column: share of common 5 m windows in which both hold.

{records}
"""


def tables() -> str:
    """All tables of the document."""
    single, pairs = rows()
    judged_by = ["M2 at 7", "at 10", "M3 at 7", "at 10", "M4 at 20 %", "at 40 %", "M6 outside %"]
    head = ["candidate", "sizes that agree", *judged_by, "own stretch %", "common window %", "direct check"]
    return DOCUMENT.format(
        single=markdown(head, single),
        pairs=markdown(["candidate", *(f"{cell:+g} N/mm2" for cell in CELL_ERRORS)], pairs),
        records=markdown(["record m", *(f"{w:g} m" for w in WINDOWS), "common window %"], record_rows()),
        trim=1e6 * trimmed(EVEN[0], 3.0),
    )


@style.picture
def draw(path: Path) -> Path:
    """Rates of the strip alone on each curve's own straightest stretch, against the length of the record."""
    lengths = np.arange(20.0, 200.1, 2.0)
    fig, axes = style.figure(9.5, 4.0, columns=2, sharey=True)
    for ax, (row, tension) in zip(axes, enumerate(TENSIONS[:2]), strict=True):
        for colour, window in zip(style.CYCLE, WINDOWS, strict=False):
            read = np.array([straightest(strip(0.0), window, r) for r in lengths])
            ax.plot(lengths, read[:, row] / read[:, 3], color=colour, label=f"straightest {window:g} m")
        ax.axhline(A_LOT, color=style.INK, lw=1.0, ls=":")
        ax.axhline(strip(0.0).rate[row] / strip(0.0).rate[3], color=style.FAINT_INK, lw=1.5)
        ax.set(title=f"Hanging strip, rate at {tension:g} over that at 40 N/mm2", xlabel="length of the record [m]")
    axes[0].set(ylabel="ratio of rates (dotted: M3, grey: steady)", ylim=(0.0, 4.5))
    axes[1].legend(loc="upper right")
    return style.save(fig, path)


def open_question(config: dict[str, Any]) -> None:
    """Print or write the tables, and draw the picture."""
    text = tables()
    if config["document"]:
        print(write_text(Path(config["document"]), text))
    else:
        Console().print(text, markup=False, soft_wrap=True)
    if config["picture"]:
        print(draw(Path(config["picture"])))


if __name__ == "__main__":
    application("open_question", open_question)
