"""What is seen of a scene in MuJoCo's own viewer: light, floor, materials, cameras, and the belt at its real width,
as a skin that the line of its nodes, which stand nearer together than the edges, cuts at +-b/2."""

import math
import time
from typing import Any

import mujoco
import numpy as np

from belt_sim.space.scene import SceneLayout, node_name

_ROOM = 0.5  # [m] beyond the machine
_STRIPE = 0.25  # [m] of belt of one colour
_SPOKES, _SPOKE = 4, (0.012, 0.0015)  # stripes on a pulley: half width [m], how far they stand out [m]
_DRAWN_BELOW = 4e-3  # [m] of a pulley's drawn surface under the one that the belt meets: no flicker
_NO_DAMPING = 1e-12  # [s]: MuJoCo warns of a flex that nothing holds, and counts no elastic2d


def furnish(spec: mujoco.MjSpec, scene: SceneLayout) -> None:
    """Add all that is seen, has a size and touches nothing of the belt; the shadows of both spans overlap."""
    length, lowest = float(scene.case.rig.centre_distance), float(scene.loop.z.min())
    head, tail = scene.loop.radius_head, scene.loop.radius_tail
    radius = max(head, tail)
    spec.stat.center, spec.stat.extent = [0.5 * length, 0.0, 0.0], 1.15 * (length + head + tail)
    down = np.array([0.0, 0.8 * min(0.6 * float(scene.case.belt.width) / (radius - lowest), 0.6), -0.8])
    above = np.array([0.5 * length, 0.0, 0.0]) - 4.0 * down  # no shadow along x: the floor shades itself there
    sun = spec.worldbody.add_light(name="sun", pos=above, dir=down, type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL)
    sun.diffuse, sun.specular, sun.castshadow = [0.4] * 3, [0.15] * 3, True
    floor = spec.worldbody.add_geom(name="floor", type=mujoco.mjtGeom.mjGEOM_PLANE, material="floor")
    floor.pos, floor.size = [0.5 * length, 0.0, lowest - 2.0 * radius], [0.0, 0.0, 0.1]  # without end
    floor.contype, floor.conaffinity = 0, 1
    _dress_machine(spec, {"head": head, "tail": tail}, length, lowest)
    if scene.mesh.lines > 1:
        _add_skin(spec, scene)
        for flex in spec.flexes:
            flex.group, flex.damping = 3, _NO_DAMPING


def _dress_machine(spec: mujoco.MjSpec, radii: dict[str, float], length: float, lowest: float) -> None:
    """Drums with stripes along them and across their faces, axles; cameras: ``overview`` along the belt, ``side`` and
    ``above`` to scale, ``tail`` and ``head`` near the pulleys."""
    cylinder, box, across = mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_BOX, [math.sqrt(0.5)] * 2 + [0.0] * 2
    plain = {"contype": 0, "conaffinity": 0, "mass": 0.0, "group": 1}
    for name, radius in radii.items():
        pulley, drawn = spec.body(f"{name}-pulley"), radius - _DRAWN_BELOW
        half = float(spec.geom(f"{name}-shell").size[1])
        spec.delete(spec.geom(f"{name}-mark"))
        for end in ("top", "bottom"):
            spec.site(f"{name}-{end}").group = 4
        seen = [
            (f"{name}-drum", cylinder, [drawn, half, 0.0], across, "pulley"),
            (f"{name}-shaft", cylinder, [0.03, half + 0.06, 0.0], across, "axle"),
        ]
        width, out = _SPOKE
        for k in range(_SPOKES):
            angle = k * math.pi / _SPOKES
            turned = [math.cos(0.5 * angle), 0.0, math.sin(0.5 * angle), 0.0]
            seen.append((f"{name}-stripe-{k}", box, [width, half + out, drawn + out], turned, "stripe"))
        for title, shape, size, quat, material in seen:
            pulley.add_geom(name=title, type=shape, size=size, quat=quat, material=material, **plain)

    radius = max(radii.values())
    middle = np.array([0.5 * length, 0.0, 0.5 * (radius + lowest)])
    flat = (length + 2.0 * radius + _ROOM) * 9.0 / 16.0  # height of a picture of 16:9 that is as wide as the machine
    views = {
        "overview": (np.array([length + 1.3 + 0.08 * length, -1.1 - 0.08 * length, 0.85 + 0.07 * length]),
                     np.array([(0.72 if length > 4.0 else 0.55) * length, 0.0, -0.05]), 0.0),
        "side": (middle + np.array([0.0, -2.0 - length, 0.35 * length]), middle, flat),
        "above": (middle + np.array([0.0, 0.0, length + 2.0]), middle, flat),
        "tail": (np.array([length + 0.75, -1.0, 0.65]), np.array([length - 0.15, 0.0, 0.0]), 0.0),
        "head": (np.array([-0.75, -1.0, 0.65]), np.array([0.15, 0.0, 0.0]), 0.0),
    }  # fmt: skip
    for name, (at, towards, height) in views.items():
        back = (at - towards) / np.linalg.norm(at - towards)
        right = np.cross([0.0, 1.0, 0.0] if name == "above" else [0.0, 0.0, 1.0], back)
        right /= np.linalg.norm(right)
        camera = spec.worldbody.add_camera(name=name, pos=at, xyaxes=[*right, *np.cross(back, right)])
        camera.fovy = height or 45.0
        if height:
            camera.proj = mujoco.mjtProjection.mjPROJ_ORTHOGRAPHIC


