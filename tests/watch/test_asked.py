"""Rerun is an extra: without it a diagnosis goes on, and who asks for a recording is told how to get it."""

import pytest

from belt_sim.errors import InputError
from belt_sim.watch import asked
from belt_sim.watch.asked import watch_asked


def test_with_rerun_all_is_recorded(capsys):
    assert watch_asked("auto", "auto", "rrd") == "rrd"
    assert watch_asked("rerun", "rrd", "rerun") == "rerun"
    assert watch_asked(None, "rrd") is None
    assert capsys.readouterr().out == ""


def test_without_it_auto_says_so_and_rrd_is_refused(monkeypatch, capsys):
    monkeypatch.setattr(asked, "find_spec", lambda name: None)
    assert watch_asked("auto", "auto", "rrd") is None
    assert capsys.readouterr().out == "no recording: it needs Rerun: pip install 'belt-sim[watch]'\n"
    assert watch_asked(None, "rrd") is None
    with pytest.raises(InputError, match=r"watch = rrd: needs Rerun: pip install 'belt-sim\[watch\]'"):
        watch_asked("rrd", "auto", "rrd")


def test_an_unknown_word_is_refused():
    with pytest.raises(InputError, match="watch = vhs: use null, rrd or rerun"):
        watch_asked("vhs", "rrd", "rerun")
