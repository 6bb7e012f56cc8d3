"""belt-sim import as it is typed: file names of any kind, questions in a terminal, drafts, nothing half-written."""

import sys

import pytest
from logger_files import MAPPING, log, table
from rich.prompt import Confirm, Prompt

from belt_sim.api.campaigns import draft_text, import_files
from belt_sim.campaign import read_campaign
from belt_sim.commands import cli
from belt_sim.commands.campaigns import ask_in_terminal
from belt_sim.commands.cli import run_command
from belt_sim.errors import InputError
from belt_sim.importing import read, understand
from belt_sim.importing.mapping import mapping_of

L = log(length=10.0)
TEXT = table(["travel [m]", "Kante 1 [mm]", "Laser B [mm]"], [L.travel, L.y1, L.y4], ";", ",")


@pytest.fixture
def belt(tmp_path, capsys, monkeypatch):
    """Calls ``belt-sim`` in a folder of its own: (status, output, errors)."""
    monkeypatch.setattr(sys, "argv", ["belt-sim"])
    monkeypatch.setenv("HYDRA_FULL_ERROR", "1")
    monkeypatch.chdir(tmp_path)

    def call(*arguments: str) -> tuple[int, str, str]:
        capsys.readouterr()
        status = run_command([*arguments, "hydra.run.dir=run"])
        return (status, *capsys.readouterr())

    return call


NAMES = ["Läufe 3.csv", "it's (1), [b]$x=0,5%.csv", "-a.csv"]


@pytest.mark.parametrize("name", NAMES)
def test_a_file_may_have_any_name(name, belt, tmp_path):
    (tmp_path / name).write_text(TEXT)
    status, out, err = belt("import", name, "draft=draft.yaml")
    assert (status, err) == (0, "")
    assert (tmp_path / "draft.yaml").is_file()
    assert "y1 at point_1" in out


def test_names_become_one_setting(monkeypatch):
    heard = []
    monkeypatch.setattr(cli, "apply_hydra", lambda program, task, name, arguments: heard.extend(arguments) or 0)
    assert cli.run_hydra("import", ["a.csv", "out=b", "--cfg", "job", "c d.csv"]) == 0
    assert heard == ["--cfg=job", "hydra.job.name=import", "out=b", "files=['a.csv','c d.csv']"]


def test_what_is_missing_is_told_a_line_each_and_nothing_is_left(belt, tmp_path):
    (tmp_path / "a.csv").write_text(TEXT)
    status, _, err = belt("import", "a.csv", "out=campaign")
    assert status == 1
    lines = err.strip().splitlines()
    assert any("runs.a.tension" in line and "give it as" in line for line in lines)
    assert any("columns.Laser B [mm].at" in line for line in lines) or "Laser" not in err
    assert not (tmp_path / "campaign").exists()


def test_a_draft_that_is_filled_in_imports(belt, tmp_path):
    (tmp_path / "a.csv").write_text(TEXT)
    belt("import", "a.csv", "draft=draft.yaml")
    text = (tmp_path / "draft.yaml").read_text()
    answers = {
        "tension: null": "tension: 10 N/mm2",
        "yaw: null": "yaw: -0.042",
        "at: null": "at: point_4",
        "centre_distance: null": "centre_distance: 11.28 m",
        "pulley_radius: null": "pulley_radius: 0.17 m",
        "width: null": "width: 200 mm",
        "thickness: null": "thickness: 0.3 mm",
        "youngs_modulus: null": "youngs_modulus: 210 GPa",
        "density: null": "density: 7850",
    }
    for blank, answer in answers.items():
        text = text.replace(blank, answer)
    (tmp_path / "draft.yaml").write_text(text)
    status, _, err = belt("import", "a.csv", "mapping=draft.yaml", "out=campaign")
    assert (status, err) == (0, "")
    campaign = read_campaign(tmp_path / "campaign")
    assert campaign.runs[0].tension == 10e6
    assert (tmp_path / "campaign" / "understood.png").stat().st_size > 10_000
    assert belt("import", "a.csv", "draft=draft.yaml")[0] == 1  # a draft is not overwritten


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["import"], "files"),
        (["import", "nowhere.csv"], "no such file"),
        (["import", "a.csv", "mapping=nowhere.yaml"], "cannot be read"),
        (["import", "a.csv", "maping=x.yaml"], "did you mean mapping?"),
        (["new", "tensions=[a]"], "tensions"),
        (["check", "campaign=nowhere"], "there is no such folder"),
        (["check", "campaign=slack_belt", "step=a"], "step"),
    ],
)
def test_misuse_is_one_line(arguments, words, belt, tmp_path):
    (tmp_path / "a.csv").write_text(TEXT)
    status, _, err = belt(*arguments)
    assert status == 1
    assert words in err
    assert len(err.strip().splitlines()) == 1


def test_questions_are_asked_until_the_answer_can_be_used(monkeypatch, tmp_path):
    (tmp_path / "a.csv").write_text(TEXT)
    answers = {
        "Laser": ["point_4"],
        "axes": ["eleven metres", "test_rig"],
        "wide": ["paper_belt"],
        "tension": ["10 bananas", "10"],
        "yaw": ["-0.042"],
    }
    questions: list[str] = []
    monkeypatch.setattr(Confirm, "ask", lambda *a, **k: True)

    class Out:
        """A console that remembers what was asked last."""

        is_terminal = True

        def print(self, *what, **how) -> None:
            questions.append(str(what[0]))

    def answer(*_, **__):
        question = next(q for q in reversed(questions) if q.startswith("[bold]"))
        return next(a.pop(0) for word, a in answers.items() if word in question)

    monkeypatch.setattr(Prompt, "ask", answer)
    logged = read([tmp_path / "a.csv"])
    proposal = ask_in_terminal(logged, {"columns": {"Laser B [mm]": {"role": "signal"}}}, Out())
    assert proposal.missing == ()
    assert proposal.complete().runs[0].tension == 10e6
    assert all(not left for left in answers.values())
    assert sum("bananas" in line for line in questions) == 1


def test_an_existing_campaign_is_replaced_only_when_asked(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.csv").write_text(TEXT)
    mapping = MAPPING | {"all_runs": {"tension": 10, "yaw": -0.042}, "columns": {"Laser B [mm]": {"at": "point_4"}}}
    import_files(["a.csv"], tmp_path / "out", mapping=mapping, pictures=False)
    (tmp_path / "out" / "notes.txt").write_text("mine")
    with pytest.raises(Exception, match="not empty"):
        import_files(["*.csv"], tmp_path / "out", mapping=mapping, pictures=False)
    import_files(["*.csv"], tmp_path / "out", mapping=mapping, pictures=False, overwrite=True)
    assert (tmp_path / "out" / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize("mapping", [[1, 2], 3, True])
def test_a_mapping_of_the_wrong_kind_is_refused_in_a_line(mapping, tmp_path):
    with pytest.raises(InputError, match=r"mapping = .*: give a mapping, or the name of a YAML file"):
        import_files(["a.csv"], tmp_path / "out", mapping=mapping)


def test_a_draft_names_every_question(tmp_path):
    (tmp_path / "a.csv").write_text(TEXT)
    logged = read([tmp_path / "a.csv"])
    proposal = understand(logged)
    text = draft_text(proposal)
    assert all(q.text in text for q in proposal.missing)
    (tmp_path / "draft.yaml").write_text(text)
    again = understand(logged, mapping_of(tmp_path / "draft.yaml"))
    assert {q.key for q in again.missing} == {q.key for q in proposal.missing}
