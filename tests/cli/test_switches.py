"""Every switch of every command takes true and false only; every setting of a model is obeyed or refused."""

import pytest
import yaml
from command import refusal

from belt_sim.io import CONF

NEEDED = {"campaign": "slack_belt", "diagnosis": "."}
SWITCHES = [
    (path.stem, key)
    for path in sorted(CONF.glob("*.yaml"))
    for key, value in yaml.safe_load(path.read_text(encoding="utf-8")).items()
    if isinstance(value, bool)
]


@pytest.mark.parametrize(("command", "key"), SWITCHES)
def test_no_is_not_yes(tmp_path, command, key):
    standard = yaml.safe_load((CONF / f"{command}.yaml").read_text(encoding="utf-8"))
    given = tuple(f"{k}={v}" for k, v in NEEDED.items() if k in standard)
    for value in ("no", "maybe", "1", "null") if (command, key) == SWITCHES[0] else ("no",):
        said = refusal(command, tmp_path, given, f"{key}={value}")
        assert said.startswith(f"{key} = ")
        assert "give true or false" in said


def test_there_are_switches():
    assert {key for _, key in SWITCHES} == {"pictures", "overwrite", "advise", "checked", "open", "verbose"}


@pytest.mark.parametrize(
    ("command", "setting"),
    [
        *(("compare", s) for s in ("model.step=-5", "model.step=0.02", "model.keep=1", "+model.nonsense=7")),
        ("check", "model.step=0.02"),
        ("diagnose", "model.keep=1"),
    ],
)
def test_a_model_beside_a_campaign_takes_no_settings_in_silence(tmp_path, command, setting):
    said = refusal(command, tmp_path, ("campaign=slack_belt", "model=beam_th2"), setting)
    assert said.startswith(f"{setting.strip('+').split('=')[0]} = ")
