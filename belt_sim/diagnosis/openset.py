"""The open set: is anything left that no effect of the library explains?

After the best set, what remains is tested for smooth structure (travel x parity x tension), for orders (2 pi R,
belt length) and for a single run that stands out; thresholds come from the bootstrap of null.py.
"""

from dataclasses import dataclass

import numpy as np

from belt_sim.diagnosis.fit import Fit
from belt_sim.diagnosis.null import null_gains
from belt_sim.diagnosis.workbench import Workbench
from belt_sim.results.found import RequiredAngle, Unknown

LEVEL = 0.015  # the candidates spend the rest of the 5 % of false alarms
DEGREES = 5


@dataclass(frozen=True)
class OpenSet:
    """Names of the tests that failed, and log p and gain of each test made."""

    failed: tuple[str, ...]
    log_p: dict[str, float]
    gain: dict[str, float]
    threshold: dict[str, float]


def open_set(bench: Workbench, fit: Fit, *, bootstraps: int, seed: int) -> OpenSet:
    """Test the residual of ``fit``."""
    shapes = structures(bench)
    null = null_gains(bench, shapes, fit.slopes, fit.values, count=bootstraps, seed=seed + 77)
    critical = null.critical(list(shapes), LEVEL)
    gains = {n: _gain(bench, fit, rows) for n, rows in shapes.items()}
    log_p = {n: null.log_p(n, g) for n, g in gains.items()}
    failed = tuple(n for n in shapes if log_p[n] < critical)
    return OpenSet(failed, log_p, gains, {n: null.threshold(n, critical) for n in shapes})


def structures(bench: Workbench) -> dict[str, np.ndarray]:
    """Named families of shapes (k, R, S, n) that a residual without anything missing has no reason to follow."""
    samples = bench.samples
    sign = np.array([np.sign(r.yaw) for r in samples.runs])
    stress = np.array([r.tension for r in samples.runs])
    slack = (stress / stress.min()) ** -2.0
    weights = {"odd": sign, "even": np.ones(len(sign))}
    smooth = _smooth(samples.travel / samples.end)
    found = {}
    for parity, weight in weights.items():
        if not np.any(weight):
            continue
        rows = [_rows(samples.y.shape, smooth * (weight * f)[:, None]) for f in (np.ones_like(slack), slack)]
        found[f"smooth, {parity} in yaw"] = np.concatenate(rows)
    found |= {f"order {n}": rows for n, rows in _orders(bench, weights).items()}
    for r, run in enumerate(samples.runs):
        only = np.zeros(len(samples.runs))
        only[r] = 1.0
        found[f"run {run.name}"] = _rows(samples.y.shape, smooth * only[:, None])
    scale = np.array([max(s.white, s.wander_sd, 1e-9) for s in samples.signals])
    return {n: rows * scale[None, None, :, None] for n, rows in found.items()}


def _smooth(x: np.ndarray) -> np.ndarray:
    """Legendre shapes of degrees 1..DEGREES on a run, (DEGREES, R, n); a constant is a zero error, not structure."""
    return np.stack([np.polynomial.legendre.Legendre.basis(d)(2 * x - 1) for d in range(1, DEGREES + 1)])


def _rows(shape: tuple[int, ...], curves: np.ndarray) -> np.ndarray:
    """Curves (k, R, n) placed in every signal on its own: (k * S, R, S, n)."""
    runs, signals, n = shape
    rows = np.zeros((len(curves), signals, runs, signals, n))
    for s in range(signals):
        rows[:, s, :, s] = curves
    return rows.reshape(-1, runs, signals, n)


def _orders(bench: Workbench, weights) -> dict[str, np.ndarray]:
    samples, rig = bench.samples, bench.samples.cases.rig
    periods = {"pulley turn": 2 * np.pi * float(rig.tail_radius), "belt revolution": float(rig.belt_length)}
    found = {}
    for name, period in periods.items():
        spacing = np.median(np.diff(samples.travel[0]))
        if samples.end < 2 * period or period < 2.5 * spacing:
            continue
        phase = 2 * np.pi * samples.travel / period
        waves = np.stack([np.cos(phase), np.sin(phase)])
        rows = [_rows(samples.y.shape, waves * w[:, None]) for w in weights.values() if np.any(w)]
        found[name] = np.concatenate(rows)
    return found


