"""The scene as an MJCF file that loads as the model that was run, to the last digit.

MuJoCo writes six digits: at 10 m from the origin that is 5 um, a strain of 2e-4 between stations 25 mm apart, as much
as the belt's own. So the numbers that the belt is made of are written again in full.
"""

import xml.etree.ElementTree as ET
from collections.abc import Iterable
from pathlib import Path

import mujoco

from belt_sim.mujoco3d.scene import flex_tied_to_nothing


def write_scene(spec: mujoco.MjSpec, path: Path) -> None:
    """Write a compiled specification; the file appears whole or not at all."""
    unfinished = path.with_suffix(".part")
    unfinished.write_text(mjcf(spec))
    unfinished.rename(path)


def mjcf(spec: mujoco.MjSpec) -> str:
    """The MJCF text with places, masses, rest lengths and stiffnesses in full."""
    with flex_tied_to_nothing():
        tree = ET.fromstring(spec.to_xml())
    bodies = {b.name: b for b in spec.bodies}
    for element in tree.iter("body"):
        body, inertial = bodies[element.get("name", "")], element.find("inertial")
        element.set("pos", _full(body.pos))
        if inertial is not None:
            inertial.set("mass", _full([body.mass]))
    tendons = {t.name: t for t in spec.tendons}
    for element in tree.iter("spatial"):
        bond = tendons[element.get("name", "")]
        element.set("springlength", _full(bond.springlength[:1]))
        element.set("stiffness", _full(bond.stiffness[:1]))
    for element, flex in zip(tree.iter("elasticity"), spec.flexes, strict=True):
        element.set("thickness", _full([flex.thickness]))
    for element, key in zip(tree.iter("key"), spec.keys, strict=True):
        element.set("qpos", _full(key.qpos))
    return ET.tostring(tree, encoding="unicode")


def _full(numbers: Iterable[float]) -> str:
    return " ".join(repr(float(v)) for v in numbers)
