"""Each statement of the paper as a criterion: what meets it, and that a wrong curve fails it."""

from dataclasses import replace

import numpy as np
import pytest

from studies.paper.models import MEASURED
from studies.paper.statements import (
    CONTRADICTED,
    GRID,
    REPRODUCED,
    SILENT,
    STATEMENTS,
    Behaviour,
    behaviours,
    judge_models,
)


@pytest.fixture(scope="module")
def models() -> dict[str, Behaviour]:
    return behaviours(in_space=True)


@pytest.fixture(scope="module")
def beam(models) -> Behaviour:
    return models["beam_th2"]


def scaled(model: Behaviour, factors: dict[float, float]) -> Behaviour:
    """y at some tensions times a factor."""
    return replace(model, y={t: y * factors.get(t, 1.0) for t, y in model.y.items()})


def with_rates(model: Behaviour, rates: dict[float, float]) -> Behaviour:
    return replace(model, rate={**model.rate, **rates})


def test_m1_the_beam_itself_and_a_curve_unlike_it_are_contradicted(models, beam):
    assert STATEMENTS["M1"].judge(beam, beam).verdict == CONTRADICTED
    straight = replace(beam, y={40.0: 2e-4 * GRID})
    assert STATEMENTS["M1"].judge(straight, beam).verdict == CONTRADICTED
    backwards = replace(beam, y={40.0: -beam.y[40.0]})
    assert STATEMENTS["M1"].judge(backwards, beam).verdict == CONTRADICTED
    assert STATEMENTS["M1"].judge(models["strip"], beam).verdict == SILENT


def test_m2_fails_a_belt_that_starts_as_the_beam_does_or_slower_at_10_than_at_7(models, beam):
    strip = models["strip"]
    assert STATEMENTS["M2"].judge(strip, beam).verdict == REPRODUCED
    assert STATEMENTS["M2"].judge(beam, beam).verdict == CONTRADICTED
    assert STATEMENTS["M2"].judge(scaled(strip, {7.0: 5.0}), beam).verdict == CONTRADICTED
    swapped = replace(strip, y={**strip.y, 7.0: strip.y[10.0], 10.0: strip.y[7.0]})
    assert STATEMENTS["M2"].judge(swapped, beam).verdict == CONTRADICTED


def test_m3_asks_both_slack_belts_to_be_faster(models, beam):
    rates = {7.0: 2.0e-4, 10.0: 1.9e-4, 40.0: 1.5e-4}
    assert STATEMENTS["M3"].judge(with_rates(beam, rates), beam).verdict == REPRODUCED
    assert STATEMENTS["M3"].judge(with_rates(beam, rates | {10.0: 1.7e-4}), beam).verdict == CONTRADICTED
    assert STATEMENTS["M3"].judge(models["strip"], beam).verdict == CONTRADICTED


def test_m3_read_early_looks_at_the_slope_of_the_record(models, beam):
    assert STATEMENTS["M3, read early"].judge(models["strip"], beam).verdict == REPRODUCED
    level = replace(models["strip"], y={**models["strip"].y, 10.0: np.full(len(GRID), 1e-3)})
    assert STATEMENTS["M3, read early"].judge(level, beam).verdict == CONTRADICTED


def test_m4_fails_a_rate_more_than_a_fifth_from_the_beams(beam):
    near = with_rates(beam, {20.0: 1.19 * beam.rate[20.0], 40.0: 0.81 * beam.rate[40.0]})
    assert STATEMENTS["M4"].judge(near, beam).verdict == REPRODUCED
    assert STATEMENTS["M4"].judge(with_rates(beam, {20.0: 1.21 * beam.rate[20.0]}), beam).verdict == CONTRADICTED


def test_m5_fails_a_tilt_that_nobody_would_see(models, beam):
    strip = models["strip"]
    assert STATEMENTS["M5"].judge(strip, beam).verdict == REPRODUCED
    assert STATEMENTS["M5"].judge(replace(strip, tilt={**strip.tilt, 7.0: 4e-3}), beam).verdict == CONTRADICTED


def test_m6_fails_a_curve_above_the_rope_or_below_the_first_order_beam(beam):
    assert STATEMENTS["M6"].judge(beam, beam).verdict == REPRODUCED
    assert STATEMENTS["M6"].judge(scaled(beam, {10.0: 3.0}), beam).verdict == CONTRADICTED
    assert STATEMENTS["M6"].judge(scaled(beam, {40.0: 0.5}), beam).verdict == CONTRADICTED


@pytest.mark.parametrize("name", STATEMENTS)
def test_what_a_model_does_not_say_is_not_judged(name, beam):
    assert STATEMENTS[name].judge(Behaviour(), beam).verdict == SILENT


def test_a_formula_for_the_rate_alone_is_judged_by_its_rate_and_its_edges(models, beam):
    verdicts = {name: s.judge(models["ritzinger"], beam).verdict for name, s in STATEMENTS.items()}
    assert {name for name, v in verdicts.items() if v != SILENT} == {"M3", "M4", "M5"}


def test_the_strip_and_the_belt_in_space_get_the_same_verdicts():
    """They are two routes to one belt; the stored runs are no copies of the law."""
    table = judge_models(in_space=True)
    for of in table.values():
        assert of["strip"].verdict == of["mujoco_flex"].verdict
        assert len(of) == len(MEASURED) * 2
    assert "mujoco_flex" not in judge_models(in_space=False)["M1"]
