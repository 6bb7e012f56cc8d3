"""The contact scene in float32 on a GPU: ``python -m studies.bench.contact_warp SCENE.xml CASES [steps]``.

Needs mujoco-warp and warp-lang. Runs the scene in MuJoCo (float64, one core) and as a batch in MuJoCo Warp; prints y of
point 1 in both, and milliseconds a step. Compiling Warp's kernels takes some ten minutes, once a machine.
"""

import sys
import time

import mujoco
import numpy as np

MARKS = (11, 100, 500, 1000, 1500, 2000)  # steps after which y is compared
CONTACTS = 400  # at most, in a case


def without_instruments(path: str) -> mujoco.MjModel:
    """The scene without its sensors and the boxes that these see."""
    spec = mujoco.MjSpec.from_file(path)
    for sensor in list(spec.sensors):
        spec.delete(sensor)
    for geom in list(spec.geoms):
        if geom.classname is not None and geom.classname.name == "flag":
            spec.delete(geom)
    return spec.compile()


def point_1(model: mujoco.MjModel, places: np.ndarray) -> float:
    """y [um] where the upper span reaches the tail pulley's axis; places [m], (bodies, 3)."""
    names = [model.body(k).name for k in range(model.nbody)]
    nodes = [k for k, name in enumerate(names) if name.startswith("node-")]
    middle = places[np.array(nodes).reshape(-1, 2)].mean(axis=1)
    x = float(places[model.body("tail-pulley").id, 0])
    upper = middle[middle[:, 2] > 0.0]
    one, other = upper[np.argsort(np.abs(upper[:, 0] - x))[:2]]
    share = (x - one[0]) / (other[0] - one[0])
    return 1e6 * float(one[1] + share * (other[1] - one[1]))


def main(path: str, cases: int, steps: int) -> None:
    """Run both."""
    import mujoco_warp as mjw
    import warp as wp

    model = without_instruments(path)
    data = mujoco.MjData(model)
    key = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, "running")
    mujoco.mj_resetDataKeyframe(model, data, key)
    mujoco.mj_forward(model, data)
    on_gpu = mjw.put_model(model), mjw.put_data(model, data, nworld=cases, nconmax=CONTACTS, njmax=3 * CONTACTS)
    begun, wanted = time.process_time(), {}
    for n in range(1, steps + 1):
        mujoco.mj_step(model, data)
        if n in MARKS:
            wanted[n] = point_1(model, data.xpos)
    print(f"MuJoCo: {1e3 * (time.process_time() - begun) / steps:.2f} ms a step", flush=True)
    mjw.step(*on_gpu)
    with wp.ScopedCapture() as capture:
        mjw.step(*on_gpu)
    wp.synchronize()
    begun = time.perf_counter()
    for n in range(2, steps + 1):
        wp.capture_launch(capture.graph)
        if n in MARKS:
            y = point_1(model, on_gpu[1].xpos.numpy()[0].astype(float))
            print(f"step {n}: y_1 {y:.1f} um, MuJoCo {wanted[n]:.1f}", flush=True)
    wp.synchronize()
    took = 1e3 * (time.perf_counter() - begun) / steps
    print(f"Warp, {cases} cases: {took:.2f} ms a step, {took / cases:.4f} ms a case")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]) if len(sys.argv) > 3 else 2000)
