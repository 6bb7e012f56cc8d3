"""Where the runs begin: y = 0 is where a point was when the yaw was applied, up to the stated error ``zero``.

The first readings after the yaw are extended back to it by a straight line; a belt has not moved there yet.
"""

from collections import defaultdict

import numpy as np

from belt_sim.campaign.nouns import Campaign
from belt_sim.campaign.record import Record
from belt_sim.campaign.suspect import Suspicion
from belt_sim.si import MM

#: The line: over this share of a span, but over at least so many readings.
SHARE, FEWEST = 0.08, 6
#: What a belt's bent path may add to the beginning of that line, as a share of yaw times its length.
BENT = 0.2
#: One run that stands this many sigmas off is shifted; all runs by this rms say that ``zero`` is stated too small, or,
#: where none is stated, that it was forgotten.
SHIFTED, UNSTATED, FORGOTTEN = 12.0, 5.0, 1.8
FEWEST_RUNS = 4


def shifted_runs(campaign: Campaign, records: list[Record], *, bent: float = BENT) -> list[Suspicion]:
    """Single runs that are shifted, and signals whose runs begin further from zero than the sheet allows.

    bent: 0 where the readings are what a model leaves, which has a path of its own no more.
    """
    of_signal: dict[str, dict[str, tuple[float, float]]] = defaultdict(dict)
    for record in records:
        reach = SHARE * campaign.machine.centre_distance.value
        start = _start(record, reach, bent) if record.sheet.kind == "lateral" else None
        if start is not None:
            of_signal[record.sheet.name][record.run.name] = start
    found = []
    for signal, starts in of_signal.items():
        score = {run: abs(y) / sigma for run, (y, sigma) in starts.items()}
        typical = float(np.median(list(score.values())))
        off = [run for run in score if score[run] > SHIFTED * max(typical, 1.0)]
        for run in off:
            sentence = f"begins at {starts[run][0] / MM:.3g} mm, where y = 0 should be: this run is shifted"
            sentence += "; take its readings from where the point was when the yaw was applied"
            found.append(Suspicion(run=run, signal=signal, kind="shifted", sentence=sentence))
        rest = [run for run in score if run not in off]
        forgotten = bent == 0.0 and all(r.sheet.zero == 0.0 for r in records if r.sheet.name == signal)
        limit = FORGOTTEN if forgotten else UNSTATED
        if len(rest) >= FEWEST_RUNS and np.sqrt(np.mean([min(score[r], 20.0) ** 2 for r in rest])) > limit:
            found.append(_unstated(signal, [starts[r][0] for r in rest], records))
    return found


def _unstated(signal: str, starts: list[float], records: list[Record]) -> Suspicion:
    zero = next(r.sheet.zero for r in records if r.sheet.name == signal)
    size = float(np.sqrt(np.mean(np.square(starts))))
    stated = f"states zero: {zero / MM:g} mm" if zero > 0.0 else "states no zero"
    sentence = f"its runs begin {size / MM:.2g} mm (rms) off y = 0, while the sheet {stated}: "
    sentence += f"write zero: {size / MM:.2g} for it in campaign.yaml"
    return Suspicion(run=None, signal=signal, kind="zero", sentence=sentence)


def _start(record: Record, reach: float, bent: float) -> tuple[float, float] | None:
    """Reading at the yaw [m] and its sigma [m], from a line over ``reach`` [m]; None where no record begins there."""
    after = record.travel >= 0.0
    s, y = record.travel[after], record.readings[after]
    if len(s) < 4 * FEWEST or s[0] > max(reach, s[1] - s[0]):
        return None
    count = max(FEWEST, int(np.searchsorted(s, reach)))
    line = np.polynomial.Polynomial.fit(s[:count], y[:count], 1)
    sheet, path = record.sheet, bent * abs(record.run.yaw) * float(s[count - 1])
    white = max(sheet.white, record.measured_noise)
    return float(line(0.0)), float(np.sqrt(4.0 * white**2 / count + sheet.wander_sd**2 + sheet.zero**2)) + path
