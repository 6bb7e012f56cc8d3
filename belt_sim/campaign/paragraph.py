"""A campaign in one paragraph: what was run, what was measured, and how far."""

from collections import Counter
from collections.abc import Iterable

import numpy as np

from belt_sim import si
from belt_sim.campaign.nouns import Campaign, Run


def paragraph(c: Campaign) -> str:
    """Runs, repeats and hold-outs, tensions, yaws, signals, travel, steady rates, origin."""
    repeats, held = sum(r.repeat_of is not None for r in c.runs), sum(r.use != "fit" for r in c.runs)
    more = ", ".join(f"{n} {what}" for n, what in ((repeats, "repeats"), (held, "held out")) if n)
    said = [
        f"{c.title}: {len(c.runs)} runs{f' ({more})' if more else ''}"
        f" at {_numbers(r.tension / si.N_PER_MM2 for r in c.runs)} N/mm2, {_yaws(c.runs)}"
    ]
    records = [r for r in c.runs if len(r.travel)]
    if records:
        signals = ", ".join(f"{s.name} ({s.at.replace('_', ' ')}, {s.unit})" for s in c.signals)
        samples = sum(len(r.travel) for r in records)
        said.append(f"signals {signals} over {_span(records)} m of travel, {samples} samples")
    if c.steady:
        said.append(f"steady rates of {len(c.steady)} runs")
    return "; ".join([*said, c.source.kind]) + "."


def _numbers(values: Iterable[float]) -> str:
    """Different values in order: 7, 10 and 40; from seven on, 7 to 40."""
    found = [f"{v:.4g}" for v in sorted({float(f"{v:.6g}") for v in values})]
    if len(found) > 6:
        return f"{found[0]} to {found[-1]}"
    return found[0] if len(found) == 1 else f"{', '.join(found[:-1])} and {found[-1]}"


def _yaws(runs: Iterable[Run]) -> str:
    """How many runs at which sign of yaw, and the angles."""
    yaws = np.array([r.yaw for r in runs]) / si.DEGREE
    signs = Counter(int(s) for s in np.sign(yaws))
    counted = ", ".join(f"{signs[s]} at yaw {name}" for s, name in ((1, "> 0"), (-1, "< 0"), (0, "= 0")) if signs[s])
    return f"{counted} (|yaw| {_numbers(abs(yaws))} deg)"


def _span(runs: Iterable[Run]) -> str:
    ends = [r.travel[-1] for r in runs]
    return f"{min(ends):.4g}" if np.ptp(ends) < 0.5 else f"{min(ends):.4g} to {max(ends):.4g}"
