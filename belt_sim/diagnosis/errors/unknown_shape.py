"""What an unknown effect looks like: parity, tension exponent, onset, wavelength, required contact angle."""

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.results.findings import RequiredAngle, Unknown


def describe_unknown(bench: Workbench, fit: Fit, failed: tuple[str, ...], nearest: tuple[str, str] | None) -> Unknown:
    """What the unknown beside a fit looks like.

    failed: by what it shows; nearest: the known effects that come nearest, and why they are not the answer.
    """
    samples = bench.samples
    residual = samples.y - fit.values
    sign = np.array([np.sign(r.yaw) for r in samples.runs])
    return Unknown(
        failed_tests=failed,
        parity=_parity(bench, residual, sign),
        tension_exponent=_exponent(samples, residual),
        onset=_onset(bench, residual),
        wavelength=_wavelength(samples, residual),
        required_angle=_required_angle(bench, residual, sign),
        nearest=nearest[0] if nearest else None,
        why=nearest[1] if nearest else None,
    )


def _parity(bench: Workbench, residual: np.ndarray, sign: np.ndarray) -> str:
    """Whether most of the whitened residual turns over with the sign of yaw (odd), or stays (even)."""
    if not (np.any(sign > 0) and np.any(sign < 0)):
        return "unknown: only one sign of yaw was run"
    white = bench.metric.whiten(np.where(np.isfinite(residual), residual, 0.0)).reshape(len(sign), -1)
    plus, minus = white[sign > 0].mean(axis=0), white[sign < 0].mean(axis=0)
    odd, even = float(np.sum((plus - minus) ** 2)), float(np.sum((plus + minus) ** 2))
    share = odd / max(odd + even, 1e-12)
    return "odd" if share > 0.8 else "even" if share < 0.2 else "mixed"


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
