"""Misuse of every kind ends in one line that says what and what to do, never in a traceback or a wait.

What is typed, and what the line must hold; ``{tmp}`` is a folder of the test's own, filled by ``damaged``.
"""

import os
import subprocess
import sys
import zlib
from base64 import b64encode

import pytest

from belt_sim.commands.cli import run_command
from belt_sim.io import CAMPAIGNS, ROOT

DEEP = "[" * 100_000
NO_JSON = {"nothing": "", "list": "[]", "null": "null", "half": "{", "deep": DEEP, "other": '{"schema": "belt-x/1"}'}
SHORT = ("travel=2", "pictures=false")

REFUSED = [
    (["reveal", "campaign=null"], "campaign = null: name the folder"),
    (["reveal", "campaign=1"], "campaign = 1: name the folder"),
    (["reveal", "campaign=[c]"], "campaign = ['c']: name the folder"),
    (["reveal"], "campaign: is not given; write campaign=..."),
    (["reveal", "campaign={tmp}"], "has no truth.sha256: nothing to reveal"),
    (["reveal", "campaign={tmp}/deep_truth"], "is damaged; make the campaign anew"),
    (["compare", "campaign=null"], "campaign = null: name the folder"),
    (["compare", "campaign=[c]"], "campaign = ['c']: name the folder"),
    (["compare", "campaign={tmp}/none"], "there is no such folder"),
    (["diagnose", "campaign=1"], "campaign = 1: name the folder"),
    (["diagnose", "campaign={tmp}/held_out"], "leave at least one run to fit to"),
    (["check", "campaign=null"], "campaign = null: name the folder"),
    (["report", "diagnosis=null"], "diagnosis = null: name the run folder"),
    (["report", "diagnosis={tmp}"], "give the run folder of a diagnosis"),
    *((["report", f"diagnosis={{tmp}}/{name}"], "diagnosis = ") for name in NO_JSON),
    (["virtual-rig", "hidden=null"], "hidden = null: write [] for nothing hidden"),
    (["virtual-rig", "engine=paper"], "engine = paper: use line or mujoco"),
    (["import", "{tmp}/a.csv", "out=.", "overwrite=true", "mapping={tmp}/mapping.yaml"], "."),
    (["import", "{tmp}/a.csv", "mapping={tmp}/pipe"], "pipe: is no file; name one, as mapping="),
    (["import", "{tmp}/a.csv", "mapping={tmp}"], "is a folder; name the file in it, as mapping="),
    (["map", "tension=[7,10]", "travel=2", "pictures=false", "out=maps"], "out: no such key"),
    (["simulate", "model=ritzinger", "rig.gravity=0"], "rig.gravity = 0 m/s2: Ritzinger's formula"),
    (["simulate", "model=ritzinger", "tension=0.1", "rig.centre_distance=500"], "raise the tension"),
    (["simulate", "-cn", "map"], "--config-name = map: is a command; write belt-sim map"),
    (["simulate", "--inform"], "--inform: no such flag; did you mean --info?"),
    (["simulate", "tension=7,10"], "tension=7,10: several values are a sweep; add -m"),
    (["simulate", "-m", "tension=interval(7,10)"], "is for a search"),
    (["simulate", "-m", "tension=7,10", "hydra/launcher=nowhere"], "hydra/launcher = nowhere: use one of"),
    (["simulate", *SHORT, "rig.centre_distance=100", "effects=[{id: crown, c: -100}]"], "effects.crown.c"),
    (["simulate", "hydra.run.dir=/dev/null/x", *SHORT], "it is no folder; name another"),
    (["simulate", "effects={tmp}"], "effects"),
    (["export", "fmu=../belt.fmu"], "fmu = ../belt.fmu"),
    (["export", "order=many"], "order"),
    (["export", "model=mujoco_flex"], "model = mujoco_flex: an analytic model is needed here"),
    (["virtual-rig", "hidden=[{id: wind.py, load: 0.02}]"], "hides faults of its own and reads no effect files"),
    (["new", "tensions=[]"], "tensions = []"),
    (["new", "signals=null"], ""),
    (["app", "port=0"], "port = 0"),
    (["diagnose", "campaign={tmp}/held_out", "bootstraps=1"], "bootstraps = 1"),
]


@pytest.fixture(scope="module")
def damaged(tmp_path_factory):
    """A folder of damaged and strange things."""
    folder = tmp_path_factory.mktemp("damaged")
    for name, content in NO_JSON.items():
        (folder / name).mkdir()
        for file in ("diagnosis.json", "drawings.json"):
            (folder / name / file).write_text(content, encoding="utf-8")
    (folder / "deep_truth").mkdir()
    (folder / "deep_truth" / "truth.sealed").write_text(b64encode(zlib.compress(DEEP.encode())).decode())
    (folder / "deep_truth" / "truth.sha256").write_text("0" * 64 + "  truth.sealed\n")
    campaign = folder / "held_out"
    campaign.mkdir()
    for path in (CAMPAIGNS / "slack_belt").glob("*.*"):
        (campaign / path.name).write_bytes(path.read_bytes())
    runs = (campaign / "runs.csv").read_text(encoding="utf-8").splitlines()
    header = runs[0].split(",")
    if "use" in header:
        column = header.index("use")
        rows = [line.split(",") for line in runs[1:]]
        changed = [",".join([*r[:column], "hold_out", *r[column + 1 :]]) for r in rows]
        (campaign / "runs.csv").write_text("\n".join([runs[0], *changed, ""]), encoding="utf-8")
    else:
        changed = [f"{line},hold_out" for line in runs[1:]]
        (campaign / "runs.csv").write_text("\n".join([f"{runs[0]},use", *changed, ""]), encoding="utf-8")
    (folder / "a.csv").write_text("travel_m,y1_mm\n" + "".join(f"{k},0.{k}\n" for k in range(9)), encoding="utf-8")
    (folder / "mapping.yaml").write_text("schema: belt-mapping/1\n", encoding="utf-8")
    os.mkfifo(folder / "pipe")
    return folder