def _gain(bench: Workbench, fit: Fit, rows: np.ndarray) -> float:
    """How much of the residual's chi2 lies in ``rows``, beside what the fitted effects could take."""
    white = bench.metric.whiten(rows)
    if len(fit.free):
        inside = np.linalg.qr(fit.columns.T)[0]
        white = white - (white @ inside) @ inside.T
    basis, strength, _ = np.linalg.svd(white.T, full_matrices=False)
    basis = basis[:, strength > 1e-6 * strength[0]]
    return float(np.sum((basis.T @ fit.residual) ** 2))


def shape_card(bench: Workbench, fit: Fit, test: OpenSet, nearest: tuple[str, str] | None) -> Unknown:
    """What an unknown effect looks like: parity, tension exponent, onset, wavelength, required contact angle."""
    samples = bench.samples
    residual = samples.y - fit.values
    sign = np.array([np.sign(r.yaw) for r in samples.runs])
    odd = test.gain.get("smooth, odd in yaw", 0.0)
    even = test.gain.get("smooth, even in yaw", 0.0)
    share = odd / max(odd + even, 1e-12)
    parity = "odd" if share > 0.8 else "even" if share < 0.2 else "mixed"
    return Unknown(
        failed_tests=test.failed,
        parity=parity if np.any(sign > 0) and np.any(sign < 0) else "unknown: only one sign of yaw was run",
        tension_exponent=_exponent(samples, residual),
        onset=_onset(bench, residual),
        wavelength=_wavelength(samples, residual),
        required_angle=_required_angle(bench, residual, sign),
        nearest=nearest[0] if nearest else None,
        why=nearest[1] if nearest else None,
    )


def _exponent(samples, residual) -> float | None:
    """n of |residual| ~ tension^n, by least squares over tensions."""
    stress = np.array([r.tension for r in samples.runs])
    levels = np.unique(stress)
    if len(levels) < 2:
        return None
    size = [np.sqrt(np.nanmean(residual[stress == t][:, 0] ** 2)) for t in levels]
    return float(np.polyfit(np.log(levels), np.log(np.maximum(size, 1e-12)), 1)[0])


def _onset(bench: Workbench, residual) -> float | None:
    """First travel at which the worst run leaves its own zero by three sigma, smoothed over a metre [m]."""
    samples = bench.samples
    blocks = np.nansum(residual[:, 0] ** 2, axis=1)
    r = int(np.argmax(blocks))
    signal = samples.signals[0]
    travel, error = samples.travel[r], np.nan_to_num(residual[r, 0])
    width = max(1, int(1.0 / max(np.median(np.diff(travel)), 1e-6)))
    smooth = np.convolve(error - error[:width].mean(), np.ones(width) / width, mode="same")
    limit = 3 * np.hypot(signal.white / np.sqrt(width), signal.wander_sd)
    beyond = np.flatnonzero(np.abs(smooth) > limit)
    return float(travel[beyond[0]]) if len(beyond) else None


def _wavelength(samples, residual) -> float | None:
    """Wavelength of the strongest line in the residual of signal 1 [m]; None when there is no line."""
    n = samples.y.shape[-1]
    power = np.zeros(n // 2 + 1)
    spacing = float(np.median(np.diff(samples.travel[0])))
    trend = np.linspace(-1, 1, n)
    for r in range(len(samples.runs)):
        error = np.nan_to_num(residual[r, 0])
        error = error - np.polyval(np.polyfit(trend, error, 3), trend)
        power = power + np.abs(np.fft.rfft(error * np.hanning(n))) ** 2
    frequency = np.fft.rfftfreq(n, spacing)
    usable = frequency > 2.5 / (n * spacing)
    if not usable.any():
        return None
    k = int(np.argmax(np.where(usable, power, 0.0)))
    if power[k] < 12 * np.median(power[usable]):
        return None
    return float(1.0 / frequency[k])


def _required_angle(bench: Workbench, residual, sign) -> RequiredAngle | None:
    """To first order, the contact angle that the run-up law would need: d(residual)/ds + residual/L."""
    samples = bench.samples
    places = [s.at for s in samples.signals]
    if "point_1" not in places:
        return None
    row = residual[:, places.index("point_1")]
    weight = sign if np.any(sign) else np.ones(len(sign))
    mean = np.nanmean(row * weight[:, None], axis=0)
    travel = samples.travel[0]
    knots = np.linspace(0.0, travel[-1], 13)
    keep = np.isfinite(mean)
    smooth = np.polynomial.Chebyshev.fit(travel[keep], mean[keep], 8)
    length = float(samples.cases.rig.span_length)
    angle = smooth.deriv()(knots) + smooth(knots) / length
    return RequiredAngle(travel=knots, angle=angle)
