"""Every setting of every command does something: changed, it changes what the command gets or leaves, or is refused.

Simulations are run. Of the slower commands what is behind them is replaced by a recorder: what reaches it must change.
Of a picture the numbers of its lines are kept, which is all of it that a setting changes; to draw it takes longer.
Values are changed in the composed configuration (``carry_out``): that Hydra puts them there is shown elsewhere.
"""

import hashlib
import json
from pathlib import Path

import pandas as pd
import pytest
from command import carry_out
from matplotlib.lines import Line2D
from matplotlib.text import Text

from belt_sim.api import check, compare, inference, simulate, sweep
from belt_sim.app import server
from belt_sim.commands import COMMANDS, campaigns, cases, known_keys
from belt_sim.errors import BeltError
from belt_sim.io import CONF, ROOT
from belt_sim.show import style
from belt_sim.space import scene_looks

TAPER = "effects=[{id: taper, kappa_t: 2.0e-5}]"
RIG = {"centre_distance": "9", "pulley_radius": "0.2", "head_radius": "0.16", "tail_radius": "0.18", "gravity": "9.7"}
BELT = {"width": "0.25", "thickness": "4e-4", "youngs_modulus": "2e11", "density": "7900", "poisson_ratio": "0.28"}
MACHINE = {f"rig.{k}": v for k, v in (RIG | {"face_width": "0.3"}).items()} | {f"belt.{k}": v for k, v in BELT.items()}
DRIVEN = {"tension": "25", "yaw": "0.03", "yaw_head": "0.02", "direction": "-1", "speed": "0.7", "travel": "3"}
LOG = ROOT / "tests" / "golden" / "imports" / "plain"

#: command -> what is typed beside, and for every key another value
CHANGED: dict[str, tuple[tuple[str, ...], dict[str, str]]] = {
    "simulate": (
        ("model=strip", "travel=2", "pictures=false"),
        MACHINE | DRIVEN | {"model.step": "0.02", "model.keep": "0.5", "model.name": "rope", "effects": TAPER[8:]}
        | {"pictures": "true", "watch": "rrd", "engine": "mjx", "objective": "{start: 10, within: 1, beyond: 0.2}"},
    ),
    "map": (
        ("tension=[10,40]", "travel=2", "pictures=false", "model=strip"),
        MACHINE | DRIVEN | {"tension": "[20,30]", "model.step": "0.02", "model.keep": "0.5", "model.name": "rope"}
        | {"effects": TAPER[8:], "at": "[0.5]", "workers": "0", "pictures": "true", "show": "colour"},
    ),
    "scene": (
        ("rig=rope_example",),
        MACHINE | {k: v for k, v in DRIVEN.items() if k != "travel"}
        | {"out": "other.xml", "model.name": "mujoco_rope", "effects": TAPER[8:]},
    ),
    "view": (
        ("rig=rope_example",),
        MACHINE | {k: v for k, v in DRIVEN.items() if k != "travel"}
        | {"model.name": "mujoco_rope", "effects": TAPER[8:]},
    ),
    "export": (
        ("tension=30", "fmu=null"),
        MACHINE | {"tension": "25", "speed": "0.7", "direction": "-1", "effects": TAPER[8:], "order": "3"}
        | {"delay": "chain", "highest": "1", "fmu": "belt.dll", "fmi": "3", "libraries": "all", "mat": "null"}
        | {"model.name": "beam_th2", "model.step": "0.02", "model.keep": "0.5"},
    ),
    "check": (
        ("campaign=slack_belt",),
        {"campaign": "machine_fault", "effects": "[taper]", "travel": "50", "step": "0.4", "advise": "false"}
        | {"pictures": "false", "model.name": "beam_th2", "model.step": "0.02", "model.keep": "0.5"},
    ),
    "compare": (
        ("campaign=slack_belt",),
        {"campaign": "machine_fault", "effects": TAPER[8:], "pictures": "false", "model.name": "beam_th2"}
        | {"model.step": "0.02", "model.keep": "0.5"},
    ),
    "diagnose": (
        ("campaign=slack_belt",),
        {"campaign": "machine_fault", "effects": "[taper]", "leave_out": "[taper]", "bootstraps": "200", "seed": "1"}
        | {"checked": "true", "pictures": "false", "watch": "null", "verbose": "true", "model.name": "beam_th2"}
        | {"model.step": "0.02", "model.keep": "0.5"},
    ),
    "new": (
        (),
        MACHINE | {"out": "mine", "title": "mine", "tensions": "[9,30]", "yaw": "0.05", "speed": "0.7"}
        | {"signals": "[point_2]"},
    ),
    "import": (
        (f"files=[{LOG / 'lauf_1.csv'}]", f"mapping={LOG / 'mapping.yaml'}"),
        {"files": "[nothing.csv]", "mapping": "null", "draft": "draft.yaml", "out": "c", "overwrite": "true"}
        | {"pictures": "false"},
    ),
    "virtual-rig": (
        (),
        MACHINE
        | {"engine": "paper", "hidden": "[taper]", "base": "strip", "plan": "3", "seed": "1", "out": "c"}
        | {"quantum": "0.129"},
    ),
    "reveal": (("campaign=machine_fault",), {"campaign": "slack_belt"}),
    "report": (("diagnosis=.",), {"diagnosis": "elsewhere"}),
    "app": ((), {"port": "8123", "open": "false"}),
}  # fmt: skip
#: what changes nothing, and why
WHY_NOT = {
    **{
        (c, "rig.face_width"): "a limit of what is told of a run that leaves the pulleys, which this short one does not"
        for c in ("simulate", "map", "scene", "view", "export", "new", "virtual-rig")
    },
    ("simulate", "speed"): "an analytic model without effects that know time runs in travel",
    ("map", "speed"): "as in simulate",
    **{(c, "speed"): "taken with model.belt_speed=case, as conf/view.yaml says" for c in ("scene", "view")},
    ("export", "model.keep"): "the plant's responses have records of their own",
    ("export", "model.step"): "as model.keep",
    ("export", "fmi"): "of the FMU, which takes seconds to compile: tests/linear",
    ("export", "libraries"): "as fmi",
    ("simulate", "objective"): "is printed, for a search: test_search.py",
    ("virtual-rig", "out"): "where the campaign goes: tests/virtual_rig",
    ("map", "workers"): "threads; 0 is refused",
}  # fmt: skip
BEHIND = {
    check: ("check",),
    compare: ("compare",),
    inference: ("diagnose",),
    campaigns: ("import_files", "plan_by_number"),
    campaigns.virtual_rig: ("make_campaign", "reveal"),
    server: ("serve",),
    scene_looks: ("play",),
}