def _add_skin(spec: mujoco.MjSpec, scene: SceneLayout) -> None:
    """The belt between its real edges; vertices and faces stand there twice, for a face is seen from one side only."""
    mesh = scene.mesh
    beyond = 0.25 * float(scene.case.belt.width) / float(mesh.line_y[0]) - 0.5  # of the nodes' distance
    n, last = mesh.stations, mesh.lines - 1
    at = np.arange(n + 1) % n  # the first station again, at the other end of the texture
    outer = mesh.rest[at][:, [0, last]]
    edges = outer + beyond * (outer - outer[:, ::-1])
    skin = spec.add_skin(name="belt", material="belt")
    skin.vert = 2 * edges.ravel().tolist()
    u = np.arange(n + 1) * round(n * scene.loop.chord / _STRIPE / 2.0) / n
    skin.texcoord = 2 * np.stack([np.repeat(u, 2), np.tile([0.1, 0.4], n + 1)], axis=1).ravel().tolist()
    inner = 2 * (n + 1)
    outside = 2 * np.arange(n)[:, None] + np.array([0, 1, 2, 2, 1, 3])
    skin.face = np.concatenate([outside, outside[:, ::-1] + inner]).ravel().tolist()
    skin.bodyname = [node_name(i, j) for i in range(n) for j in (0, last)]
    skin.bindpos = mesh.rest[:, [0, last]].ravel().tolist()
    skin.bindquat = [1.0, 0.0, 0.0, 0.0] * (2 * n)
    bound = [[f + 2 * v + side for f in (0, inner) for v in ((0, n) if i == 0 else (i,)) for side in (0, 1)]
             for i in range(n)]  # fmt: skip
    skin.vertid = [own for own in bound for _ in (0, 1)]
    skin.vertweight = [[1.0 + beyond if v % 2 == side else -beyond for v in own] for own in bound for side in (0, 1)]


#: what a belt is coloured by: name -> unit, and how many of it a value of SI is
COLOURED_BY = {"tilt": ("mrad", 1e3), "edge stress": ("N/mm2", 1e-6)}
_BLUE_RED = np.array([[0.16, 0.36, 0.78], [0.88, 0.89, 0.90], [0.80, 0.20, 0.16]])  # at -1, 0 and 1 of the scale
_BAND, _LIFTED = 10, 2e-3  # stations of one brightness; [m] by which the drawn belt lies outside the nodes
_GHOST = 0.45  # opacity


