"""What a terminal of 80 columns shows of a diagnosis: the verdict first, and nothing that contradicts it."""

from dataclasses import replace
from pathlib import Path

import pytest
from small_campaign import drawn
from unknown_result import unknown

from belt_sim.effects.base import library
from belt_sim.results.diagnosis import NextRun
from belt_sim.results.errors import CampaignLabel, Check, Comparison, Visible
from belt_sim.results.words import capital
from belt_sim.show.terminal import tell, tell_diagnosis

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
    d = replace(
        unknown() if name == "stranger" else drawn(name),
        beyond=("in 8 of 10 runs the belt is too slack for this model: " + "remedy " * 20,),
    )
    lines = told(d, verbose=verbose)
    assert max(map(len, lines)) <= 80
    assert next(filter(None, lines)).startswith(f"{d.headline}: ")
    assert any(c.id in lines[k] for k in range(len(lines)) for c in d.ranking[-1:]) == verbose


def test_tables_of_check_and_compare_fit_and_break_no_name_or_number(monkeypatch, capsys):
    """Names of effects were broken in the midst, and numbers of a comparison cut off."""
    monkeypatch.setenv("COLUMNS", "80")
    numbers = [(e.id, n, p) for e in library().values() for n, p in e.parameters.items()]
    size: dict = {"meaning": "", "smallest": 1.234e-4, "largest_plausible": 5e3, "share": 2.0}
    visible = tuple(Visible(effect=e, parameter=n, unit=p.unit, **size) for e, n, p in numbers)
    d = drawn("sag_roll")
    label, made = CampaignLabel(title="a campaign", sha256="", source="measured"), library()["taper"](kappa_t=1e-5)
    rows = tuple(replace(r, run="run at 10 N") for r in d.per_run)
    common: dict = {"base_model": "beam_th2", "campaign": label, "provenance": {}}
    compared = Comparison(**common, error=d.error, where=d.where, effects=(made,), per_run=rows, steady=())
    checked = Check(**common, planned=False, runs=(), noise="", doubts=(), visible=visible, pairs=())
    for result, words in ((checked, [f"{e}.{n}" for e, n, _ in numbers]), (compared, ["run at 10 N"])):
        (table,) = result.tables()
        tell([table], [])
        said = capsys.readouterr().out
        assert max(map(len, said.splitlines())) <= 80
        assert all(word in said for word in [*words, *table.title.split()])
        assert all(cell in said for row in table.rows for cell in row if cell.replace(".", "").strip("+-").isdigit())


def test_no_line_contradicts_the_advice(told):
    text = "\n".join(told(replace(drawn("sag_roll"), next_runs=RUNS)))
    assert "Next: Run 0. It tells sag_roll from taper (0.1 -> 9.0 sigma)." in text
    assert "No single" not in text
    assert "would be" not in text


def test_a_path_in_a_sentence_is_not_broken(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "40")
    tell([], [f"next  belt-sim check campaign={'long/' * 12}"])
    assert "campaign=" + "long/" * 12 in capsys.readouterr().out.splitlines()


def test_names_of_signals_begin_a_line_as_they_are():
    assert capital("y4: its runs begin late") == "y4: its runs begin late"
    assert capital("in 8 runs") == "In 8 runs"
