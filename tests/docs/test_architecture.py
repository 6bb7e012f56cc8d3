"""docs/architecture.md: its rooms are those of today; its table "Where something new goes" names what is there, and to
follow it is enough."""

import os
import re
import shutil
import subprocess
import sys
from importlib import import_module

from belt_sim.io import PACKAGE, ROOT
from belt_sim.space.model import BATCH_ENGINES
from studies.site.architecture import BEGIN, PAGE, PICTURE, arrows, drawing, floors, table

TABLE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8").partition("## Where something new goes")[2]
ROWS = dict(re.findall(r"^\| (\w+).*? \| (.+) \|$", TABLE, re.MULTILINE)[1:])


def test_the_picture_and_the_table_of_rooms_are_of_today():
    """Else: python -m studies.site.architecture"""
    imports = arrows()
    assert PICTURE.read_text("utf-8") == drawing(imports, floors(imports))
    assert BEGIN + table(floors(imports)) in PAGE.read_text("utf-8")


def test_each_has_at_most_three_places():
    assert set(ROWS) == {"effect", "analytic", "engine", "sensor", "command"}
    assert {len(places.split("; ")) for places in ROWS.values()} == {3}


def test_what_the_page_names_is_there():
    texts = {p: p.read_text("utf-8") for p in PACKAGE.rglob("*.py")}
    for file in re.findall(r"`([\w./]+/[\w.]+)`", TABLE):
        assert list(ROOT.glob(file.replace("NAME", "*"))), file
    for named, file in re.findall(r"`([A-Z_]+)` in `([\w./]+)`", TABLE):
        homes = [p for p, text in texts.items() if re.search(rf"^{named}\b.*=", text, re.MULTILINE)]
        assert [p for p in homes if named[0] != "_" or p == ROOT / file] == [ROOT / file]  # one meaning a name
    for engine in BATCH_ENGINES:
        assert hasattr(import_module(f"belt_sim.space.{engine}"), engine.upper())


#: an engine: the belt goes where its tail pulley points
ALONG = """
from collections import namedtuple
import numpy as np
from belt_sim.curves import Curves
from belt_sim.space.run import BatchEngine
Laid = namedtuple("Laid", "case travel stations kind")
def lay_case(case, belt, travel, options, parts, features):
    return Laid(case, travel, 0, belt)
def in_batches(ready, chunk, observers):
    for one in ready:
        s = np.linspace(0.0, one.travel, 21)
        yield [Curves(travel=s, y=np.outer(np.ones(4), float(one.case.settings.yaw.last()) * s))]
ALONG = BatchEngine(lay_case, in_batches)
"""
#: two sensors: the mean roll of both spans, and the mean position on the upper side of both pulleys
SENSORS = {
    "belt_sim/campaign/types.py": (
        '    **dict.fromkeys(("upper_mid_span", "lower_mid_span"), "tilt"),\n',
        '    "both_spans": "tilt",\n    "both_pulleys": "lateral",\n',
    ),
    "belt_sim/diagnosis/forward.py": (
        "    return jnp.concatenate([y, tilt",
        ", tilt.mean(axis=0, keepdims=True), 0.5 * (y[:1] + y[3:])",
    ),
    "belt_sim/virtual_rig/march.py": (
        'looked, or the tilt of a span [rad]."""\n',
        "    both = {'both_spans': ['upper_mid_span', 'lower_mid_span'], 'both_pulleys': ['point_1', 'point_4']}\n"
        "    if parts := both.get(place):\n"
        "        return 0.5 * sum(perfect_reading(history, faults, part, s, before) for part in parts)\n",
    ),
}
#: they read what their twins do, effects show in them, and the shape of the belt's edge at points alone
READ = """
import numpy as np
import belt_sim as bs
from belt_sim.api.inference import beside_points
from belt_sim.api.simulate import fitted_model
from belt_sim.campaign import write_campaign
from belt_sim.diagnosis.forward import Forward
from belt_sim.diagnosis.samples import samples_of
from belt_sim.effects.base import library
from belt_sim.virtual_rig.make import make_campaign
from belt_sim.virtual_rig.march import TrueErrors, observe, true_line
from belt_sim.virtual_rig.plan import Plan, RunSetting
places = {'y1': 'point_1', 'y4': 'point_4', 'roll': 'both_spans', 'y': 'both_pulleys'}
runs = tuple(RunSetting(tension=t, yaw=7e-4, yaw_at=1.0) for t in (1e7, 4e7))
plan = Plan(runs=runs, length=6.0, spacing=0.1, signals=places)
campaign = write_campaign(make_campaign(seed=1, base='beam_th2', plan=plan)[0], 'both')
edge = library()['edge_profile']
forward = Forward(samples_of(campaign), fitted_model('beam_th2'), [edge])
twins = observe(plan, true_line(plan, 'beam_th2', TrueErrors()), ())
apart = forward.values(forward.null()[None])[0] - twins.transpose(2, 0, 1)
print(bool(np.nanmax(abs(apart)) < 2e-6), [f'{s.at} {s.kind} {s.unit}' for s in campaign.signals[2:]])
one, other, roll, both = np.moveaxis(forward.columns_of(edge, forward.null()), 2, 0)
print(bool(np.allclose(both, 0.5 * (one + other)) and both.any() and not roll.any()))
seen = bs.check(campaign, 'beam_th2', effects=['taper'], advise=False).visible
print([v.effect for v in seen if v.smallest], beside_points(campaign))
"""
#: no unknown law is sought with sensors of which the search knows no curve
SHOWN = """True ['both_spans tilt mrad', 'both_pulleys lateral mm']
True
['taper'] ['roll', 'y']
"""
REFUSED = "model.damping = 3.0: engine=along does not obey it: leave it out, or use engine=native or engine=mjx\n"