class DrawnBelt:
    """The belt of a scene as coloured boxes between its stations: tilt of the sections against what they lie on or hang
    in, + where the edge at y > 0 is higher, or bending stress of that edge (+: pull)."""

    def __init__(self, model: mujoco.MjModel, by: str = "tilt") -> None:
        self.by, self.most = by, 0.0
        names = [model.body(i).name for i in range(model.nbody)]
        numbers = [i for i, name in enumerate(names) if name.startswith("node-")]
        self.nodes = np.array(numbers).reshape(-1, 1 + max(int(names[i].split("-")[2]) for i in numbers))
        at = model.text_adr[mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_TEXT, "belt_sim case")]
        text = bytes(model.text_data[at:]).split(b"\0")[0].decode()
        made = dict(entry.split(" = ") for entry in text.split("; "))
        self.width, self.modulus = (float(made[f"belt.{name}"]) for name in ("width", "youngs_modulus"))
        self.middle: Any = None

    def read(self, data: mujoco.MjData) -> None:
        """Take places [m] and colours of all links from what MuJoCo has."""
        edges = data.xpos[self.nodes][:, [0, -1]]
        middle, across = edges.mean(axis=1), edges[:, 0] - edges[:, 1]
        along = np.roll(middle, -1, axis=0) - np.roll(middle, 1, axis=0)
        along /= np.linalg.norm(along, axis=1, keepdims=True)
        apart = np.linalg.norm(across, axis=1, keepdims=True)
        across = across / apart
        out = np.cross(along, [0.0, 1.0, 0.0])
        if self.by == "tilt":
            value = np.where(out[:, 2] > 0.0, 1.0, -1.0) * (across * out).sum(axis=1)
        else:
            lengths = np.linalg.norm(np.roll(edges, -1, axis=0) - edges, axis=2)
            value = 0.5 * self.modulus * self.width * np.diff(-lengths)[:, 0] / (lengths.mean(axis=1) * apart[:, 0])
        self.most = max(self.most, float(np.abs(value).max()), 1e-12)
        self.middle, self.along, self.across, self.out, self.value = middle, along, across, out, value

    def draw(self, picture: mujoco.MjvScene, times: float = 1.0) -> None:
        """Add the belt to a picture; times: of its lateral movement; more than 1 is drawn as a ghost."""
        share = np.abs(self.value)[:, None] / self.most
        full = np.where(self.value[:, None] > 0.0, _BLUE_RED[2], _BLUE_RED[0])
        colours = _BLUE_RED[1] + share * (full - _BLUE_RED[1])
        colours *= np.where(np.arange(len(share)) // _BAND % 2, 1.0, 0.85)[:, None]
        ghost = times > 1.0
        rgba = np.hstack([colours, np.full((len(share), 1), _GHOST if ghost else 1.0)]).astype(np.float32)
        nodes = self.middle + _LIFTED * self.out
        nodes[:, 1] *= times
        after = np.roll(nodes, -1, axis=0)
        centre, link = 0.5 * (nodes + after), after - nodes
        length = np.linalg.norm(link, axis=1, keepdims=True)
        link, across = link / length, self.across if not ghost else np.broadcast_to([0.0, 1.0, 0.0], link.shape)
        normal = np.cross(link, across)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        frames = np.stack([link, np.cross(normal, link), normal], axis=2).reshape(-1, 9)
        for k in range(min(len(nodes), picture.maxgeom - picture.ngeom)):
            size = np.array([0.51 * length[k, 0], 0.5 * self.width, 1e-3])
            geom = picture.geoms[picture.ngeom]
            mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_BOX, size, centre[k], frames[k], rgba[k])
            picture.ngeom += 1


_TIMES, _PICTURE = 60.0, 1.0 / 30.0  # of the ghost; [s] between pictures
_SPACE, _F8, _F9 = 32, 297, 298  # keys that MuJoCo's viewer leaves alone
_KEYS = "F8: ghost 60 times aside, F9: colour, space: stop"


def play(mjcf: str) -> None:
    """Run a scene in MuJoCo's viewer, in real time where the computer can, until its window is closed."""
    import mujoco.viewer

    model = mujoco.MjModel.from_xml_string(mjcf)
    data, belt, names, pressed = mujoco.MjData(model), DrawnBelt(model), list(COLOURED_BY), {_SPACE: False, _F8: False}

    def press(key: int) -> None:
        if key in pressed:
            pressed[key] = not pressed[key]
        elif key == _F9:
            belt.by, belt.most = names[names.index(belt.by) - 1], 0.0

    with mujoco.viewer.launch_passive(model, data, key_callback=press, show_left_ui=False) as window:
        window.opt.skingroup[0] = 0  # the belt is drawn below
        mujoco.mjv_defaultFreeCamera(model, window.cam)
        while window.is_running():
            began, until = time.monotonic(), data.time + _PICTURE
            with window.lock():
                while not pressed[_SPACE] and data.time < until and time.monotonic() - began < _PICTURE:
                    mujoco.mj_step(model, data)
                belt.read(data)
                window.user_scn.ngeom = 0
                for times in (1.0,) if pressed[_F8] else (1.0, _TIMES):
                    belt.draw(window.user_scn, times)
            y = [500.0 * np.diff([data.sensor(f"edge-{p}-{s}").data[0] for s in ("left", "right")])[0] for p in (1, 3)]
            unit, per = COLOURED_BY[belt.by]
            colours = f"{belt.by} -{per * belt.most:.3g} (blue) to {per * belt.most:.3g} {unit} (red)"
            told = f"{y[0]:+.2f} mm\n{y[1]:+.2f} mm\n{colours}\n{_KEYS}"
            font, corner = mujoco.mjtFontScale.mjFONTSCALE_150, mujoco.mjtGridPos.mjGRID_BOTTOMLEFT
            window.set_texts((font, corner, "y at point 1\ny at point 3\ncolour\nkeys", told))
            window.sync()
            time.sleep(max(_PICTURE - (time.monotonic() - began), 0.0))
