"""Effects on disk: what a diagnosis writes is read back, and what cannot be read is one line."""

import jax
import pytest

from belt_sim.effects.base import library
from belt_sim.effects.load import load_classes, load_effects, save_effects
from belt_sim.errors import BeltError
from belt_sim.io import MODEL_FOLDER

WIND = MODEL_FOLDER / "effects" / "wind.py"
ISSUE = {
    *("sag_roll", "yaw_offset_tail", "yaw_offset_head", "cant", "taper", "crown", "wobble", "soft_cover", "slip"),
    *("yaw_compliance", "tension_bias", "encoder_scale", "sensor_gain", "sensor_drift", "edge_profile"),
}
OWN = """
from dataclasses import dataclass
from belt_sim.effects.base import Effect, Parameter, effect

@effect
@dataclass(frozen=True, kw_only=True)
class Mine(Effect):
    id = "{id}"
    law = "run-up"
    parameters = {{"a": Parameter(unit="1", meaning="size", plausible=(-1, 1), scale=0.1)}}
    a: float = 0.0
"""


def test_the_library_has_every_effect_that_was_asked_for():
    assert set(library()) >= ISSUE


def test_no_two_effects_look_alike_to_jax():
    """Guard: jax 0.10.2 compares registered dataclasses without their type, and mixed up their compiled code."""
    structures = {}
    for name, cls in library().items():
        structure = jax.tree.structure(cls.null())
        assert structure not in structures, f"{name} is taken for {structures.get(structure)}"
        structures[structure] = name


def test_what_is_saved_is_read_back(tmp_path):
    numbers = [{"id": "taper", "kappa_t": 1 / 3e5}, {"id": "sensor_gain", "g1": 0.1, "g4": -0.02}]
    effects = load_effects(numbers)
    path = tmp_path / "effects.yaml"
    path.write_text(save_effects(effects, {"taper": {"kappa_t": 1e-7}}), encoding="utf-8")
    assert load_effects(str(path)) == effects
    assert "+- 1e-07 1/m" in path.read_text()


def test_nothing_is_saved_as_nothing(tmp_path):
    path = tmp_path / "effects.yaml"
    path.write_text(save_effects(()), encoding="utf-8")
    assert load_effects(str(path)) == ()


def test_ones_own_effect_is_saved_and_read_back(tmp_path):
    effects = load_effects([{"id": str(WIND), "load": 0.02}])
    path = tmp_path / "effects.yaml"
    path.write_text(save_effects(effects), encoding="utf-8")
    (back,) = load_effects(str(path))
    assert (back.id, back.load) == ("wind", 0.02)


def test_ones_own_effect_stands_beside_the_library():
    assert set(load_classes(["sag_roll", str(WIND)])) == {"sag_roll", "wind"}


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("def broken(:\n", "does not import"),
        ("import no_such_module_anywhere\n", "does not import"),
        ("x = 1\n", "defines no effect"),
        (OWN.format(id="taper"), "the library has an effect of this id"),
        (OWN.format(id="mine").replace('"run-up"', '"running"'), r"line \d+: Mine.law = 'running': use one of"),
        (OWN.format(id="mine").replace('"a":', '"b":'), "declare each once"),
        (OWN.format(id="mine").replace("(-1, 1)", "(-1, float('inf'))"), "Mine.a.plausible = .*both finite"),
        (
            OWN.format(id="mine").replace('"a":', '"runup":').replace("a: float", "runup: float"),
            "hooks have these names",
        ),
    ],
)
def test_a_file_that_cannot_be_used_is_one_line(tmp_path, text, says):
    path = tmp_path / "mine.py"
    path.write_text(text, encoding="utf-8")
    for _ in range(2):  # a second try says the same
        with pytest.raises(BeltError, match=says) as caught:
            load_classes([str(path)])
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("spec", "says"),
    [
        (["tapre"], "use one of"),
        (["taper", "taper"], "do nothing|once"),
        ([{"id": "taper", "kappa": 1.0}], "its parameters are"),
        ([{"id": "taper", "kappa_t": float("nan")}], "finite"),
        ([{"id": "taper", "kappa_t": 1e-5}, {"id": "taper", "kappa_t": 1e-5}], "once"),
        ("nowhere.yaml", "no such file"),
    ],
)
def test_a_wrong_request_is_one_line(spec, says):
    with pytest.raises(BeltError, match=says) as caught:
        load_effects(spec)
    assert "\n" not in str(caught.value)
