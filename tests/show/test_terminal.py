"""What a terminal of 80 columns shows of a diagnosis: the verdict first, and nothing that contradicts it."""

from dataclasses import replace
from pathlib import Path

import pytest
from small_campaign import drawn

from belt_sim.results.diagnosis import NextRun
from belt_sim.results.words import capital
from belt_sim.show.terminal import tell_diagnosis

RUNS = tuple(NextRun(f"run {k}", ("sag_roll", "taper"), 0.1, after) for k, after in enumerate((9.0, 0.2, 0.1)))


@pytest.fixture
def told(monkeypatch, capsys):
    def tell(d, **how) -> list[str]:
        monkeypatch.setenv("COLUMNS", "80")
        tell_diagnosis(d, Path("outputs"), **how)
        return capsys.readouterr().out.splitlines()

    return tell


@pytest.mark.parametrize("name", ["sag_roll", "nothing", "stranger"])
@pytest.mark.parametrize("verbose", [False, True])
def test_everything_fits_and_the_verdict_comes_first(told, name, verbose):
    d = replace(drawn(name), beyond=("in 8 of 10 runs the belt is too slack for this model: " + "remedy " * 20,))
    lines = told(d, verbose=verbose)
    assert max(map(len, lines)) <= 80
    assert next(filter(None, lines)).startswith(f"{d.headline}: ")
    assert any(c.id in lines[k] for k in range(len(lines)) for c in d.ranking[-1:]) == verbose


def test_no_line_contradicts_the_advice(told):
    text = "\n".join(told(replace(drawn("sag_roll"), next_runs=RUNS)))
    assert "Next: Run 0. It tells sag_roll from taper (0.1 -> 9.0 sigma)." in text
    assert "No single" not in text
    assert "would be" not in text


def test_names_of_signals_begin_a_line_as_they_are():
    assert capital("y4: its runs begin late") == "y4: its runs begin late"
    assert capital("in 8 runs") == "In 8 runs"
