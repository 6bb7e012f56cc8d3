"""diagnosis.json: every key that other programs read, its units, and the way back."""

import math
from dataclasses import replace

import jsonschema
import numpy as np
import pytest
from shipped_schema import check
from small_campaign import SEED, diagnosed, drawn, examined

from belt_sim.diagnosis.describe import describe
from belt_sim.errors import InputError
from belt_sim.io import write_json
from belt_sim.results.diagnosis import Diagnosis
from belt_sim.results.errors import Drawings
from belt_sim.results.files import file_json, read_diagnosis

NAMES = ("nothing", "sag_roll", "two", "stranger")


@pytest.mark.parametrize("name", NAMES)
def test_the_file_follows_its_schema(name):
    content = file_json(diagnosed(name))
    check(content)
    for e in content["effects"]:
        assert e["parameters"]
        assert len(set(e["confusable_with"])) == len(e["confusable_with"])
        for number in e["parameters"].values():
            assert number["u"] > 0
            assert number["interval_95"][0] < number["value"] < number["interval_95"][1]
    low, high = content["where"]["worst"]["travel_m"]
    assert 0 <= low < high


@pytest.mark.parametrize(("place", "key"), [((), "verdict"), (("error",), "noise_floor_mm"), (("where",), "worst")])
def test_the_schema_misses_a_key_that_is_gone(place, key):
    content = inner = file_json(diagnosed("sag_roll"))
    for step in place:
        inner = inner[step]
    del inner[key]
    with pytest.raises(jsonschema.ValidationError, match=key):
        check(content)


def test_lengths_are_in_mm_and_parameters_in_si():
    d = diagnosed("sag_roll")
    content = file_json(d)
    assert content["error"]["held_out"]["before_mm"] == pytest.approx(1e3 * d.error.held_out.before)
    assert content["error"]["noise_floor_mm"] == pytest.approx(1e3 * d.error.noise_floor)
    assert content["ranking"][0]["held_out_rms_mm"] == pytest.approx(1e3 * d.ranking[0].held_out_rms)
    assert content["effects"][0]["parameters"]["strength"]["value"] == d.effects[0].parameters["strength"].value
    row, run = content["per_run"][0], d.per_run[0]
    assert (row["unit"], row["tension_n_per_mm2"]) == ("mm", 7.0)
    assert (row["before"], row["floor"]) == pytest.approx((1e3 * run.before, 1e3 * run.floor))
    assert row["modelled"]["late_rate_mm_per_m"] == pytest.approx(1e3 * run.modelled_rate)


def test_a_tilt_is_in_mrad():
    run = replace(diagnosed("sag_roll").per_run[0], kind="tilt", before=2.5e-3)
    content = file_json(replace(diagnosed("sag_roll"), per_run=(run,)))
    (row,) = content["per_run"]
    assert (row["unit"], row["before"]) == ("mrad", pytest.approx(2.5))
    assert "late_rate_mrad_per_m" in row["measured"]
    check(content)


def same(a, b) -> bool:
    """Whether two results hold the same, arrays and six digits of a drawing included."""
    if isinstance(a, float | np.ndarray) and b is not None:
        return np.allclose(np.asarray(a, float), np.asarray(b, float), rtol=1e-5, atol=1e-12, equal_nan=True)
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, dict):
        return set(a) == set(b) and all(same(v, b[k]) for k, v in a.items())
    if hasattr(a, "__dataclass_fields__"):
        return type(a) is type(b) and same(vars(a), vars(b))
    return a == b


def written(folder, d: Diagnosis):
    """The folder with the two files of a diagnosis."""
    write_json(folder / "diagnosis.json", file_json(d))
    check(file_json(d.drawings))
    write_json(folder / "drawings.json", file_json(d.drawings))
    return folder


@pytest.mark.parametrize("name", ["sag_roll", "stranger"])
def test_a_diagnosis_is_read_back_as_it_was(tmp_path, name):
    d = drawn(name)
    back = read_diagnosis(written(tmp_path, d))
    assert same(d, back)
    assert not same(replace(d, base_model="strip"), back)
    assert not same(d, replace(back, drawings=Drawings(overlays=back.drawings.overlays)))


def test_a_file_of_another_version_is_told_in_one_line(tmp_path):
    folder = written(tmp_path, diagnosed("sag_roll"))
    old = file_json(diagnosed("sag_roll"))
    del old["runs_schema"]
    write_json(folder / "diagnosis.json", old)
    with pytest.raises(InputError, match="another version of belt-sim") as caught:
        read_diagnosis(folder)
    assert "\n" not in str(caught.value)


def test_the_ranking_marks_what_is_likely_only_beside_something_unknown():
    found = examined("two")
    beside = tuple(replace(e, unknown=True) for e in found.decision.explanations)
    ranking = describe(replace(found, decision=replace(found.decision, explanations=beside)), seed=SEED).ranking
    marked = {c.id for c in ranking if c.note == "only beside something unknown"}
    assert marked == {"taper", "yaw_offset_tail"} == {c.id for c in ranking if c.probability > 0.5}
    assert not any(c.note == "only beside something unknown" for c in diagnosed("two").ranking)


def test_the_ranking_lists_every_candidate_best_first():
    ranking = diagnosed("sag_roll").ranking
    likely = [round(c.probability, 6) for c in ranking]
    assert likely == sorted(likely, reverse=True)
    assert ranking[0].id == "sag_roll"
    assert len(ranking) == len({c.id for c in ranking})


@pytest.mark.parametrize(("name", "chosen"), [("nothing", set()), ("sag_roll", {"sag_roll"}), ("two", None)])
def test_the_effects_that_are_named_follow_from_the_table_in_the_file(name, chosen):
    """likelihood - occam + unknown + prior, of what nothing speaks against: a pocket calculator will do."""
    content = file_json(diagnosed(name))
    rows = [e for e in content["considered"] if not e["refused"]]
    odds = [e["likelihood"] - e["occam"] + e["unknown_evidence"] + e["prior"] for e in rows]
    whole = sum(math.exp(o - max(odds)) for o in odds)
    assert [e["probability"] for e in rows] == pytest.approx([math.exp(o - max(odds)) / whole for o in odds])
    best = set(rows[odds.index(max(odds))]["effects"])
    assert best == {e["id"] for e in content["effects"]}
    assert chosen in (None, best)


def test_it_tells_what_it_came_from():
    d = diagnosed("sag_roll")
    assert d.provenance["seed"] == SEED
    assert {"jax", "numpy", "python"} <= set(d.provenance["versions"])
    assert d.noise.source == "as stated in the campaign"  # this plan repeats nothing


def test_an_interval_of_its_own_is_read_back(tmp_path):
    d = drawn("sag_roll")
    first = d.effects[0]
    name, even = next(iter(first.parameters.items()))
    crooked = replace(even, interval_95=(even.value - 3.0 * even.u, even.value + even.u))
    d = replace(d, effects=(replace(first, parameters={**first.parameters, name: crooked}), *d.effects[1:]))
    assert read_diagnosis(written(tmp_path, d)).effects[0].parameters[name].interval_95 == crooked.interval_95
