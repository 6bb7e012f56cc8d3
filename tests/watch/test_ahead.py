"""What a command needs at its end is imported beside what it computes."""

import subprocess
import sys
import time

from belt_sim.commands import ahead

RECORDED = """
import sys
from belt_sim.commands.ahead import _import_recorder
_import_recorder()
from belt_sim.watch import blueprint
blueprint.plot("origin", "name", 3.0)
assert "belt_sim.diagnosis.answer.recording" in sys.modules
assert "pandas" not in sys.modules
import pandas
"""


def test_a_recording_opens_without_pandas_which_can_be_imported_all_the_same():
    subprocess.run([sys.executable, "-c", RECORDED], check=True)


def test_the_recorder_is_imported_once_when_replicates_are_done(monkeypatch):
    said, imported = [], []
    monkeypatch.setattr(ahead, "_import_recorder", lambda: imported.append(len(said)))
    stages = ahead.recorder_imported(lambda *told: said.append(told))
    for told in ((0, "laying out"), (250, ""), (250, "")):
        stages(*told)
    ends = time.monotonic() + 10.0
    while not imported and time.monotonic() < ends:
        time.sleep(0.01)
    assert said == [(0, "laying out"), (250, ""), (250, "")]
    assert len(imported) == 1
    assert imported[0] >= 2
