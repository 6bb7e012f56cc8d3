"""The error of a model against a campaign, run by run and over all, beside what the uncertainties alone make it."""

import numpy as np

from belt_sim import si
from belt_sim.curves import LATE_SHARE
from belt_sim.diagnosis.errors.where import validation_uncertainty
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.results.errors import Change, Errors, Features, RunError

FIRST = 0.1 * si.MM  # and 0.1 mrad of a tilt
LEAST = 5  # samples


def features(travel: np.ndarray, y: np.ndarray) -> Features:
    """Features of one record [m or rad] against travel [m], both (n,).

    Overshoot is the largest distance beyond the line that the late record lies on, in the direction of motion.
    """
    keep = np.isfinite(y)
    travel, y = travel[keep], y[keep]
    if len(y) < LEAST:
        return Features()
    late = travel >= travel[-1] - LATE_SHARE * (travel[-1] - travel[0])
    slope, start = np.polyfit(travel[late], y[late], 1)
    beyond = (y - (start + slope * travel)) * np.sign(y[-1] if y[-1] != 0 else 1.0)
    moved = np.flatnonzero(np.abs(y) >= FIRST)
    return Features(
        late_rate=float(slope),
        first_move=float(travel[moved[0]]) if len(moved) else None,
        overshoot=float(max(beyond.max(), 0.0)),
    )


WORSE = 1.5  # a run counts as worse only beyond this many times its floor


def run_errors(bench: Workbench, before: np.ndarray, after: np.ndarray) -> tuple[RunError, ...]:
    """Every run and signal that was measured; before and after (R, S, n) are predictions."""
    floor = validation_uncertainty(bench)
    rows = []
    for r, run in enumerate(bench.samples.runs):
        for s, signal in enumerate(bench.samples.signals):
            y, travel = bench.samples.y[r, s], bench.samples.travel[r]
            if not np.isfinite(y).any():
                continue
            first, then = (_rms(y - values[r, s]) for values in (before, after))
            least = _rms(np.where(np.isfinite(y), floor[r, s], np.nan))
            rows.append(
                RunError(
                    run=run.name,
                    signal=signal.name,
                    kind=signal.kind,
                    tension=run.tension,
                    yaw=run.yaw,
                    use=run.use,
                    before=first,
                    after=then,
                    floor=least,
                    worse=bool(then > first and then > WORSE * least),
                    measured=features(travel, y),
                    modelled=features(travel, after[r, s]),
                )
            )
    return tuple(rows)


def overall_errors(bench: Workbench, before: np.ndarray, after: np.ndarray) -> Errors | None:
    """rms of the lateral signals before and after, over fitted and hold-out runs, and the noise floor.

    None when there is no lateral signal.
    """
    lateral = np.array([s.kind == "lateral" for s in bench.samples.signals])
    if not np.isfinite(bench.samples.y[:, lateral]).any():
        return None
    fitted = np.array([r.use == "fit" for r in bench.samples.runs])
    floor = validation_uncertainty(bench)[:, lateral][np.isfinite(bench.samples.y[:, lateral])]
    rows = {}
    for name, mask in (("fit", fitted), ("held_out", ~fitted)):
        if mask.any():
            y = bench.samples.y[mask][:, lateral]
            first, then = (_rms(y - values[mask][:, lateral]) for values in (before, after))
            rows[name] = Change(before=first, after=then)
    noise = float(np.sqrt(np.mean(floor**2)))
    return Errors(noise_floor=noise, fit=rows.get("fit"), held_out=rows.get("held_out"))


def _rms(x: np.ndarray) -> float:
    return float(np.sqrt(np.nanmean(x**2)))
