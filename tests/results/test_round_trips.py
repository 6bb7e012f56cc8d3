"""diagnosis.json of any result follows its schema, is read back as it was, and is written the same again."""

import json
import lzma
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from shipped_schema import check

from belt_sim.errors import InputError
from belt_sim.results.diagnosis import (
    STAMP,
    Candidate,
    Confusable,
    Estimate,
    Explanation,
    FoundEffect,
    NextRun,
    NoiseLevels,
    RunSettings,
    Unknown,
    Verdict,
)
from belt_sim.results.errors import Change, Drawings, Errors, OwnChange, RunError, Where, Worst
from belt_sim.results.files import diagnosis_of, file_json

STORED = Path(__file__).parent / "stored"  # a diagnosis with a discovery, as it was once written
UNITS = 1e-9  # relative: to mm or degrees, written with 12 digits, and back

NAMES = st.text(alphabet="abcdefghijk_123", min_size=1, max_size=10)
WORDS = st.text(max_size=30)
NUMBERS = st.floats(-1e6, 1e6)
POSITIVE = st.floats(1e-9, 1e6)
SHARES = st.floats(0.0, 1.0)
ESTIMATES = st.builds(
    Estimate,
    value=NUMBERS,
    u=POSITIVE,
    unit=st.sampled_from(["m", "rad", "1"]),
    plausible=st.booleans(),
    interval_95=st.just(()) | st.tuples(NUMBERS, NUMBERS),
)
PARAMETERS = st.dictionaries(NAMES, ESTIMATES, min_size=1, max_size=3)
EFFECTS = st.builds(
    FoundEffect,
    id=NAMES,
    numbers=st.dictionaries(NAMES, NUMBERS, max_size=3),
    parameters=PARAMETERS,
    probability=SHARES,
    confusable_with=st.lists(st.lists(NAMES, min_size=1, max_size=2).map(tuple), max_size=3, unique=True).map(tuple),
    stamp=st.sampled_from(["", STAMP]),
    source_file=st.none() | st.just("mine.py"),
    law=st.none() | st.just({"id": "generic_law", "tension": 1e7, "terms": [{"place": "yaw_tail", "size": 1e-4}]}),
    alone=st.dictionaries(NAMES, ESTIMATES, max_size=2),
)
CANDIDATES = st.builds(
    Candidate,
    id=NAMES,
    gain=NUMBERS,
    threshold=st.none() | POSITIVE,
    held_out_rms=POSITIVE,
    parameters=PARAMETERS,
    plausible=st.booleans(),
    probability=SHARES,
    note=WORDS,
)
CHANGES = st.builds(Change, before=POSITIVE, after=POSITIVE)
ERRORS = st.builds(
    Errors,
    noise_floor=POSITIVE,
    fit=CHANGES,
    held_out=CHANGES,
    by_condition=st.dictionaries(NAMES, CHANGES, max_size=3),
    untestable=st.lists(NAMES, max_size=2).map(tuple),
    own=st.none() | st.builds(OwnChange, before=POSITIVE, after=POSITIVE, floor=POSITIVE),
)
RUNS = st.builds(
    RunError,
    run=NAMES,
    signal=NAMES,
    kind=st.sampled_from(["lateral", "tilt"]),
    tension=st.floats(1e5, 1e8),
    yaw=st.floats(-0.03, 0.03),
    use=st.sampled_from(["fit", "hold_out"]),
    before=POSITIVE,
    after=POSITIVE,
    floor=POSITIVE,
    worse=st.booleans(),
    measured_rate=st.none() | NUMBERS,
    modelled_rate=st.none() | NUMBERS,
)
UNKNOWNS = st.builds(
    Unknown,
    parity=st.sampled_from(["odd", "even"]),
    tension_exponent=st.none() | NUMBERS,
    onset=st.none() | POSITIVE,
    wavelength=st.none() | POSITIVE,
    nearest=st.none() | NAMES,
    why=st.none() | WORDS,
)
SET = st.builds(
    RunSettings,
    tension=POSITIVE,
    yaw=NUMBERS,
    speed=POSITIVE,
    direction=st.sampled_from([1.0, -1.0]),
    travel=POSITIVE,
    all_points=st.booleans(),
    turned_over=st.booleans(),
)
PARTS = {
    "verdict": st.sampled_from(list(Verdict)),
    "sentence": WORDS,
    "effects": st.lists(EFFECTS, max_size=2).map(tuple),
    "ranking": st.lists(CANDIDATES, max_size=3).map(tuple),
    "considered": st.lists(
        st.builds(
            Explanation,
            effects=st.lists(NAMES, max_size=3).map(tuple),
            unknown=st.booleans(),
            instead=WORDS,
            gain=NUMBERS,
            likelihood=NUMBERS,
            parameters=st.integers(0, 9),
            occam=NUMBERS,
            prior=NUMBERS,
            unknown_evidence=NUMBERS,
            held_out_rise=NUMBERS,
            implausible=st.booleans(),
            refused=WORDS,
            probability=SHARES,
        ),
        max_size=2,
    ).map(tuple),
    "error": ERRORS,
    "where": st.builds(
        Where,
        worst=st.builds(Worst, run=NAMES, signal=NAMES, travel=st.tuples(POSITIVE, POSITIVE), ratio=POSITIVE),
        sentence=WORDS,
        boundary=st.none() | st.floats(1e5, 1e8),
        boundary_sentence=WORDS,
    ),
    "confusables": st.lists(st.builds(Confusable, effect=NAMES, other=NAMES, sigma=POSITIVE), max_size=3).map(tuple),
    "next_runs": st.lists(st.builds(NextRun, WORDS, st.tuples(NAMES, NAMES), POSITIVE, POSITIVE), max_size=2).map(
        tuple
    ),
    "unknown": st.none() | UNKNOWNS,
    "noise": st.builds(NoiseLevels, white_factor=POSITIVE, wander_factor=POSITIVE, repeats=st.integers(0, 9)),
    "per_run": st.lists(RUNS, max_size=3).map(tuple),
    "beyond": st.lists(WORDS, max_size=2).map(tuple),
    "admitted": st.lists(WORDS, max_size=2).map(tuple),
}


