"""The lines of Python in the README run as they stand, and say what the README says that they do."""

import re

from small_campaign import campaign

import belt_sim as bs
from belt_sim.campaign import write_campaign
from belt_sim.io import ROOT


def test_the_lines_of_the_readme_run(tmp_path, monkeypatch, capsys):
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    code = re.search(r"## From Python\n.*?```python\n(.*?)```", text, re.DOTALL).group(1)
    assert len([line for line in code.splitlines() if line.strip()]) <= 7
    write_campaign(campaign("sag_roll"), tmp_path / "slack_belt")  # a shorter slack belt
    monkeypatch.chdir(tmp_path)
    names: dict = {}
    exec(code, names)  # the README's own lines
    assert [e.id for e in names["diagnosis"].effects] == ["sag_roll"]
    assert isinstance(names["again"], bs.Comparison)
    assert names["again"].error.fit.after < 0.1 * names["again"].error.fit.before
    assert (tmp_path / "slack.html").is_file()
    said = capsys.readouterr().out
    assert "Explained: Model beam_th2" in said
    assert "strip_lift_off, 10 N/mm2" in said
    assert not re.search("reservation|limit|too slack", said)