def test_an_effect_an_engine_two_sensors_and_a_command_made_by_the_page_work(tmp_path):
    for name in ("belt_sim", "conf"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "models").symlink_to(ROOT / "models")

    def add(file, before, text):
        path = tmp_path / file
        assert path.read_text("utf-8").count(before) == 1
        path.write_text(path.read_text("utf-8").replace(before, before + text), "utf-8")

    wind = (ROOT / "models" / "effects" / "wind.py").read_text("utf-8")
    (tmp_path / "belt_sim" / "effects" / "wind.py").write_text(wind, "utf-8")
    row = "\n    'wind': {'words': 'A wind.', 'load': size('N/m', 0.01, 1.0)},"
    add("belt_sim/virtual_rig/faults.py", "_TABLE: dict[str, dict[str, Any]] = {", row)
    (tmp_path / "conf" / "tell.yaml").write_text(
        "defaults:\n  - common\n  - _self_\n\nword: hello   # to tell\n", "utf-8"
    )
    add(
        "belt_sim/commands/__init__.py", "COMMANDS = {", "\n    'tell': ('tells a word', 'commands.tell:tell_command'),"
    )
    (tmp_path / "belt_sim" / "commands" / "tell.py").write_text(
        "from belt_sim.effects.base import library\n"
        "from belt_sim.virtual_rig.hidden import fault_class\n"
        "def tell_command(run_dir):\n"
        "    print(run_dir.config['word'], library()['wind'].law, fault_class('wind').__doc__)\n"
        "    import belt_sim as bs\n"
        "    case = bs.make_case(tension=20, yaw=0.05)\n"
        "    found = bs.simulate(case, model='mujoco_flex', engine='along', travel=2.0)\n"
        "    print(round(found.curves.y[3, -1] / case.settings.yaw.last(), 6))\n"
        "    try:\n"
        "        bs.simulate(case, model={'name': 'mujoco_flex', 'damping': 3.0}, engine='along', travel=2.0)\n"
        "    except bs.BeltError as refusal:\n"
        "        print(refusal)\n"
        "    import read\n",
        "utf-8",
    )
    add("belt_sim/space/options.py", "OBEYED: dict[str, set[str]] = {", "\n    'along': {'dx'},")
    (tmp_path / "belt_sim" / "space" / "along.py").write_text(ALONG, "utf-8")
    for file, (before, text) in SENSORS.items():
        add(file, before, text)
    (tmp_path / "read.py").write_text(READ, "utf-8")
    env = os.environ | {"PYTHONPATH": str(tmp_path)}
    command = [sys.executable, "-m", "belt_sim", "tell", "word=welcome"]
    ran = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout) == (0, "welcome run-up A wind.\n2.0\n" + REFUSED + SHOWN), ran.stderr
    assert list(tmp_path.glob("outputs/tell/*/.hydra/lock"))  # in a folder of its own
