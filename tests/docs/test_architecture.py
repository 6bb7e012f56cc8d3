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
REFUSED = "model.damping = 3.0: engine=along does not obey it: leave it out, or use engine=native or engine=mjx\n"


def test_an_effect_an_engine_and_a_command_made_by_the_page_work(tmp_path):
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
        "        print(refusal)\n",
        "utf-8",
    )
    add("belt_sim/space/options.py", "OBEYED: dict[str, set[str]] = {", "\n    'along': {'dx'},")
    (tmp_path / "belt_sim" / "space" / "along.py").write_text(ALONG, "utf-8")
    env = os.environ | {"PYTHONPATH": str(tmp_path)}
    command = [sys.executable, "-m", "belt_sim", "tell", "word=welcome"]
    ran = subprocess.run(command, cwd=tmp_path, env=env, capture_output=True, text=True, check=False)
    assert (ran.returncode, ran.stdout) == (0, "welcome run-up A wind.\n2.0\n" + REFUSED), ran.stderr
    assert list(tmp_path.glob("outputs/tell/*/.hydra/lock"))  # in a folder of its own
