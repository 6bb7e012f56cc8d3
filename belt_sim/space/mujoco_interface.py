"""Every assumption about MuJoCo 4.0, each with its own test in tests/space/test_mujoco_interface.py.

The discrete integrator treats joint springs implicitly: 1e13 N/m may hold a landed node. A step is one linear problem,
which MuJoCo factorises only when the model has an equality, a dummy one; its preliminary iterative solve is not needed.
"""

import math
import re
import warnings
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import mujoco
import numpy as np

from belt_sim.errors import SimulationError

#: flex.elastic2d = "stretch": membrane stiffness only; plate bending acts over 7-16 mm
STRETCH_ONLY = 2
#: what MuJoCo says, in an MjSpec, of a flex without equalities; the stiffness of ours is elastic2d's alone
_TIED_TO_NOTHING = "flex .* is not rigid"
#: what it says of its preliminary iterative solve, which the exact Newton step follows
_PRELIMINARY = re.compile("effective-metric block preconditioner|effective-metric solve failed to converge")
_ITERATIONS = 3  # bounds the preliminary solve
_CONTACT_ITERATIONS, _IMPRATIO = 50, 1e4


@dataclass
class Motion:
    """What MuJoCo integrates. joints, joint_rates, shape (p,): coordinates of what is not a node [m or rad];
    slides, slide_rates, shape (n, m, 3): of the nodes from their stress-free places [m], [m/s]."""

    joints: np.ndarray
    joint_rates: np.ndarray
    slides: np.ndarray
    slide_rates: np.ndarray


def set_solver(spec: mujoco.MjSpec, dt: float, gravity: float, lean: float | None = None, still: str = "") -> None:
    """One exact Newton step on the metric of the discrete integrator; dt [s], gravity [m/s2].

    still: the model's first joint, which stays where it is put and bears the dummy equality (see Solver.step); lean
    [rad], of the machine about +x: with contacts, of elliptic cones whose friction creeps by 2 um a metre at 1 m/s;
    None = without. A contact's spring may be stiffer than the step resolves (``refsafe`` is off).
    """
    option, off, touches, tilt = spec.option, mujoco.mjtDisableBit, lean is not None, lean or 0.0
    option.integrator, option.solver = mujoco.mjtIntegrator.mjINT_DISCRETE, mujoco.mjtSolver.mjSOL_NEWTON
    option.timestep, option.iterations = dt, _CONTACT_ITERATIONS if touches else _ITERATIONS
    option.gravity = [0.0, gravity * math.sin(tilt), -gravity * math.cos(tilt)]
    option.disableflags = int(off.mjDSBL_ISLAND) | int(off.mjDSBL_REFSAFE if touches else off.mjDSBL_CONTACT)
    if still:
        spec.add_equality(type=mujoco.mjtEq.mjEQ_JOINT, objtype=mujoco.mjtObj.mjOBJ_JOINT, name1=still)
    if touches:
        option.cone, option.impratio = mujoco.mjtCone.mjCONE_ELLIPTIC, _IMPRATIO


