"""What is hidden and in no library is found, said and added; what is not there is not found."""

import json
import lzma
from dataclasses import replace
from pathlib import Path

import pytest
from shipped_schema import check
from small_discovery import MODEL, D, campaign, described, discovered, fitted, surveyed

import belt_sim as bs
from belt_sim.api import inference
from belt_sim.api.plot import pictures_by_kind
from belt_sim.diagnosis.decide import POLICY, log_evidence
from belt_sim.diagnosis.workbench import workbench
from belt_sim.discovery import search_data, selection
from belt_sim.discovery.search_data import search_data_of
from belt_sim.discovery.selection import CloseLaw, LawSearch, search_law, unknown_evidence
from belt_sim.discovery.words import describe_discovery, place_words, sentence
from belt_sim.errors import InputError
from belt_sim.results.errors import Change, Errors, OwnChange
from belt_sim.results.files import diagnosis_of, file_json
from belt_sim.results.words import thousandths

STORED = Path(__file__).parents[1] / "results" / "stored"  # a diagnosis with a discovery, as it was once written
EXPLAINED = 0.9  # of the hidden effect's chi2, D^2


def read_beside_the_stored(content):
    """A discovery as it is read in the stored diagnosis."""
    texts = (lzma.decompress((STORED / f"{name}.json.xz").read_bytes()) for name in ("diagnosis", "drawings"))
    diagnosis, drawn = map(json.loads, texts)
    return diagnosis_of(diagnosis | {"discovery": content}, drawn, "stored").discovery


def test_nothing_is_discovered_where_nothing_is_hidden():
    found = bs.discover(campaign(), "strip")
    assert not found.found
    assert found.law is None
    assert found.probability < 0.5
    assert "Nothing is missing" in found.sentence


def test_who_asks_for_a_law_is_told_that_no_known_effect_was_tried(monkeypatch):
    monkeypatch.setattr(inference, "search_data_of", lambda bench, fit: surveyed())
    monkeypatch.setattr(inference, "describe_discovery", lambda *asked, **config: described("yaw_creep"))
    last = bs.discover(campaign(), "strip").limits[-1]
    assert last.startswith("Only a law was sought, and no effect of the catalogue: one or two known effects may")


def test_a_yaw_that_creeps_is_found_at_its_place_with_its_law():
    found = described("yaw_creep")
    assert found.places[0].place == "yaw_tail"
    assert found.places[0].pool == "odd"
    assert found.law is not None
    assert found.law.place == "yaw of the tail pulley"
    assert "β" in found.law.formula
    assert found.law.parity == "odd"
    assert found.law.exponent is not None
    assert abs(found.law.exponent.value) < 3.0 * found.law.exponent.u
    assert discovered("yaw_creep").best.gain > EXPLAINED * D**2


def test_the_held_out_error_falls():
    error = described("yaw_creep").error
    assert error.held_out.after < 0.8 * error.held_out.before


def test_the_written_effect_lets_the_error_fall_in_a_comparison(tmp_path):
    (tmp_path / "found_law.yaml").write_text(described("yaw_creep").law_file, encoding="utf-8")
    for name, draw in pictures_by_kind(described("yaw_creep")).items():
        draw(tmp_path / f"{name}.png")
    compared = bs.compare(campaign("yaw_creep"), "strip", [str(tmp_path / "found_law.yaml")], drawn=False)
    assert compared.error.fit.after < 0.8 * compared.error.fit.before
    assert {p.name for p in tmp_path.glob("*.png")} == {f"{n}.png" for n in pictures_by_kind(described("yaw_creep"))}
    content = json.loads(json.dumps(file_json(described("yaw_creep")), allow_nan=False))
    check(content)
    assert file_json(read_beside_the_stored(content)) == file_json(described("yaw_creep"))


def test_something_unknown_is_likely_where_it_is_and_only_there():
    odds = [log_evidence(unknown_evidence(surveyed(name))[0], 1.0, POLICY) for name in ("yaw_creep", "")]
    assert odds[0] > 0.25 * D**2 > 20.0
    assert odds[1] < 0.0


