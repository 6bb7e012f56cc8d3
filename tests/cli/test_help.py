"""What the command line says of itself, and the file of a new effect."""

import os
import subprocess
import sys

import numpy as np
import pytest

import belt_sim as bs
from belt_sim.commands import COMMANDS, help_text
from belt_sim.commands.cli import new_effect, run_command

OWN_HELP = ("completion", "demo", "new-effect")


@pytest.mark.parametrize("command", sorted(set(COMMANDS) - {*OWN_HELP}))
def test_help_names_every_key_and_nothing_of_hydra(command):
    text = help_text(command)
    assert text.startswith(f"belt-sim {command}")
    assert not {"defaults:", "_self_", "override", "???"} & set(text.split())


@pytest.mark.parametrize("command", OWN_HELP)
def test_commands_without_settings_have_help_too(command, capsys):
    assert run_command([command, "--help"]) == 0
    assert f"usage: {'eval' if command == 'completion' else 'belt-sim ' + command}" in capsys.readouterr().out


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_help_fits_a_window_of_80_columns(command, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    assert run_command([command, "--help"]) == 0
    assert not [line for line in capsys.readouterr().out.splitlines() if len(line) > 80]


def test_help_gives_units():
    rows = {line.split("=")[0].strip(): line for line in help_text("simulate").splitlines() if "=" in line}
    assert rows["tension"].endswith("N/mm2")
    assert rows["rig.centre_distance"].endswith(" m")


def test_a_missing_campaign_is_asked_for_with_what_can_be_given(capsys):
    assert run_command(["compare"]) == 1
    said = capsys.readouterr().err
    assert "slack_belt" in said
    assert "folder of a campaign" in said


def test_a_new_effect_is_whole_and_does_what_its_twin_does(tmp_path):
    path = new_effect("side_gust", tmp_path)
    mine = bs.simulate(tension=10, travel=2.0, effects=[{"id": str(path), "load": 0.01}])
    wind = bs.simulate(tension=10, travel=2.0, effects=[{"id": "models/effects/wind.py", "load": 0.01}])
    assert [e.id for e in mine.effects] == ["side_gust"]
    np.testing.assert_array_equal(mine.curves.y, wind.curves.y)
    for name in ("side_gust", "taper", "Bad-Name", "class"):
        with pytest.raises(bs.InputError):
            new_effect(name, tmp_path)


def test_mappings_name_only_what_differs_from_the_standard():
    short = bs.make_case(rig={"centre_distance": 8})
    assert (short.rig.centre_distance, short.rig.head_radius) == (8.0, bs.make_case().rig.head_radius)
    with pytest.raises(bs.InputError, match=r"rig\.centre_distanc = 8: use one of centre_distance"):
        bs.make_case(rig={"centre_distanc": 8})


@pytest.mark.parametrize("stops", ["raise KeyboardInterrupt", "signal.raise_signal(signal.SIGTERM)"])
def test_ctrl_c_or_a_time_limit_is_one_line_and_a_second_one_ends_what_threads_still_compute(stops):
    stopped = f"""
import atexit, signal
from belt_sim.commands import cli
def stop(*arguments): {stops}
cli.run_hydra = stop
atexit.register(lambda: print(signal.getsignal(signal.SIGINT) is signal.getsignal(signal.SIGTERM) is signal.SIG_DFL))
cli.main()
"""
    found = subprocess.run([sys.executable, "-c", stopped, "simulate"], capture_output=True, text=True, check=False)
    assert found.returncode == 130
    assert found.stdout.split() == ["True"]
    assert found.stderr == "belt-sim: stopped; what was finished is kept\n"


def test_ctrl_c_while_the_command_line_loads_is_one_line(tmp_path):
    (tmp_path / "yaml.py").write_text("raise KeyboardInterrupt\n")
    paths = os.pathsep.join([str(tmp_path), *sys.path])
    asked = [sys.executable, "-m", "belt_sim", "simulate"]
    found = subprocess.run(asked, capture_output=True, text=True, check=False, env=os.environ | {"PYTHONPATH": paths})
    assert (found.returncode, found.stderr) == (130, "belt-sim: stopped before it began\n")
