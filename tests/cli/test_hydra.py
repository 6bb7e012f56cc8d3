"""What Hydra's documents promise holds here: its flags, its files, its callbacks, a folder of one's own."""

import logging

import pandas as pd
import pytest
import yaml

from belt_sim.commands.cli import run_command
from belt_sim.io import CONF

ROPE = ("model=rope", "travel=2", "pictures=false")


@pytest.fixture
def mine(tmp_path, monkeypatch):
    """A folder of the user's own with a rig, beside which the commands run."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine" / "rig").mkdir(parents=True)
    rig = {"centre_distance": 8, "pulley_radius": 0.25, "head_radius": None, "tail_radius": None, "gravity": 9.81}
    (tmp_path / "mine" / "rig" / "wide.yaml").write_text(yaml.safe_dump(rig), encoding="utf-8")
    whole = {"defaults": ["simulate", {"override rig": "wide"}, "_self_"], "tension": 15}
    (tmp_path / "mine" / "slow.yaml").write_text(yaml.safe_dump(whole, sort_keys=False), encoding="utf-8")
    return tmp_path


@pytest.fixture(autouse=True)
def _logging_is_put_back():
    """--info lets Hydra log all there is."""
    root = logging.getLogger()
    handlers, level = list(root.handlers), root.level
    yield
    root.handlers[:], root.level = handlers, level


def noted(folder, name: str) -> dict:
    """A file that Hydra writes beside a run."""
    return yaml.safe_load((folder / ".hydra" / f"{name}.yaml").read_text(encoding="utf-8"))


def test_a_rig_of_ones_own_under_a_name(mine):
    assert run_command(["simulate", "--config-dir", "mine", "rig=wide", *ROPE, "hydra.run.dir=a"]) == 0
    assert noted(mine / "a", "config")["rig"]["centre_distance"] == 8
    assert run_command(["simulate", *ROPE, "hydra.searchpath=[file://mine]", "rig=wide", "hydra.run.dir=b"]) == 0
    assert noted(mine / "b", "config")["rig"]["centre_distance"] == 8
    assert run_command(["simulate", "--config-dir=mine", "--config-name", "slow", *ROPE, "hydra.run.dir=c"]) == 0
    assert noted(mine / "c", "config")["tension"] == 15


def test_hydra_notes_what_it_ran(mine):
    assert run_command(["simulate", *ROPE, "hydra.run.dir=a"]) == 0
    assert run_command(["simulate", *ROPE, "tension=-3", "hydra.run.dir=a"]) == 1  # it leaves the result and its notes
    assert noted(mine / "a", "overrides") == list(ROPE)
    assert run_command(["simulate", *ROPE, "++tension=11", "hydra.run.dir=a"]) == 0
    assert noted(mine / "a", "config")["tension"] == 11
    assert noted(mine / "a", "hydra")["hydra"]["job"]["name"] == "simulate"
    assert run_command(["simulate", "-m", *ROPE, "tension=30,40", "hydra.sweep.dir=s"]) == 0
    assert (mine / "s" / "multirun.yaml").is_file()
    assert not (mine / "s" / ".cases").exists()


@pytest.mark.parametrize(
    ("typed", "says"),
    [
        (["simulate", "--cfg", "job", "tension=12"], "tension: 12"),
        (["simulate", "tension=12", "--cfg", "job", "--resolve"], "tension: 12"),
        (["simulate", "-c", "hydra", "-p", "hydra.launcher"], "batch: auto"),
        (["compare", "--cfg", "job"], "campaign: ???"),
        (["simulate", "--info"], "Config search path"),
        (["simulate", "--info", "defaults", "rig=rope_example"], "rig/rope_example"),
        (["simulate", "--hydra-help"], "Hydra (1.3"),
        (["simulate", "--hydra-help", "model=beam_th2"], "Hydra (1.3"),
        (["simulate", "--config-path", "mine", "-cn", "whole", "--cfg", "job"], "step: 3"),
    ],
)
def test_flags_of_hydra(typed, says, mine, capsys):
    (mine / "mine" / "whole.yaml").write_text("step: 3\n", encoding="utf-8")
    assert run_command(typed) == 0
    assert says in capsys.readouterr().out


def test_a_setting_of_a_model_may_be_left_out_and_one_of_the_command_may_not(mine, capsys):
    assert run_command(["simulate", "~model.keep", *ROPE, "hydra.run.dir=a"]) == 0
    assert run_command(["simulate", "~tension", *ROPE, "hydra.run.dir=b"]) == 1
    assert run_command(["simulate", "~rig.gravity", *ROPE, "hydra.run.dir=b"]) == 1
    first, second = capsys.readouterr().err.splitlines()
    assert first.startswith("belt-sim: tension: is left out")
    assert second.startswith("belt-sim: rig.gravity: is left out")
    assert not (mine / "b").exists()


def test_callbacks_are_called(mine, capsys, monkeypatch):
    (mine / "my_callback.py").write_text(
        "from hydra.experimental.callback import Callback\n"
        "class Mine(Callback):\n"
        "    def on_job_end(self, config, job_return, **kwargs):\n"
        "        print('mine:', config.tension, job_return.status.name)\n",
        encoding="utf-8",
    )
    monkeypatch.syspath_prepend(str(mine))
    own = "+hydra.callbacks.mine={_target_: my_callback.Mine}"
    assert run_command(["simulate", *ROPE, own, "hydra.run.dir=a"]) == 0
    assert run_command(["simulate", "-m", *ROPE, own, "tension=30,35", "hydra.sweep.dir=s"]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("mine:")]
    assert lines == ["mine: 40.0 COMPLETED", "mine: 30 COMPLETED", "mine: 35 COMPLETED"]


def test_hydras_own_sweeper_and_launcher(mine):
    given = ("hydra/launcher=basic", "hydra/sweeper=basic", "tension=30,35")
    assert run_command(["simulate", "-m", *ROPE, *given, "hydra.sweep.dir=s"]) == 0
    assert sorted(pd.read_csv(mine / "s" / "sweep.csv")["tension_n_per_mm2"]) == [30, 35]


def test_a_sweep_by_settings_alone(mine):
    given = ("hydra.mode=MULTIRUN", "hydra.sweeper.params={tension: '30,35'}")
    assert run_command(["simulate", *ROPE, *given, "hydra.sweep.dir=s"]) == 0
    assert sorted(pd.read_csv(mine / "s" / "sweep.csv")["tension_n_per_mm2"]) == [30, 35]


WRONG = [
    (["-m", "tension=sort(range(40,5,-10))"], "write it upwards"),
    (["-m", "tension=sort(range(10,41,10),reverse=true)"], "write it upwards"),
    (["-m", "tension=sort(range(start=40,stop=9,step=-10))"], "write it upwards"),
    (["hydra.mode=MULTIRUN", "hydra.sweeper.params={tension: 'sort(range(40,9,step=-10))'}"], "write it upwards"),
    (["-m", "tension=range(30,9)"], "tension = range(30,9): a sweep of no values"),
    (["-m", "tension=glob(*)"], "a sweep of no values"),
    (["-m", "tension=10,20", "hydra.job.chdir=true"], "hydra.job.chdir = true: files are named from"),
    (["hydra.job.chdir=true"], "hydra.job.chdir = true: files are named from"),
    (["~model"], "model: is left out, and simulate needs it"),
    (["~effects"], "effects: is null, and so left out already"),
    (["++tensoin=3"], "did you mean tension?"),
    (["-m", "tension=interval(7,10)"], "is for a search; add hydra/sweeper=optuna"),
    (["--config-dir", "nowhere"], "nowhere: no such folder"),
    (["--config-name", "nowhere"], "--config-name = nowhere: no such file"),
    (["--config-path", str(CONF / "rig"), "--config-name", "simulate"], "--config-path takes the place of conf"),
    (["hydra.run.dir="], "hydra.run.dir = : is empty; name a folder"),
    (["+tension=3"], "tension"),
    (["tension = 10"], "tension = 10: write key=value"),
    (["~tensoin"], "tensoin"),
    (["hydra/launcher=slurm"], "use one of basic, batches, joblib"),
    (["hydra.launcher.n_jobs=2"], "hydra.launcher.n_jobs: no such key"),
    (["tension=${nowhere}"], "tension: Interpolation key 'nowhere' not found"),
    (["model.step=${step}"], "model.step: Interpolation key 'step' not found"),
    (["--cfg"], "--cfg: needs a value"),
    (["--info", "bogus"], "--info = bogus: use one of all, config"),
    (["--cfg=nonsense"], "--cfg = nonsense: use one of job, hydra, all"),
    (["--cfg", "--resolve"], "--cfg = --resolve: use one of job"),
    (["--multi", "tension=7,10"], "did you mean --multirun?"),
    (["--multirun=1"], "--multirun=1: --multirun takes no value; write --multirun"),
    (["-m=1"], "-m=1: --multirun takes no value; write -m"),
    (["-h=1"], "-h=1: --help takes no value; write -h"),
    (["--hydra-help=1"], "--hydra-help takes no value"),
    (["-mtension=10,20"], "no such flag; write -m tension=10,20"),
    (["-V"], "-V: no such flag; the flags are --help"),
    (["--"], "--: no such flag; the flags are --help"),
    (["-sc", "query=bash"], "-sc: no such flag"),
    (["--shell-completion"], "--shell-completion: no such flag"),
    (["--experimental-rerun", "x"], "--experimental-rerun: no such flag"),
    (["--config-path", "conf"], "--config-path = conf: no such folder"),
    (["experiment=figure_13"], "experiment: no such key; write +experiment=..."),
    (["-cn", "compare"], "--config-name = compare: is a command; write belt-sim compare"),
    (["-cd", "mine", "--config-dir=mine/rig"], "name further folders in hydra.searchpath=[file://FOLDER]"),
    (["--cfg", "job", "-c", "all"], "--cfg = all: give it once"),
    (["tension='10'"], "tension = '10' N/mm2: is a text; leave the quotes out"),
    (["=5"], "=5: has no key; write key=value"),
    (["+hydra.callbacks.my._target_=nomodule.Say"], "my._target_ = nomodule.Say: cannot be imported"),
    (["-m", "tension=range(10,31,10),50"], "write them out to add others"),
    (["hydra/launcher=joblib", "hydra.launcher.n_jobs=two"], "n_jobs: Value 'two' of type 'str' could not be"),
    (["model=mujoco_flex", "model.fricton=0.2"], "model.fricton: no such key; did you mean model.friction?"),
    (["model=mujoco_flex", "model.control=true"], "model.control: no such key; the keys are model.name, model.dx"),
    (["hydra.callbacks.sweep.stop_after=0", "-m", "tension=-1,-2"], "stop_after = 0: give null or a whole number"),
    (["hydra.callbacks.sweep.stop_after=two", "-m", "tension=-1,-2"], "stop_after = two: give null or a whole number"),
    (["--resolve", "--run", "-m"], "give one of them"),
    (["-m", "model=strip,nonsense"], "model = nonsense: use one of"),
]


@pytest.mark.parametrize(("typed", "says"), WRONG, ids=[s for _, s in WRONG])
def test_an_error_of_hydra_is_one_line(typed, says, mine, capsys):
    assert run_command(["simulate", *typed]) == 1
    err = capsys.readouterr().err
    assert err.startswith("belt-sim: ")
    assert len(err.splitlines()) == 1
    assert says in err
    assert not list(mine.glob("outputs/**/summary.json"))


FILES = {
    "whole.yaml": ("defaults: [simulate, _self_]\ntensoin: 4\n", ["-cn", "whole"], "tensoin", "tension"),
    "experiment/e1.yaml": ("# @package _global_\ntensoin: 4\n", ["+experiment=e1"], "tensoin", "tension"),
    "belt/mine.yaml": ("defaults: [paper_belt]\nwidht: 0.3\n", ["belt=mine"], "belt.widht", "belt.width"),
    "rig/mine.yaml": ("defaults: [test_rig]\nhead_radus: 1\n", ["rig=mine"], "rig.head_radus", "rig.head_radius"),
}


@pytest.mark.parametrize("file", FILES)
def test_a_key_of_a_file_that_no_command_reads_is_refused(file, mine, capsys):
    text, typed, key, meant = FILES[file]
    (mine / "mine" / file).parent.mkdir(exist_ok=True)
    (mine / "mine" / file).write_text(text, encoding="utf-8")
    assert run_command(["simulate", "-cd", "mine", *typed, *ROPE, "hydra.run.dir=a"]) == 1
    assert capsys.readouterr().err == f"belt-sim: {key}: no such key; did you mean {meant}?\n"
    assert not (mine / "a").exists()


def test_a_misspelt_key_is_told_before_the_value_that_lacks_for_it(mine, capsys):
    (mine / "mine" / "needed.yaml").write_text("defaults: [check, _self_]\ncampain: slack_belt\n", encoding="utf-8")
    assert run_command(["check", "-cd", "mine", "-cn", "needed", "hydra.run.dir=a"]) == 1
    assert capsys.readouterr().err == "belt-sim: campain: no such key; did you mean campaign?\n"


def test_a_key_twice_in_a_file_is_told_with_its_line(mine, capsys):
    (mine / "mine" / "twice.yaml").write_text("tension: 10\ntension: 20\n", encoding="utf-8")
    assert run_command(["simulate", "-cd", "mine", "-cn", "twice", *ROPE]) == 1
    assert "twice.yaml:2: found duplicate key tension; mend" in capsys.readouterr().err


def test_a_group_of_ones_own_stays(mine):
    (mine / "mine" / "lab").mkdir()
    (mine / "mine" / "lab" / "east.yaml").write_text("stated: 12\n", encoding="utf-8")
    given = ("-cd", "mine", "+lab=east", "tension=${lab.stated}", "hydra.run.dir=a")
    assert run_command(["simulate", *given, *ROPE]) == 0
    assert noted(mine / "a", "config")["lab"] == {"stated": 12}


@pytest.mark.parametrize(
    ("typed", "told"),
    [(["--cfg", "job", "tension=3"], 0), (["tension=4"], 0), (["tension=3"], 1), (["-r", "tension=3"], 1)],
    ids=["only shown", "no change", "changed", "changed, with -r"],
)
def test_a_key_given_twice_is_told_where_it_ran(typed, told, mine, capsys):
    assert run_command(["simulate", *typed, "tension=4", *ROPE, "hydra.run.dir=a"]) == 0
    assert capsys.readouterr().out.count("is given twice") == told


@pytest.mark.parametrize("launcher", ["batches", "basic"])
def test_a_sweep_whose_first_cases_fail_alike_stops(launcher, mine, capsys):
    cases = "yaw=[9],[8],[7],[6],[5],[4],[3]"  # one reason for all
    most = "hydra.callbacks.sweep.stop_after=3"
    assert (
        run_command(
            ["simulate", "-m", *ROPE, cases, most, f"hydra/launcher={launcher}", "hydra.sweep.dir=s", "belt.width=-1"]
        )
        == 1
    )
    first, last = capsys.readouterr().err.splitlines()
    assert first.startswith("belt-sim: belt.width = -1 m")
    assert last.startswith("belt-sim: the first 3 cases failed alike")
    assert len(pd.read_csv(mine / "s" / "sweep.csv")) == 3


@pytest.mark.parametrize("name", ["a=b#1", "it's x,y", "~one[2] Förderband"])
def test_paths_need_no_quotes(mine, name, capsys):
    (mine / name).mkdir()
    table = mine / name / "effects.yaml"
    table.write_text("schema: belt-effects/1\neffects: [{id: taper, kappa_t: 1.0e-5}]\n", encoding="utf-8")
    assert run_command(["simulate", *ROPE, "model=strip", f"effects={table}", f"hydra.run.dir={name}"]) == 0
    assert (mine / name / "summary.json").is_file()
    assert run_command(["new", f"out={name}/planned"]) == 0, capsys.readouterr().err
    assert run_command(["reveal", f"campaign={name}/planned"]) == 1
    assert f"{name}/planned: has no truth.sha256: nothing to reveal" in capsys.readouterr().err
