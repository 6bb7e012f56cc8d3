"""diagnosis.json: every key and type that other programs read, and nothing that is no JSON."""

import json

import pytest
from small_campaign import described

from belt_sim.campaign import Suspicion
from belt_sim.diagnosis.openset import OpenSet
from belt_sim.diagnosis.verdict import sentence, verdict

NUMBER = (int, float)
NAMES = ("nothing", "sag_roll", "two", "stranger")
#: key -> type, a nested schema, or [schema of every entry]
SCHEMA = {
    "schema": str,
    "base_model": str,
    "verdict": str,
    "effects": [{"id": str, "parameters": dict, "probability": NUMBER, "confusable_with": list}],
    "ranking": [{"id": str, "gain": NUMBER, "threshold": (*NUMBER, type(None)), "held_out_rms_mm": NUMBER}],
    "error": {
        "fit": {"before_mm": NUMBER, "after_mm": NUMBER},
        "held_out": {"before_mm": NUMBER, "after_mm": NUMBER},
        "noise_floor_mm": NUMBER,
    },
    "where": {"worst": {"run": str, "signal": str, "travel_m": list}, "sentence": str},
    "next_runs": [{"action": str, "separates": list, "sigma_before": NUMBER, "sigma_after": NUMBER}],
    "unknown": (dict, type(None)),
}


def check(value, schema, place="diagnosis") -> None:
    """Assert that a value has the keys and types of a schema; further keys are welcome."""
    if isinstance(schema, dict):
        for key, inner in schema.items():
            assert key in value, f"{place} lacks {key}"
            check(value[key], inner, f"{place}.{key}")
    elif isinstance(schema, list):
        assert isinstance(value, list), place
        for k, entry in enumerate(value):
            check(entry, schema[0], f"{place}[{k}]")
    else:
        assert isinstance(value, schema), f"{place} = {value!r}"
        assert not isinstance(value, bool), f"{place} = {value!r}"


@pytest.mark.parametrize("name", NAMES)
def test_the_file_follows_the_schema(name):
    content = described(name)
    check(content, SCHEMA)
    assert content["schema"] == "belt-diagnosis/1"
    assert content["verdict"] in ("adequate", "explained", "partly", "none_known", "cannot_say")
    for e in content["effects"]:
        assert e["parameters"]
        for number in e["parameters"].values():
            check(number, {"value": NUMBER, "u": NUMBER, "unit": str})
            assert number["u"] > 0
            assert number["interval_95"][0] < number["value"] < number["interval_95"][1]
        assert 0 <= e["probability"] <= 1
    low, high = content["where"]["worst"]["travel_m"]
    assert 0 <= low < high


@pytest.mark.parametrize("name", NAMES)
def test_it_is_json_without_nan(name):
    content = described(name)
    assert json.loads(json.dumps(content, allow_nan=False)) == content


def test_the_ranking_lists_every_candidate_best_first():
    content = described("sag_roll")
    beyond = [r["gain"] - r["threshold"] for r in content["ranking"] if r["threshold"] is not None]
    assert beyond == sorted(beyond, reverse=True)
    assert content["ranking"][0]["id"] == "sag_roll"
    assert len(content["ranking"]) == len({r["id"] for r in content["ranking"]})


def test_it_tells_what_it_came_from():
    content = described("sag_roll")
    assert content["provenance"]["seed"] == 5
    assert {"jax", "numpy", "python"} <= set(content["provenance"]["versions"])
    assert content["noise"]["source"] == "as stated in the campaign"  # this plan repeats nothing


QUIET, LOUD = OpenSet((), {}, {}, {}), OpenSet(("smooth",), {}, {}, {})
STOP = Suspicion(run="r01", signal="y1", kind="clipped", sentence="y1 of r01 stops at 3 mm")
LOOK = Suspicion(run="r01", signal="y1", kind="swapped", sentence="perhaps", severity="look")


@pytest.mark.parametrize(
    ("ids", "left", "suspicions", "word"),
    [
        ((), QUIET, (), "adequate"),
        (("taper",), QUIET, (), "explained"),
        (("taper",), LOUD, (), "partly"),
        ((), LOUD, (), "none_known"),
        (("taper",), QUIET, (STOP,), "cannot_say"),
        ((), QUIET, (LOOK,), "adequate"),
    ],
)
def test_the_verdict_in_a_word_and_a_sentence(ids, left, suspicions, word):
    assert verdict(ids, left, suspicions) == word
    said = sentence(word, "strip", ids, suspicions)
    assert said.count("\n") == 0
    assert ("taper" in said) == (bool(ids) and word != "cannot_say")
    assert (STOP.sentence in said) == (word == "cannot_say")
