"""The belt that contacts carry as a film: ``python -m studies.contact_film FILM.gif FRAMES.png``, of MuJoCo's renderer.

Runs models/scenes/short_rig.xml in plain MuJoCo, straight for a while, then yawed. What is drawn: y of the belt's
middle, yaw of pulley and sections EXAGGERATED times, the belt at its real width (the nodes stand nearer together).
"""

import os
import sys
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "egl")  # before mujoco is loaded: no window is needed

import mujoco
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from belt_sim.config import make_case
from belt_sim.files import MODELS, write_with
from belt_sim.si import MM
from belt_sim.space.machine import HEAD_YAW, TAIL_YAW
from belt_sim.space.mujoco_interface import compile_model, silence_expected_warnings

EXAGGERATED = 60.0
YAW, YAWED_AT, END, EVERY = 0.042, 0.15, 2.4, 0.05  # degrees; m of travel: yaw, end, between frames
SIZE, COLOURS, PACE = (720, 405), 96, 110  # pixels; of the palette; ms a frame
STRIPE = 12  # every so many stations a stripe across the belt shows that it runs
SHOWN = (0.15, 0.9, 1.65, 2.4)  # [m], of the frames on the strip


def main() -> None:
    film, strip = Path(sys.argv[1]), Path(sys.argv[2])
    frames = list(shot())
    chosen = [min(frames, key=lambda f: abs(f[0] - s))[1] for s in SHOWN]
    sheet = Image.new("RGB", (2 * SIZE[0], 2 * SIZE[1]))
    for k, image in enumerate(chosen):
        sheet.paste(image, (k % 2 * SIZE[0], k // 2 * SIZE[1]))
    palette = sheet.quantize(COLOURS, method=Image.Quantize.MAXCOVERAGE)
    drawn = [image.quantize(palette=palette, dither=Image.Dither.NONE) for _, image in frames]
    rest = {"save_all": True, "append_images": drawn[1:], "duration": PACE, "loop": 0, "optimize": True}
    write_with(film, lambda path: drawn[0].save(path, "GIF", **rest))
    write_with(strip, lambda path: sheet.quantize(palette=palette).save(path, "PNG", optimize=True))


def shot():
    """Travel [m] and picture of every frame."""
    model = add_background(mujoco.MjSpec.from_file(str(MODELS / "scenes" / "short_rig.xml")))
    data, seen = mujoco.MjData(model), mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("running").id)
    rig = make_case(rig="rope_example").rig
    nodes = np.array([i for i in range(model.nbody) if model.body(i).name.startswith("node-")]).reshape(-1, 2)
    yaw, travel, frame_due = data.actuator("tail_yaw"), 0.0, 0.0
    with mujoco.Renderer(model, SIZE[1], SIZE[0]) as renderer:
        look = view()
        while travel < END:
            yaw.ctrl[0] = YAW if travel >= YAWED_AT else 0.0
            mujoco.mj_step(model, data)
            travel = float(data.sensor("head-spin").data[0]) * float(rig.head_radius)
            if travel >= frame_due:
                frame_due += EVERY
                y = [
                    0.5 * (data.sensor(f"edge-{p}-right").data[0] - data.sensor(f"edge-{p}-left").data[0])
                    for p in (1, 3)
                ]
                yield travel, picture(model, data, seen, nodes, renderer, look, travel, y)


def add_background(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """The scene before a plain background, pulleys darker than the belt."""
    spec.add_texture(
        name="sky", type=mujoco.mjtTexture.mjTEXTURE_SKYBOX, builtin=mujoco.mjtBuiltin.mjBUILTIN_FLAT,
        rgb1=[0.9, 0.92, 0.96], rgb2=[0.9, 0.92, 0.96], width=64, height=384,
    )  # fmt: skip
    spec.visual.global_.offwidth, spec.visual.global_.offheight = SIZE
    spec.flexes[0].rgba = [0.62, 0.68, 0.75, 1.0]
    for name in ("head", "tail"):
        spec.geom(f"{name}-shell").rgba = [0.3, 0.36, 0.44, 1.0]
    with silence_expected_warnings():
        return compile_model(spec)


def view() -> tuple[mujoco.MjvCamera, mujoco.MjvOption]:
    """From above the tail pulley, along the belt."""
    camera, option = mujoco.MjvCamera(), mujoco.MjvOption()
    camera.lookat, camera.distance, camera.azimuth, camera.elevation = [1.0, 0.0, -0.1], 2.25, 125.0, -38.0
    option.flags[mujoco.mjtVisFlag.mjVIS_FLEXSKIN] = True
    option.geomgroup[2] = option.sitegroup[2] = 0
    return camera, option


def picture(model, data, seen, nodes, renderer, look, travel: float, y: list[float]) -> Image.Image:
    """One frame."""
    seen.qpos[:] = data.qpos
    seen.qpos[[HEAD_YAW, TAIL_YAW]] *= EXAGGERATED
    mujoco.mj_kinematics(model, seen)
    mujoco.mj_camlight(model, seen)
    mujoco.mj_flex(model, seen)
    at = data.xpos[nodes]
    middle, half = at.mean(axis=1), 0.5 * (at[:, 0] - at[:, 1])
    half *= 0.1 / half[:, 1:2]
    half[:, 0] *= EXAGGERATED
    middle[:, 1] *= EXAGGERATED
    edges = np.stack([middle + half, middle - half], axis=1)
    seen.flexvert_xpos[:] = edges.reshape(-1, 3)
    camera, option = look
    renderer.update_scene(seen, camera, option)
    for k in range(0, len(edges), STRIPE):
        add_line(renderer.scene, *edges[k])
    image = Image.fromarray(renderer.render())
    moved = f"y at point 1 {y[0] / MM:+.2f} mm, point 3 {y[1] / MM:+.2f} mm"
    words = f"travel {travel:.2f} m    {moved}    drawn {EXAGGERATED:g} times"
    ImageDraw.Draw(image).text((12, SIZE[1] - 30), words, fill=(20, 30, 45), font=ImageFont.load_default(18))
    return image


def add_line(scene: mujoco.MjvScene, start: np.ndarray, end: np.ndarray) -> None:
    """A stripe across the belt."""
    geom = scene.geoms[scene.ngeom]
    mujoco.mjv_initGeom(
        geom,
        mujoco.mjtGeom.mjGEOM_CAPSULE,
        np.zeros(3),
        np.zeros(3),
        np.zeros(9),
        np.array([0.1, 0.3, 0.6, 1], np.float32),
    )
    mujoco.mjv_connector(geom, mujoco.mjtGeom.mjGEOM_CAPSULE, 4e-3, start, end)
    scene.ngeom += 1


if __name__ == "__main__":
    main()
