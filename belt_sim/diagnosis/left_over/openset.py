"""The open set: is anything left that no effect of the library explains?

What the best set leaves is tested for structure (structures.py) and for waves of any length (waves.py). Every test is
one of a family, and the smallest p of all is held against that of residuals made by chance: noise (at levels that the
readings leave possible, judged at those believed in) and nuisances drawn, the chosen effects refitted.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from belt_sim.diagnosis.fits.fit import Fit
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.left_over.null import NoiseSource, NullGains
from belt_sim.diagnosis.left_over.structures import structures
from belt_sim.diagnosis.left_over.waves import EACH_ITS_PHASE, Waves, wavelengths

LEVEL = 0.01  # false alarms of all tests together; the search for laws spends half as much, the candidates twice that
#: unless readings tell that it is smooth, wander is taken for exponential; one of Matern 3/2 has up to 1.3 times the
#: variance of the exponential that fits it best at some wavelength, and looks like waves of their own phase there;
#: levels read off a few repeats add to that
SPECTRUM = 1.5
NEAR = 0.15  # of the critical log p: by so much 200 replicates may be off
MORE = 5  # times as many then
FAINT = 1e-6  # of the largest direction of a family; what is smaller is not in these readings


@dataclass(frozen=True)
class OpenSet:
    """Names of the tests that failed, worst first; log p, gain and threshold of each test made; wavelength [m] of the
    strongest wave of each family of waves.
    """

    failed: tuple[str, ...]
    log_p: dict[str, float]
    gain: dict[str, float]
    threshold: dict[str, float]
    wavelength: dict[str, float] = field(default_factory=dict)

    def and_failed(self, tests: tuple[str, ...]) -> "OpenSet":
        """The same with further tests failed."""
        return replace(self, failed=(*self.failed, *tests))


@dataclass(frozen=True)
class OpenTests:
    """All tests of what a fit leaves, with what chance gives them.

    waves: of any length; inside (k, N): directions that the fit takes; families: test -> orthonormal rows; null,
    critical: by chance.
    """

    waves: Waves
    inside: np.ndarray
    families: dict[str, np.ndarray]
    null: NullGains
    critical: float

    def look(self, residual: np.ndarray) -> OpenSet:
        """The tests of one whitened residual (N,): the most significant of each family."""
        gains, names = self._counted(residual[None])
        log_p = {n: self.null.log_p(n, float(g[0])) for n, g in gains.items()}
        worst = {n: min(tests, key=lambda t: log_p[t]) for n, tests in names.items() if tests}
        failed = [n for n, t in worst.items() if log_p[t] < self.critical]
        lengths = [float(x) for x in wavelengths(self.waves.bench)]
        return OpenSet(
            failed=tuple(sorted(failed, key=lambda n: log_p[worst[n]])),
            log_p={n: log_p[t] for n, t in worst.items()},
            gain={n: float(gains[t][0]) for n, t in worst.items()},
            threshold={n: self.null.threshold(t, self.critical) for n, t in worst.items()},
            wavelength={n: lengths[names[n].index(t)] for n, t in worst.items() if t != n},
        )

    def _counted(self, residuals: np.ndarray) -> tuple[dict[str, np.ndarray], dict[str, list[str]]]:
        """Test -> gains (B,) of whitened residuals (B, N) as they are judged; family -> its tests."""
        gains, _, names = _gains(self.waves, self.families, apart(residuals, self.inside))
        own = names.get(EACH_ITS_PHASE, ())
        return gains | {n: gains[n] / SPECTRUM for n in own}, names


def open_tests(bench: Workbench, fit: Fit, *, bootstraps: int, seed: int) -> OpenTests:
    """The tests of what ``fit`` leaves, calibrated on ``bootstraps`` replicates by chance."""
    inside = basis(fit.columns)
    families = {n: basis(apart(bench.metric.whiten(rows), inside)) for n, rows in structures(bench).items()}
    families = {n: rows for n, rows in families.items() if len(rows)}
    waves = Waves(bench)
    gains, dof, _ = _gains(
        waves, families, apart(replicas(bench, bench.samples.y - fit.values, bootstraps, seed + 77), inside)
    )
    null = NullGains(gains, dof)
    return OpenTests(waves, inside, families, null, null.critical(list(gains), LEVEL))


def open_set(bench: Workbench, fit: Fit, *, bootstraps: int, seed: int) -> OpenSet:
    """Test the residual of ``fit``; where it comes near to what chance reaches, chance is asked more often."""
    tests = open_tests(bench, fit, bootstraps=bootstraps, seed=seed)
    found = tests.look(fit.residual)
    if abs(min(found.log_p.values(), default=0.0) / tests.critical - 1.0) > NEAR:
        return found
    return open_tests(bench, fit, bootstraps=MORE * bootstraps, seed=seed + 1).look(fit.residual)


def _gains(scan: Waves, families: dict[str, np.ndarray], rows: np.ndarray):
    """Test -> gains (B,) of whitened rows (B, N) and degrees of freedom; family -> its tests."""
    every = np.concatenate([*families.values(), rows[:0]]).astype(rows.dtype)
    ends = np.cumsum([len(own) for own in families.values()])[:-1]
    parts = np.split(rows @ every.T, ends, axis=1) if families else []
    gains = {n: np.einsum("bk,bk->b", part, part) for n, part in zip(families, parts, strict=True)}
    dof = {n: len(own) for n, own in families.items()}
    names = {n: [n] for n in gains}
    waves, wave_dof = scan.gains(rows)
    for n, along in waves.items():
        names[n] = [f"{n} {k}" for k in range(along.shape[1])]
        gains |= dict(zip(names[n], along.T, strict=True))
        dof |= dict.fromkeys(names[n], wave_dof[n])
    return gains, dof, names


def replicas(bench: Workbench, left: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Whitened residuals (count, N) by chance alone; left (R, S, n): what the model leaves of the readings."""
    errors = NoiseSource(bench, left, np.random.default_rng(seed)).draw(count)
    errors[:, ~np.isfinite(bench.fitted.y)] = 0.0
    return bench.metric.whiten(errors)


def basis(rows: np.ndarray) -> np.ndarray:
    """Orthonormal rows that span ``rows`` (k, N), by the small Gram matrix."""
    if not len(rows):
        return rows.reshape(0, rows.shape[-1])
    rows = rows.reshape(len(rows), -1)
    size = np.linalg.norm(rows, axis=1, keepdims=True)
    rows = rows[size[:, 0] > FAINT] / size[size[:, 0] > FAINT]
    if not len(rows):
        return rows
    values, vectors = np.linalg.eigh(rows @ rows.T)
    keep = values > FAINT * values[-1]
    return (vectors[:, keep] / np.sqrt(values[keep])).T @ rows


def apart(rows: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Rows (k, N) without what lies along orthonormal ``inside``."""
    inside = inside.astype(rows.dtype)
    return rows - (rows @ inside.T) @ inside if len(inside) else rows