def compile_model(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """The model; it does not start anew by itself when an acceleration grows without bound."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=_TIED_TO_NOTHING)
        model = spec.compile()
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    return model


@contextmanager
def silence_expected_warnings() -> Iterator[None]:
    """Within it MuJoCo keeps to itself what it says of the preliminary solve, and passes on everything else."""
    before, others = mujoco.get_mju_user_warning(), []
    mujoco.set_mju_user_warning(lambda text: None if _PRELIMINARY.search(text) else others.append(text))
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
        for text in others:
            if before is None:
                warnings.warn(f"MuJoCo: {text}", stacklevel=2)
            else:
                before(text)


def make_step(model: mujoco.MjModel, data: mujoco.MjData) -> None:
    """A step of MuJoCo; raises SimulationError where coordinates or accelerations become infinite."""
    mujoco.mj_step(model, data)
    if data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number or not np.isfinite(data.qpos[-1]):
        raise SimulationError(f"the belt's acceleration grew without bound at {data.time:.3f} s: halve model.dt")


class Solver:
    """A compiled model whose last joints are the nodes' slides, three a node, and the memory of its integrator."""

    def __init__(self, model: mujoco.MjModel, shape: tuple[int, int, int]) -> None:
        """shape: (n, m, 3), of the nodes."""
        self.model, self.data, self.shape = model, mujoco.MjData(model), shape
        self.base = model.nq - math.prod(shape)

    def step(
        self, motion: Motion, rest: np.ndarray, stiffness: np.ndarray, forces: np.ndarray, joint_forces: np.ndarray
    ) -> None:
        """Move ``motion`` on by a step; rest [m], stiffness [N/m] of springs on the nodes' slides and forces [N] on the
        nodes, (n, m, 3), joint_forces [N or N m], (p,). Raises SimulationError when it grows without bound."""
        model, data, base = self.model, self.data, self.base
        data.qpos[:base], data.qpos[base:] = motion.joints, motion.slides.ravel()
        data.qvel[:base], data.qvel[base:] = motion.joint_rates, motion.slide_rates.ravel()
        model.qpos_spring[base:], model.jnt_stiffness[base:] = rest.ravel(), stiffness.ravel()
        data.qfrc_applied[:base], data.qfrc_applied[base:] = joint_forces, forces.ravel()
        model.eq_data[0, 0] = motion.joints[0]
        with silence_expected_warnings():
            make_step(model, data)
        motion.joints[:], motion.slides[:] = data.qpos[:base], data.qpos[base:].reshape(self.shape)
        motion.joint_rates[:], motion.slide_rates[:] = data.qvel[:base], data.qvel[base:].reshape(self.shape)

    def elastic_forces(self, slides: np.ndarray) -> np.ndarray:
        """Forces [N] of the belt's membrane or bonds on its nodes when they are at ``slides``, shape (n, m, 3).

        The force that a step leaves behind is that of the step's beginning, and the one it integrates is a tangent to
        it: a link that turns by an angle d within a step seems shorter by d^2 / 2, a third of its strain on a pulley.
        Here positions are taken as they are.
        """
        model, data = self.model, self.data
        data.qpos[self.base :] = slides.ravel()
        model.jnt_stiffness[self.base :] = 0.0
        for part in (mujoco.mj_kinematics, mujoco.mj_comPos, mujoco.mj_flex, mujoco.mj_tendon, mujoco.mj_passive):
            part(model, data)
        return data.qfrc_spring[self.base :].reshape(self.shape).copy()

    def tied_nodes(self) -> np.ndarray:
        """Numbers of the nodes (i m + j) at the ends of every edge or bond, shape (k, 2)."""
        if self.model.nflexedge:
            return np.array(self.model.flex_edge)
        first_node = self.model.nbody - math.prod(self.shape[:2])
        return self.model.site_bodyid[self.model.wrap_objid].reshape(-1, 2) - first_node

    def set_rest_lengths(self, lengths: np.ndarray) -> None:
        """Let these stress-free lengths [m] of edges or bonds, shape (k,), count from now on."""
        if self.model.nflexedge:
            self.model.flexedge_length0[:] = lengths
        else:
            self.model.tendon_lengthspring[:] = lengths[:, None]


#: at the top of the MJCF of a belt whose landed nodes are held
HELD_COMMENT = """ A belt laid round its pulleys: load the key frame "laid" and look, camera "side" or "above".
     What holds the belt on the pulleys - springs whose anchors turn with them - is set step by step by belt_sim and
     does not stand in this file: stepped by MuJoCo alone the belt falls off. belt-sim scene writes one that runs. """
#: what the parts of a scene are
_PARTS = {
    "worldbody": " head and tail pulley; then the belt: node-I-J is node J across its width at station I along it ",
    "deformable": " the belt's membrane: linear triangles of real steel between the nodes ",
    "tendon": " the bonds between the nodes ",
    "actuator": " the sliders ",
    "keyframe": " coordinates: the pulleys' joints, then x, y, z of every node from its stress-free place ",
}


def mjcf(spec: mujoco.MjSpec, comment: str = HELD_COMMENT) -> str:
    """A compiled specification as MJCF that loads as the model before its run: MuJoCo writes six digits, at 10 m from
    the origin 5 um, a strain of 2e-4 between stations 25 mm apart, so the belt's numbers are written again in full."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message=_TIED_TO_NOTHING)
        tree = ET.fromstring(spec.to_xml())

    def write_in_full(element: ET.Element | None, **values: Iterable[float]) -> None:
        if element is not None:
            element.attrib |= {name: " ".join(repr(float(v)) for v in numbers) for name, numbers in values.items()}

    bodies, tendons = ({one.name: one for one in several} for several in (spec.bodies, spec.tendons))
    for element in tree.iter("body"):
        body = bodies[element.get("name", "")]
        write_in_full(element, pos=body.pos)
        write_in_full(element.find("inertial"), mass=[body.mass])
    for element in tree.iter("spatial"):
        bond = tendons[element.get("name", "")]
        write_in_full(element, springlength=bond.springlength[:1], stiffness=bond.stiffness[:1])
    for element, flex in zip(tree.iter("elasticity"), spec.flexes, strict=True):
        write_in_full(element, thickness=[flex.thickness])
    for element, key in zip(tree.iter("key"), spec.keys, strict=True):
        write_in_full(element, qpos=key.qpos)
        if element.get("qvel"):
            element.set("qvel", " ".join(f"{v:.6g}" for v in key.qvel))
    for element in tree.findall("custom/text"):  # MuJoCo writes long ones where it does not read them
        element.set("data", element.get("data") or (element.text or "").strip())
        element.text = None
    for element in tree.findall("actuator/general"):  # MuJoCo writes motors as general, too
        if element.get("biastype") is None and element.get("gainprm") is None:
            element.tag = "motor"
    ET.indent(tree)
    tree.insert(0, ET.Comment(comment))
    tree[0].tail = "\n\n  "
    for part, said in _PARTS.items():
        at = next((at for at, element in enumerate(tree) if element.tag == part), None)
        if at is not None:
            tree.insert(at, ET.Comment(said))
            tree[at].tail = "\n  "
    return ET.tostring(tree, encoding="unicode")