@pytest.mark.parametrize(("typed", "says"), REFUSED, ids=[" ".join(t) for t, _ in REFUSED])
def test_refused_in_a_line(typed, says, damaged, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["belt-sim"])
    monkeypatch.chdir(tmp_path)
    status = run_command([word.replace("{tmp}", str(damaged)) for word in typed])
    err = capsys.readouterr().err
    assert status == 1
    assert err.startswith("belt-sim: ")
    assert "Traceback" not in err
    assert says in err
    assert "import" in typed or len(err.strip().splitlines()) == 1


BEYOND = ["belt.width=10", "belt.width=0.001", "belt.thickness=0.02", "yaw=2", "rig.pulley_radius=5"]


@pytest.mark.parametrize(
    ("model", "setting"),
    [*(("beam_th1", s) for s in BEYOND), *((m, BEYOND[0]) for m in ("rope", "beam_th2", "strip", "ritzinger"))],
)
def test_legal_values_beyond_sense_are_told_by_every_model(model, setting, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["belt-sim"])
    status = run_command(["simulate", f"model={model}", setting, *SHORT, f"hydra.run.dir={tmp_path}"])
    out, err = capsys.readouterr()
    assert (status == 0 and "beyond its validity" in out) or (status == 1 and err.startswith("belt-sim: ")), out


WRONG_ENVIRONMENT = [
    ({"JAX_ENABLE_X64": "banana"}, "JAX_"),
    ({"JAX_PLATFORMS": "foo"}, "JAX_PLATFORMS = foo"),
    ({"XLA_FLAGS": "--bogus"}, "XLA_FLAGS = --bogus"),
]


@pytest.mark.parametrize(("environment", "says"), WRONG_ENVIRONMENT, ids=[next(iter(e)) for e, _ in WRONG_ENVIRONMENT])
def test_wrong_variables_are_one_line(environment, says, tmp_path):
    done = belt_sim(["simulate", *SHORT, f"hydra.run.dir={tmp_path}"], env=os.environ | environment)
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith("belt-sim: ")
    assert says in done.stderr
    assert "Traceback" not in done.stderr


def belt_sim(arguments, **how) -> subprocess.CompletedProcess:
    command = [sys.executable, "-m", "belt_sim", *arguments]
    given = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True, "check": False, "cwd": ROOT} | how
    return subprocess.run(command, **given)


def test_too_little_memory_is_one_line(tmp_path):
    """XLA ends a process that gets no memory, so that it is asked for before."""
    line = f'ulimit -v 1500000; "{sys.executable}" -m belt_sim simulate {" ".join(SHORT)} "hydra.run.dir={tmp_path}"'
    done = subprocess.run(line, shell=True, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert done.stderr.startswith("belt-sim: ulimit -v = 1.54 GB: at least 2.5 GB")
    assert len(done.stderr.splitlines()) == 1


def test_a_full_standard_output_is_one_line(tmp_path):
    with open("/dev/full", "w") as full:
        done = belt_sim(["simulate", "model=ritzinger", *SHORT, f"hydra.run.dir={tmp_path}"], stdout=full)
    assert done.returncode == 1
    assert done.stderr.strip() == "belt-sim: standard output = No space left on device: what was finished is kept"
    assert (tmp_path / "summary.json").is_file()


def test_a_closed_standard_output_stops_nothing(tmp_path):
    line = f'"{sys.executable}" -m belt_sim simulate model=ritzinger {" ".join(SHORT)} "hydra.run.dir={tmp_path}" >&-'
    done = subprocess.run(line, shell=True, cwd=ROOT, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "summary.json").is_file()


def test_a_reader_that_goes_stops_nothing(tmp_path):
    """As ``| head`` does; the command prints before its files are there."""
    work = f"print('line\\n' * 100_000, flush=True), open(r'{tmp_path / 'file'}', 'w').close()"
    code = f"from belt_sim.commands import cli; cli.run_command = lambda arguments: bool(({work})[1]); cli.main()"
    line = f'"{sys.executable}" -c "{code}" | head -1'
    done = subprocess.run(line, shell=True, cwd=ROOT, capture_output=True, text=True, check=False)
    assert (done.stdout, done.stderr) == ("line\n", "")
    assert (tmp_path / "file").is_file()


def test_a_dangling_link_in_a_run_folder_is_nothing(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["belt-sim"])
    (tmp_path / "link").symlink_to(tmp_path / "gone")
    for _ in range(2):
        assert run_command(["simulate", *SHORT, f"hydra.run.dir={tmp_path}"]) == 0, capsys.readouterr().err
