"""A sweep keeps a case only while its inputs, its results and the code are what they were."""

import json
import shutil
from pathlib import Path

import pandas as pd
import pytest

from belt_sim.commands import runs
from belt_sim.commands.cli import run_command
from belt_sim.effects.load import load_effects
from belt_sim.io import CAMPAIGNS, ROOT

SWEEP = ("simulate", "-m", "model=strip", "travel=2", "pictures=false", "tension=20,40")
OWN = ROOT / "models" / "effects" / "wind.py"


def kept(answer) -> tuple[int, list[str]]:
    """How many cases were kept, and why the others ran again."""
    again = [line.split(", ", 1)[1].rsplit(":", 1)[0] for line in answer.out.splitlines() if "runs again" in line]
    return answer.out.count("done before, kept"), again


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    """The folder of a sweep that is done."""
    folder = tmp_path_factory.mktemp("swept") / "run"
    assert run_command([*SWEEP, f"hydra.sweep.dir={folder}"]) == 0
    return folder


@pytest.fixture
def done(belt, swept):
    """``belt`` with a sweep that is done in its folder."""
    shutil.copytree(swept, belt.folder)
    return belt


def test_nothing_changed(done):
    assert kept(done(*SWEEP)) == (2, [])


def test_an_edited_summary_is_not_believed(done):
    path = sorted(done.folder.glob("*/summary.json"))[0]
    summary = json.loads(path.read_text(encoding="utf-8"))
    summary["rate_mm_per_m"]["1"] = 99.0
    path.write_text(json.dumps(summary), encoding="utf-8")
    assert kept(done(*SWEEP)) == (1, ["summary.json has been changed"])
    assert pd.read_csv(done.folder / "sweep.csv")["rate1_mm_per_m"].abs().max() < 1.0


def test_a_damaged_summary_or_record_is_written_again(done):
    for content in ("null", "[" * 100_000):
        sorted(done.folder.glob("*/summary.json"))[0].write_text(content, encoding="utf-8")
        answer = done(*SWEEP)
        assert (answer.status, kept(answer)) == (0, (1, ["summary.json has been changed"]))
    for content in ("[]", '{"schema": "belt-run/1"}', "[" * 100_000):
        sorted(done.folder.glob("*/.hydra/run.json"))[0].write_text(content, encoding="utf-8")
        answer = done(*SWEEP)
        assert (answer.status, answer.out.count("done before, kept"), answer.err) == (0, 1, "")


def test_missing_curves_are_made_again(done):
    sorted(done.folder.glob("*/curves.csv"))[0].unlink()
    assert kept(done(*SWEEP)) == (1, ["curves.csv is missing"])
    assert len(list(done.folder.glob("*/curves.csv"))) == 2


def test_another_version_of_the_code_runs_again(done, monkeypatch):
    monkeypatch.setattr(runs, "code_hash", lambda: "0" * 64)
    assert kept(done(*SWEEP)) == (0, ["the code of belt-sim has changed"] * 2)


def test_a_changed_effects_file_runs_again(belt, tmp_path):
    table = tmp_path / "effects.yaml"
    table.write_text("schema: belt-effects/1\neffects: [{id: taper, kappa_t: 1.0e-5}]\n", encoding="utf-8")
    belt(*SWEEP, f"effects={table}")
    table.write_text("schema: belt-effects/1\neffects: [{id: taper, kappa_t: 2.0e-5}]\n", encoding="utf-8")
    assert kept(belt(*SWEEP, f"effects={table}")) == (0, [f"{table} has changed"] * 2)


def test_a_changed_effect_of_ones_own_runs_again(belt, tmp_path):
    """Named by an effects.yaml; by the command, its file is among the inputs as well."""
    own, table = tmp_path / "wind.py", tmp_path / "effects.yaml"
    shutil.copy(OWN, own)
    table.write_text("schema: belt-effects/1\neffects: [{id: wind.py, load: 1.0e-2}]\n", encoding="utf-8")
    first = belt(*SWEEP, f"effects={table}")
    assert first.status == 0, first.err
    before = runs.input_hashes({"effects": [{"id": str(own), "load": 0.01}]})
    own.write_text(own.read_text(encoding="utf-8") + "# changed\n", encoding="utf-8")
    assert kept(belt(*SWEEP, f"effects={table}")) == (0, [f"{own} has changed"] * 2)
    now = runs.input_hashes({"effects": [{"id": str(own), "load": 0.01}]})
    assert {name for name in before if before[name] != now[name]} == {str(own)}


