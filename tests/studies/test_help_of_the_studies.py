"""Every ``python -m studies.NAME`` says with --help what it is for, and does nothing else."""

import runpy
import sys

import pytest

from belt_sim.io import ROOT

STUDIES = sorted(
    ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__main__")
    for path in (ROOT / "studies").rglob("*.py")
    if 'if __name__ == "__main__":' in path.read_text(encoding="utf-8")
)


@pytest.mark.parametrize("study", STUDIES)
def test_help_is_printed_before_anything_is_run(study, monkeypatch, capsys, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [study, "--help"])
    for name in (study, f"{study}.__main__"):  # another test may have imported it
        monkeypatch.delitem(sys.modules, name, raising=False)
    before = {path: path.stat().st_mtime_ns for path in (ROOT / "docs").rglob("*")}
    ends: list[object] = []
    try:
        runpy.run_module(study, run_name="__main__", alter_sys=True)
    except SystemExit as end:
        ends.append(end.code)
    assert ends in ([], [0])
    assert len(capsys.readouterr().out) > 60
    assert {path: path.stat().st_mtime_ns for path in (ROOT / "docs").rglob("*")} == before
    assert not list(tmp_path.iterdir())
