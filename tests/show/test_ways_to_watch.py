"""Rerun is an extra: without it a diagnosis goes on, and who asks for a recording is told how to get it."""

import pytest

from belt_sim.errors import InputError
from belt_sim.show import terminal
from belt_sim.show.terminal import resolve_watch


def test_with_rerun_all_is_recorded(capsys):
    assert resolve_watch("auto", "auto", "rrd") == "rrd"
    assert resolve_watch("rerun", "rrd", "rerun") == "rerun"
    assert resolve_watch(None, "rrd") is None
    assert capsys.readouterr().out == ""


def test_without_it_auto_says_so_and_rrd_is_refused(monkeypatch, capsys):
    monkeypatch.setattr(terminal, "find_spec", lambda name: None)
    assert resolve_watch("auto", "auto", "rrd") is None
    assert capsys.readouterr().out == "no recording: it needs Rerun: pip install 'belt-sim[watch]'\n"
    assert resolve_watch(None, "rrd") is None
    with pytest.raises(InputError, match=r"watch = rrd: needs Rerun: pip install 'belt-sim\[watch\]'"):
        resolve_watch("rrd", "auto", "rrd")


def test_an_unknown_word_is_refused():
    with pytest.raises(InputError, match="watch = vhs: use null, rrd or rerun"):
        resolve_watch("vhs", "rrd", "rerun")