def stored(name: str):
    return json.loads(lzma.decompress((STORED / f"{name}.json.xz").read_bytes()))


CONTENT, DRAWN = stored("diagnosis"), stored("drawings")
BASE = diagnosis_of(CONTENT, DRAWN, "stored")
SMALL = replace(BASE, ranking=(), per_run=(), discovery=None, drawings=Drawings())


def same(a, b) -> bool:
    """Whether two results hold the same, numbers to a change of units and back."""
    if isinstance(a, float | np.ndarray) and b is not None:
        return np.allclose(np.asarray(a, float), np.asarray(b, float), rtol=UNITS, atol=0.0, equal_nan=True)
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, dict):
        return set(a) == set(b) and all(same(v, b[k]) for k, v in a.items())
    if hasattr(a, "__dataclass_fields__"):
        return type(a) is type(b) and same(vars(a), vars(b))
    return type(a) is type(b) and a == b


def test_a_stored_file_is_written_again_as_it_was():
    """Its rows of runs have two more features each, which are not written any more."""
    rows = [
        row | {name: {"late_rate_mm_per_m": row[name]["late_rate_mm_per_m"]} for name in ("measured", "modelled")}
        for row in CONTENT["per_run"]
    ]
    assert same(file_json(BASE), CONTENT | {"per_run": rows})
    assert same(file_json(BASE.drawings), DRAWN)


@pytest.mark.parametrize("key", ["schema", "runs_schema", "verdict", "considered"])
def test_a_file_of_another_version_is_one_line(key):
    with pytest.raises(InputError, match="run belt-sim diagnose again") as error:
        diagnosis_of(CONTENT | {key: "belt-diagnosis/0"}, DRAWN, "here")
    assert "\n" not in str(error.value)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(parts=st.fixed_dictionaries({}, optional=PARTS))
def test_any_result_follows_the_schema_and_is_read_back(parts):
    result = replace(SMALL, **parts)
    content = file_json(result)
    check(content)
    back = diagnosis_of(json.loads(json.dumps(content, allow_nan=False)), file_json(SMALL.drawings), "here")
    for name in PARTS:
        assert same(getattr(result, name), getattr(back, name)), name
    assert same(file_json(back), content)


def test_a_discovery_without_a_law_says_its_sentence_first():
    assert BASE.discovery is not None
    assert BASE.discovery.law is None
    assert BASE.discovery.lines()[0] == BASE.discovery.sentence