def test_the_law_in_the_march_is_worth_more_than_what_is_seen_in_the_linear_range(monkeypatch):
    monkeypatch.setattr(selection, "search_law", lambda data, tell, **asked: discovered("yaw_creep"))
    bench, fit = fitted("yaw_creep")
    seen, law = LawSearch().evidence_of_unknown(bench, fit), LawSearch().law(bench, fit)
    assert law.law is not None
    assert law.law.gain > EXPLAINED * D**2
    assert fit.chi2 - law.fit.chi2 == pytest.approx(law.law.gain, rel=0.02)
    assert seen.tried > 1000.0  # it is the best of thousands


def test_free_inputs_that_were_seen_are_not_sought_again(monkeypatch):
    """Where there are many readings as well, and kinds of places are worked on one after the other."""
    monkeypatch.setattr(search_data, "MANY_READINGS", 0)
    bench, fit = fitted("yaw_creep")
    search = LawSearch()
    seen = search.evidence_of_unknown(bench, fit)
    asked = []
    monkeypatch.setattr(selection, "search_law", lambda data, tell, **given: asked.append(given) or discovered())
    search.law(bench, fit)
    latent_inputs = asked[0]["latent_inputs"]
    best = max(c.gain for c in latent_inputs)
    assert best == latent_inputs[0].gain == seen.courses.max()


def test_a_law_that_predicts_worse_than_none_is_told_so():
    law, told = discovered("yaw_creep"), described("yaw_creep")
    assert "left-out" not in told.sentence

    def said(noise_floor=0.5, **error) -> str:
        return sentence(law.data, law.best, told.law, Errors(noise_floor=noise_floor, fit=told.error.fit, **error))

    rises = {"45 N/mm2": Change(before=0.061e-3, after=0.6e-3), "7 N/mm2": Change(before=0.3e-3, after=0.1e-3)}
    worse = said(0.01e-3, by_condition=rises).partition("but left-out runs are predicted worse with it (")[2]
    assert worse.startswith("45 N/mm2: 0.061 to 0.60 mm)")
    for before, after, fine in ((1.0, 0.9, True), (1.0, 1.1, False), (0.1, 0.4, True)):
        own = OwnChange(before=before, after=after, floor=0.5)
        assert ("left-out runs are predicted worse" in said(own=own)) is not fine


def test_the_fall_of_the_rms_error_is_told_in_millimetres():
    told = described("yaw_creep")
    before, after = (thousandths(x) for x in (told.error.fit.before, told.error.fit.after))
    assert (
        f"the rms error of fitted runs, sensor zero and settings as stated, falls from {before} to {after} mm"
        in told.sentence
    )
    assert "explains" not in told.sentence


def test_places_whose_laws_fit_as_well_are_told_and_its_own_is_not():
    law = discovered("yaw_creep")
    own = law.best.scored
    other = next(s for s in law.choice.judged if place_words(s.law) != place_words(own.law))
    alike = replace(law, close=(CloseLaw(own, 0.0), CloseLaw(other, 1.0), CloseLaw(other, 2.0)))
    said = describe_discovery(alike, 1.0).sentence
    assert said.endswith(f" A law of the {place_words(other.law)} fits these readings as well.")
    assert (
        "fits these readings as well" not in describe_discovery(replace(law, close=(CloseLaw(own, 0.0),)), 1.0).sentence
    )


def test_too_few_runs_are_said_and_no_law_is_guessed():
    whole = campaign("yaw_creep")
    few = replace(whole, runs=whole.runs[:2])
    bench = workbench(few, MODEL, [])
    found = describe_discovery(
        search_law(search_data_of(bench, bench.fit([bench.start((), bench.forward.null())])[0])), 0.0
    )
    assert not found.found
    assert "Too few runs" in found.sentence
    assert any("one tension" in text for text in found.limits)


def test_a_file_of_another_version_is_refused():
    with pytest.raises(InputError, match="another version"):
        read_beside_the_stored({"schema": "belt-discovery/0"})
