"""Thresholds keep their promise: where nothing is missing, chance beats them as often as stated."""

import numpy as np
from noise_by_recursion import errors
from small_campaign import repeated_bench

from belt_sim.diagnosis.choice.select import FAMILY_LEVEL
from belt_sim.diagnosis.fits.alternatives import Alternatives
from belt_sim.diagnosis.fits.around import around
from belt_sim.diagnosis.fits.workbench import Workbench
from belt_sim.diagnosis.left_over.null import null_gains

IDS = ("taper", "yaw_offset_tail", "cant", "sensor_gain", "wobble")
BOOTSTRAPS, DRAWS = 600, 300
#: counts of rare events scatter by their root; the threshold's own scatter comes on top
LEAST, MOST = 0.003, 0.085


def gains(bench: Workbench, shapes: dict, drawn: np.ndarray) -> dict[str, np.ndarray]:
    """chi2 gain of every candidate for every draw by least squares, noise levels found anew each time."""
    base = bench.forward.values(bench.forward.null()[None])[0]
    metrics, found = {}, {i: np.empty(len(drawn)) for i in shapes}
    for k, e in enumerate(drawn):
        levels = bench.finder(base + e)
        if levels not in metrics:
            metrics[levels] = bench.metric_at(levels)
        metric = metrics[levels]
        residual = metric.whiten(e)
        for i, rows in shapes.items():
            columns = metric.whiten(rows.columns if isinstance(rows, Alternatives) else rows)
            choices = rows.choices if isinstance(rows, Alternatives) else [np.arange(len(rows))]
            found[i][k] = max(_taken(columns[c], residual) for c in choices)
    return found


def _taken(columns: np.ndarray, residual: np.ndarray) -> float:
    step = np.linalg.lstsq(columns.T, residual, rcond=1e-6)[0]
    return float(residual @ residual - np.sum((residual - step @ columns) ** 2))


def test_the_best_of_all_candidates_beats_its_threshold_as_often_as_stated():
    bench = repeated_bench()
    base = bench.fit([bench.start((), bench.forward.null())])[0]
    near = around(bench, base, IDS)
    shapes = {i: near.shapes(bench, i) for i in IDS}
    null = null_gains(bench, shapes, base.slopes, base.values, count=BOOTSTRAPS, seed=1)
    critical = null.critical(IDS, FAMILY_LEVEL)
    seen = gains(bench, shapes, errors(bench, DRAWS, np.random.default_rng(9), levels=bench.levels))
    alarms = np.any([seen[i] > null.threshold(i, critical) for i in IDS], axis=0)
    assert LEAST < np.mean(alarms) < MOST
    for i in IDS:  # gains of both routes come from one law
        spread = np.std(null.gains[i]) * np.sqrt(1 / BOOTSTRAPS + 1 / DRAWS)
        linear = np.mean(null.gains[i]) - bench.forward.modifiers(i)  # one without a grid counts as one
        assert abs(np.mean(seen[i]) - linear) < 4 * spread


def test_more_candidates_ask_for_more_gain():
    bench = repeated_bench()
    base = bench.fit([bench.start((), bench.forward.null())])[0]
    near = around(bench, base, IDS)
    shapes = {i: near.shapes(bench, i) for i in IDS}
    null = null_gains(bench, shapes, base.slopes, base.values, count=300, seed=1)
    alone = null.threshold("taper", null.critical(["taper"], FAMILY_LEVEL))
    among = null.threshold("taper", null.critical(IDS, FAMILY_LEVEL))
    assert among > alone > 0
    assert null.dof["taper"] == 2


def test_an_effect_that_no_reading_can_show_is_never_taken():
    bench = repeated_bench()
    base = bench.fit([bench.start((), bench.forward.null())])[0]
    nothing = {"ghost": np.zeros((1, *bench.samples.y.shape))}
    null = null_gains(bench, nothing, base.slopes, base.values, count=50, seed=1)
    assert null.threshold("ghost", null.critical(["ghost"], FAMILY_LEVEL)) == np.inf