def record_calls(monkeypatch) -> list[str]:
    """What reaches the functions behind the slower commands, which are not run."""
    calls: list[str] = []

    def recorder(name):
        def call(*given, **more):
            config = more.pop("config", None) or {}
            told = {k: str(config.get(k)) for k in ("pictures", "watch", "verbose")}
            told |= {k: str(v) for k, v in more.items() if not callable(v)}
            calls.append(repr((name, [str(g) for g in given], sorted(told.items()))))
            raise BeltError("recorded")

        return call

    for place, names in BEHIND.items():
        for name in names:
            monkeypatch.setattr(place, name, recorder(name))

    def recorded_once(place, name):  # what differs from the first is told, and not computed
        real, asked = getattr(place, name), []

        def call(*given, tell=None, **more):
            asked.append(repr((name, given, sorted(more.items()))))
            calls.append(asked[-1])
            if asked[-1] != asked[0]:
                raise BeltError("recorded")
            return real(*given, **more)

        monkeypatch.setattr(place, name, call)

    recorded_once(simulate, "linearise")
    recorded_once(sweep, "sweep")
    monkeypatch.setattr(cases, "scene_text", lambda *asked: calls.append(repr(asked)) or "")
    monkeypatch.setattr(style, "save", save_numbers)
    monkeypatch.setenv("DISPLAY", ":9")
    return calls


def save_numbers(fig, path, dpi=None):
    """The words of a picture and the numbers of its lines in the picture's place."""
    if path is None:
        return fig
    words = [text.get_text() for text in fig.findobj(Text)]
    lines = [line.get_xydata().tolist() for line in fig.findobj(Line2D)]
    Path(path).write_text(repr((words, lines)), encoding="utf-8")
    return Path(path)


def left(folder: Path) -> dict[str, object]:
    """Every file of a folder without what says when and how."""
    found: dict[str, object] = {}
    for path in sorted(p for p in folder.rglob("*") if p.is_file() and ".hydra" not in p.parts):
        name = str(path.relative_to(folder))
        if path.suffix == ".json":
            found[name] = {k: v for k, v in json.loads(path.read_text("utf-8")).items() if k != "provenance"}
        elif path.suffix == ".parquet":
            found[name] = pd.read_parquet(path).to_csv()
        else:
            found[name] = hashlib.sha256(path.read_bytes()).hexdigest()
    return found


@pytest.mark.parametrize("command", CHANGED)
def test_a_setting_that_is_changed_changes_something_or_is_refused(command, tmp_path, monkeypatch, capsys):
    calls = record_calls(monkeypatch)
    base, changed = CHANGED[command]

    def answer(name: str, *values: str) -> tuple[list[str], dict[str, object], str]:
        place, refusal = tmp_path / name, ""
        place.mkdir()
        monkeypatch.chdir(place)
        calls.clear()
        try:
            carry_out(command, Path("run"), base, *values)
        except BeltError as error:
            refusal = str(error)
        return list(calls), left(place), refusal + capsys.readouterr().err.replace(name, "")

    standard = answer("standard")
    silent = []
    for key, value in changed.items():
        now = answer(key.replace(".", "_"), f"{key}={value}")
        refused = key in now[2] or value in now[2]
        if now == standard and not refused and (command, key) not in WHY_NOT:
            silent.append(key)
    assert silent == []


def test_every_key_has_another_value():
    commands = {c for c in COMMANDS if (CONF / f"{c}.yaml").is_file()}
    assert commands == set(CHANGED)
    for command in commands:
        keys = {k for k in known_keys(command) if k not in ("rig", "belt", "model")}
        if command in ("scene", "view"):  # settings of 3D models: tests/space
            keys = {k for k in keys if not k.startswith("model.") or k == "model.name"}
        assert keys <= set(CHANGED[command][1]), command
