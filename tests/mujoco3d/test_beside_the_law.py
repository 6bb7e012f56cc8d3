"""Runs of the study are set beside the strip law that belongs to them."""

import json
import sys

import numpy as np
import pytest

from belt_sim.analytic.march import march
from belt_sim.analytic.model import analytic_model
from belt_sim.mujoco3d import beside_the_law
from belt_sim.mujoco3d.study import paper_case


def test_differences_are_told_and_drawn(tmp_path, monkeypatch, capsys):
    files = []
    for tension, friction, more in ((10.0, np.inf, 0.0), (40.0, 0.15, 2e-4)):
        law = march(paper_case(11.28, tension, -0.042), analytic_model("strip"), travel=4.0)
        content = {"a": 11.28, "tension": tension, "yaw": -0.042, "options": {"friction": friction}}
        content["curves"] = {"travel": law.travel.tolist(), "y": (law.y + more).tolist()}
        files.append(tmp_path / f"{tension}.json")
        files[-1].write_text(json.dumps(content))
    picture = tmp_path / "beside.png"
    monkeypatch.setattr(sys, "argv", ["beside", *map(str, files), "--picture", str(picture)])
    beside_the_law.main()
    told = capsys.readouterr().out.splitlines()
    assert told[0].startswith("10 N/mm2, friction inf, 4 m: at most 0.000 mm apart, 0.0 %")
    assert told[1].startswith("40 N/mm2, friction 0.15, 4 m: at most 0.200 mm apart")
    assert picture.stat().st_size > 10_000
    assert beside_the_law.read(files[0]).y == pytest.approx(beside_the_law.read(files[0]).law, abs=1e-9)
