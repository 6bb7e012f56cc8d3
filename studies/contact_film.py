"""The belt that contacts carry as a film: ``python -m studies.contact_film``, of MuJoCo's renderer.

Runs models/scenes/short_rig.xml in plain MuJoCo, straight for a while, then yawed. What is drawn: y of the belt's
middle, yaw of pulley and sections EXAGGERATED times, the belt at its real width (the nodes stand nearer together).
"""

import os

os.environ.setdefault("MUJOCO_GL", "egl")  # before mujoco is loaded: no window is needed

import mujoco
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from belt_sim.io import MODELS, ROOT, write_with
from belt_sim.settings import make_case
from belt_sim.units import MM

IMAGES = ROOT / "docs" / "images"
EXAGGERATED = 60.0
YAW, YAWED_AT, END, EVERY = 0.042, 0.15, 2.4, 0.05  # degrees; m of travel: yaw, end, between frames
SIZE, COLOURS, PACE = (720, 405), 96, 110  # pixels; of the palette; ms a frame
SHOWN = (0.15, 0.9, 1.65, 2.4)  # [m], of the frames on the strip


def main() -> None:
    film, strip = IMAGES / "belt_by_contact.gif", IMAGES / "belt_by_contact.png"
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
    model = mujoco.MjModel.from_xml_path(str(MODELS / "scenes" / "short_rig.xml"))
    data, seen = mujoco.MjData(model), mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("running").id)
    rig = make_case(rig="rope_example").rig
    nodes = np.array([i for i in range(model.nbody) if model.body(i).name.startswith("node-")]).reshape(-1, 2)
    yaw, travel, frame_due = data.actuator("tail_yaw"), 0.0, 0.0
    with mujoco.Renderer(model, SIZE[1], SIZE[0]) as renderer:
        look = view()
        while travel < END:
            yaw.ctrl[0] = 0.0 if travel >= YAWED_AT else -YAW  # the slider adds to the case's yaw
            mujoco.mj_step(model, data)
            travel = float(data.sensor("head-spin").data[0]) * float(rig.head_radius)
            if travel >= frame_due:
                frame_due += EVERY
                edges = [[data.sensor(f"edge-{p}-{side}").data[0] for side in ("left", "right")] for p in (1, 3)]
                yield travel, picture(model, data, seen, nodes, renderer, look, travel, 0.5 * np.diff(edges)[:, 0])


def view() -> tuple[mujoco.MjvCamera, mujoco.MjvOption]:
    """From above the tail pulley, along the belt, without rays."""
    camera, option = mujoco.MjvCamera(), mujoco.MjvOption()
    camera.lookat, camera.distance, camera.azimuth, camera.elevation = [1.0, 0.0, -0.1], 2.25, 125.0, -38.0
    option.flags[mujoco.mjtVisFlag.mjVIS_RANGEFINDER] = False
    return camera, option


def picture(model, data, seen, nodes, renderer, look, travel: float, y: np.ndarray) -> Image.Image:
    """One frame."""
    seen.qpos[:] = data.qpos
    for name in ("head-yaw", "tail-yaw"):
        seen.joint(name).qpos *= EXAGGERATED
    mujoco.mj_kinematics(model, seen)
    mujoco.mj_camlight(model, seen)
    places = data.xpos[nodes]
    middle = places.mean(axis=1, keepdims=True)
    aside = places - middle
    aside[..., 0] *= EXAGGERATED
    middle[..., 1] *= EXAGGERATED
    seen.xpos[nodes] = middle + aside  # the skin follows
    camera, option = look
    renderer.update_scene(seen, camera, option)
    image = Image.fromarray(renderer.render())
    moved = f"y at point 1 {y[0] / MM:+.2f} mm, point 3 {y[1] / MM:+.2f} mm"
    words = f"travel {travel:.2f} m    {moved}    drawn {EXAGGERATED:g} times"
    ImageDraw.Draw(image).text((12, SIZE[1] - 30), words, fill=(20, 30, 45), font=ImageFont.load_default(18))
    return image


if __name__ == "__main__":
    main()
