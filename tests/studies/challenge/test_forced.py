"""``python -m studies.challenge.forced``: what it refuses, and how it tells of a search that was never asked about."""

import sys
from types import SimpleNamespace

import pytest

import belt_sim as bs
from studies.challenge import forced


def run(monkeypatch, *arguments: str) -> None:
    monkeypatch.setattr(sys, "argv", ["forced", *arguments])
    forced.main()


def test_nothing_asked_is_answered_with_how_to_ask(monkeypatch, capsys):
    with pytest.raises(SystemExit, match="2"):
        run(monkeypatch)
    assert "FOLDER" in capsys.readouterr().err


@pytest.mark.parametrize(("wrong", "words"), [("nowhere", "nowhere"), ("slack_belt,stripp", "model = stripp")])
def test_a_wrong_folder_or_model_is_one_line_before_any_diagnosis(monkeypatch, wrong, words):
    monkeypatch.setattr(bs, "diagnose", lambda *_, **__: pytest.fail("diagnosed"))
    with pytest.raises(SystemExit) as end:
        run(monkeypatch, "slack_belt", wrong)
    assert words in str(end.value)
    assert "\n" not in str(end.value)


def test_the_model_is_the_one_asked_for_and_no_search_is_no_answer(monkeypatch, capsys):
    models = []

    def diagnose(_campaign, model, **_settings):
        models.append(model)
        return SimpleNamespace(verdict=SimpleNamespace(value="adequate"), effects=(), considered=())

    monkeypatch.setattr(bs, "diagnose", diagnose)
    run(monkeypatch, "slack_belt,beam_th2", "slack_belt")
    assert models == ["beam_th2"] * 2 + [None] * 2
    assert "slack_belt: never asked: adequate" in capsys.readouterr().out
