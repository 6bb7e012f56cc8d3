"""The belt, its pulleys and the four points in Rerun's space."""

import math

import numpy as np
import rerun as rr

from belt_sim.case import Case
from belt_sim.frame import Frame
from belt_sim.pictures.colours import FAINT, INK, POINT_NAMES, POINTS, rgb
from belt_sim.watch import shape

#: Face of a pulley in belt widths, true to scale and enlarged; the axis stands out by STUB faces.
FACE_TRUE, FACE_DRAWN = 1.6, 3.2
STUB = 0.35
PULLEY = (176, 186, 197)
#: cylinders stand along z in Rerun; a pulley's axis lies along y
LYING = rr.RotationAxisAngle(axis=[1, 0, 0], radians=math.pi / 2)


class Scene:
    """One drawing of the machine under ``root``, with lateral movements and small angles times ``scale``."""

    def __init__(self, recording: rr.RecordingStream, root: str, case: Case, scale: float = 1.0) -> None:
        self.recording, self.root, self.case, self.scale = recording, root, case, scale
        self.full_tilt = shape.full_colour_tilt(case)
        self.stations = 0
        recording.log(root, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        radii = {"head": case.rig.head_radius, "tail": case.rig.tail_radius}
        for name, radius in radii.items():
            self._pulley(name, float(radius) - 0.5 * float(case.belt.thickness))

    def _pulley(self, name: str, radius: float) -> None:
        """A grey cylinder along y, its axis, and a faint line where an aligned axis would be."""
        width = (FACE_TRUE if self.scale == 1.0 else FACE_DRAWN) * float(self.case.belt.width)
        reach = (0.5 + STUB) * width
        path, log = f"{self.root}/{name}", self.recording.log
        body = rr.Cylinders3D(
            lengths=[width],
            radii=[0.985 * radius],
            rotation_axis_angles=[LYING],
            colors=[PULLEY],
            fill_mode="solid",
        )
        log(f"{path}/turned/pulley", body, static=True)
        axis = [[[0.0, -reach, 0.0], [0.0, reach, 0.0]]]
        log(f"{path}/turned/axis", rr.LineStrips3D(axis, colors=[rgb(INK)], radii=[0.006]), static=True)
        aligned = [[[0.0, -1.5 * reach, 0.0], [0.0, 1.5 * reach, 0.0]]]
        log(f"{path}/aligned", rr.LineStrips3D(aligned, colors=[rgb(FAINT)], radii=[0.002]), static=True)

    def frame(self, frame: Frame) -> None:
        """Draw one instant."""
        drawn = shape.enlarged(frame, self.scale)
        self._belt(drawn, shape.tilt(frame.left, frame.right))
        self._turn(drawn)
        self._points(drawn)

    def _belt(self, drawn: Frame, tilt: np.ndarray) -> None:
        """Both edges as closed line strips; between them a ribbon coloured by the true tilt."""
        log, n = self.recording.log, len(drawn.left)
        edges = [np.vstack([edge, edge[:1]]) for edge in (drawn.left, drawn.right)]
        log(f"{self.root}/belt/edges", rr.LineStrips3D(edges, colors=[rgb(INK)], radii=[0.003]))
        if n != self.stations:
            log(f"{self.root}/belt/ribbon", rr.Mesh3D.from_fields(triangle_indices=shape.ribbon_triangles(n)))
            self.stations = n
        colours = shape.tilt_colours(tilt, self.full_tilt)
        ribbon = rr.Mesh3D.from_fields(
            vertex_positions=np.vstack([drawn.left, drawn.right]), vertex_colors=np.vstack([colours, colours])
        )
        log(f"{self.root}/belt/ribbon", ribbon)

    def _turn(self, drawn: Frame) -> None:
        """Turn both pulleys about +z, put the tail pulley where it stands."""
        log = self.recording.log
        at = {"head": (0.0, drawn.yaw_head), "tail": (drawn.tail_x, drawn.yaw_tail)}
        for name, (x, yaw) in at.items():
            log(f"{self.root}/{name}", rr.Transform3D(translation=[x, 0.0, 0.0]))
            turn = rr.RotationAxisAngle(axis=[0, 0, 1], radians=yaw)
            log(f"{self.root}/{name}/turned", rr.Transform3D(rotation=turn))

    def _points(self, drawn: Frame) -> None:
        """Points 1-4; the view keeps all earlier dots of ``trail`` in sight."""
        colours = [rgb(c) for c in POINTS]
        dots = rr.Points3D(drawn.points, colors=colours, radii=[0.018], labels=[n[0] for n in POINT_NAMES])
        self.recording.log(f"{self.root}/points", dots)
        trail = rr.Points3D(drawn.points, colors=colours, radii=[0.01])
        self.recording.log(f"{self.root}/trail", trail)
