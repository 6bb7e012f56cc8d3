"""Runs of the study are set beside the strip law that belongs to them."""

import json

import numpy as np
import pytest

from belt_sim.curves import Curves, write_curves
from belt_sim.line.march import march_case
from belt_sim.model import analytic_model
from belt_sim.settings import case_from
from studies import beside_the_law


def test_differences_are_told_and_drawn(configuration, tmp_path, capsys):
    for tension, friction, more in ((10.0, np.inf, 0.0), (40.0, 0.15, 2e-4)):
        config = configuration("space_run", "name=made_up", f"tension={tension}")
        law = march_case(case_from(config), analytic_model("strip"), travel=4.0)
        path = tmp_path / f"{tension}.json"
        path.write_text(json.dumps({"config": config, "options": {"friction": friction, "dx": 0.025}}))
        write_curves(path.with_suffix(".csv"), Curves(travel=law.travel, y=law.y + more))
    picture = tmp_path / "beside.png"
    beside_the_law.beside_the_law({"files": str(tmp_path / "*.json"), "picture": picture, "windows": [[1, 4]]})
    told = capsys.readouterr().out.splitlines()
    assert told[0].startswith("10 N/mm2, friction inf, 4 m, stations 25 mm: at most 0.000 mm apart, 0.0 %")
    assert told[2].startswith("40 N/mm2, friction 0.15, 4 m, stations 25 mm: at most 0.200 mm apart")
    seen, law = (part.split()[-4:] for part in told[3].replace(" mm/m", "").split(", strip law"))
    assert "1-4 m" in told[3]
    assert [float(s) for s in seen] == pytest.approx([float(s) for s in law], abs=1.1e-4)
    assert picture.stat().st_size > 10_000
    read = beside_the_law.read(tmp_path / "10.0.json")
    assert read.y == pytest.approx(read.law, abs=1e-9)