def test_a_changed_module_of_an_effect_runs_again(tmp_path, monkeypatch):
    """A module beside it, a package of modules, and what these import."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lib").mkdir()
    files = {
        "own.py": "from lib import SIZE\ndef late():\n    import beside\n",
        "beside.py": "import numpy, deeper",
        "deeper.py": "",
        "lib/__init__.py": "from .sizes import SIZE",
        "lib/sizes.py": "SIZE = 1",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    asked = {"effects": ["own.py"]}
    for name in files:
        before = runs.input_hashes(asked)
        (tmp_path / name).write_text(f"{files[name]}\n# changed\n", encoding="utf-8")
        now = runs.input_hashes(asked)
        assert {Path(file).resolve() for file in now if now[file] != before[file]} == {tmp_path / name}
    (tmp_path / "own.py").write_text("def (", encoding="utf-8")
    assert runs.input_hashes(asked).keys() == {"own.py"}


def test_changed_measurements_are_compared_again(belt, tmp_path):
    campaign = tmp_path / "campaign"
    shutil.copytree(CAMPAIGNS / "slack_belt", campaign)
    sweep = ("compare", "-m", f"campaign={campaign}", "model=rope,strip", "pictures=false")
    first = belt(*sweep)
    assert first.status == 0, first.err
    before = {p: json.loads(p.read_text(encoding="utf-8"))["error"] for p in belt.folder.glob("*/comparison.json")}
    signals = campaign / "signals.csv"
    table = pd.read_csv(signals)
    column = next(c for c in table.columns if c.startswith("y"))
    table[column] += 5.0
    table.to_csv(signals, index=False)
    assert kept(belt(*sweep)) == (0, [f"{signals} has changed"] * 2)
    now = {p: json.loads(p.read_text(encoding="utf-8"))["error"] for p in belt.folder.glob("*/comparison.json")}
    assert now.keys() == before.keys()
    assert all(now[p] != before[p] for p in now)


def test_every_swept_key_has_its_column(belt):
    swept = ("rig.centre_distance=5,6", "belt.width=0.2,0.3")
    answer = belt("simulate", "-m", "model=rope", "travel=2", "pictures=false", *swept)
    assert answer.status == 0, answer.err
    table = pd.read_csv(belt.folder / "sweep.csv")
    assert set(zip(table["rig.centre_distance"], table["belt.width"], strict=True)) == {
        (5.0, 0.2), (5.0, 0.3), (6.0, 0.2), (6.0, 0.3)
    }  # fmt: skip


def test_imports_that_cannot_be_followed_hide_no_others(tmp_path):
    own = tmp_path / "own.py"
    (tmp_path / "lib").mkdir()  # without __init__.py
    (tmp_path / "lib" / "sizes.py").write_text("SIZE = 1.0\n")
    (tmp_path / "before.py").write_text("ONE = 1.0\n")
    own.write_text("import before\nfrom lib.sizes import SIZE\n")
    found = runs.input_hashes({"effects": [{"id": str(own)}]})
    assert {str(own), str(tmp_path / "before.py")} <= {*found}
    (tmp_path / "lame.py").write_text("def (\n")
    (tmp_path / "after.py").write_text("TWO = 2.0\n")
    own.write_text("try:\n    import lame\nexcept SyntaxError:\n    lame = None\nimport after\n")
    found = runs.input_hashes({"effects": [{"id": str(own)}]})
    assert {str(own), str(tmp_path / "lame.py"), str(tmp_path / "after.py")} == {*found}


def test_an_effect_beside_its_table_counts_before_one_of_its_name_elsewhere(tmp_path, monkeypatch):
    """Guard: that of the current folder was taken, and its hash."""
    (tmp_path / "there").mkdir()
    for folder in (tmp_path, tmp_path / "there"):
        shutil.copy(OWN, folder / "wind.py")
    table = tmp_path / "there" / "effects.yaml"
    table.write_text("schema: belt-effects/1\neffects: [{id: wind.py, load: 1.0e-2}]\n", encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    (wind,) = load_effects(str(table))
    assert type(wind).source_file == str(table.with_name("wind.py"))
    assert runs.input_hashes({"effects": str(table)}).keys() == {str(table), str(table.with_name("wind.py"))}


def test_a_case_that_is_stopped_is_not_lost(belt, monkeypatch):
    """Guard: the table said of the case at work at Ctrl-C that its process was lost."""
    carry_out = runs.RunDir.carry_out

    def stop(run, computed=None):
        if run.case == 1:
            raise KeyboardInterrupt
        return carry_out(run, computed)

    monkeypatch.setattr(runs.RunDir, "carry_out", stop)
    answer = belt(*SWEEP)
    assert (answer.status, answer.err) == (130, "belt-sim: stopped; what was finished is kept\n")
    assert pd.read_csv(belt.folder / "sweep.csv")["failed"].fillna("").tolist() == ["", runs.CASE_STOPPED]


def test_a_file_that_cannot_be_read_is_not_to_be_written():
    said = runs.explain(PermissionError(13, "Permission denied", "own.py"), "run")
    assert said == "own.py = Permission denied: choose a file or folder that can be read and written"
