"""Watch a belt in Rerun: live in a viewer, or as a recording on disk."""

import os
import socket
import sys
from pathlib import Path

import rerun as rr

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.errors import BeltError
from belt_sim.frame import Frame
from belt_sim.watch.geometry import TRUE, view_scale_of
from belt_sim.watch.observers import has_display
from belt_sim.watch.scene import DRAWN_ROOT, TRUE_ROOT, Scene, frame_numbers, of_run, send_series

APPLICATION = "belt-sim"
DATA_PORT, VIEWER_PORT = 9876, 9090  # Rerun's own defaults
EVERY = 0.1  # [m] of travel between two readings
PICTURES = 100  # of the belt, at most, in a run


class RecordingFile:
    """An .rrd on disk: written beside its place, renamed when complete."""

    def __init__(self, path: str | os.PathLike) -> None:
        self.path = Path(path)
        self.draft = self.path.with_name(f".{self.path.name}.{os.getpid()}.part")
        self.recording: rr.RecordingStream | None = None

    def open(self, recording: rr.RecordingStream) -> None:
        """Send ``recording`` here; raises BeltError when the folder cannot be written."""
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            recording.save(self.draft)
        except (OSError, RuntimeError, ValueError) as cause:
            raise BeltError(f"recording {self.path}: cannot be written ({cause}); choose another folder") from cause
        self.recording = recording

    def close(self) -> None:
        """Complete the file and give it its name."""
        if self.recording is not None:
            self.recording.flush()
            self.recording.disconnect()
            os.replace(self.draft, self.path)


class RerunObserver:
    """Logs numbers each ``every`` [m] of travel, the belt at most PICTURES times.

    path: of the file (.rrd, open it with `rerun PATH`), which gets all at the end as columns, as a viewer reads them in
    a fraction of the time; None: a live viewer gets every instant as it comes, Rerun's own window or, where there is no
    display, a web viewer whose address is printed to standard error.
    """

    def __init__(self, path: str | os.PathLike | None = None, *, every: float = EVERY) -> None:
        self.file = None if path is None else RecordingFile(path)
        self.every = self.every_picture = every
        self.recording: rr.RecordingStream | None = None
        self.scenes: list[Scene] = []
        self.rows: list[tuple[float, float, dict[str, float]]] = []
        self.pictures: list[Frame] = []
        self.styled: set[str] = set()
        self.last = self.last_picture = float("-inf")

    def start(self, case: Case, travel: float) -> None:
        """Open the file or a viewer, send the blueprint and all that does not move; raises BeltError."""
        self.recording, scale = rr.RecordingStream(APPLICATION), view_scale_of(case, travel)
        if self.file is None:
            _open_viewer(self.recording)
        else:
            self.file.open(self.recording)
        self.every_picture = max(self.every, travel / PICTURES)
        rr.send_blueprint(of_run(case, travel, scale, self.file is None), recording=self.recording)
        self.scenes = [Scene(self.recording, root, case, s) for root, s in ((TRUE_ROOT, TRUE), (DRAWN_ROOT, scale))]

    def frame(self, frame: Frame) -> None:
        """Log this instant, unless the last one is less than ``every`` [m] of travel ago."""
        if self.recording is None or frame.travel - self.last < self.every * (1.0 - 1e-6):
            return
        self.last = frame.travel
        self.rows.append((frame.travel, frame.time, frame_numbers(frame)))
        if frame.travel - self.last_picture >= self.every_picture * (1.0 - 1e-6):
            self.last_picture = frame.travel
            self.pictures.append(frame)
        if self.file is None:
            self._send(self.recording)

    def _send(self, recording: rr.RecordingStream) -> None:
        send_series(recording, self.rows, self.styled)
        for scene in self.scenes if self.pictures else ():
            scene.frames(self.pictures)
        self.rows, self.pictures = [], []

    def finish(self, curves: Curves) -> None:
        """Flush and close; a file gets its name only now."""
        if self.recording is not None:
            self._send(self.recording)
            self.recording.flush()
            if self.file is not None:
                self.file.close()


def _open_viewer(recording: rr.RecordingStream) -> None:
    """Send the recording to a window, or serve it and a web viewer from this process, for as long as it lives."""
    try:
        if has_display():
            recording.spawn()
            return
        address = rr.serve_grpc(recording=recording, grpc_port=_free_port(DATA_PORT))
        web_port = _free_port(VIEWER_PORT)
        rr.serve_web_viewer(web_port=web_port, open_browser=False, connect_to=address)
        print(f"watch = rerun: open http://localhost:{web_port}/?url={address} in a browser", file=sys.stderr)
    except (RuntimeError, OSError, ValueError) as cause:
        reason = str(cause).strip().splitlines()[0]
        raise BeltError(f"watch = rerun: no viewer could be opened ({reason}); use watch=rrd") from cause


def _free_port(wanted: int) -> int:
    """``wanted`` if nobody listens there, else any free port: two runs may be watched at once."""
    for port in (wanted, 0):
        with socket.socket() as probe:
            try:
                probe.bind(("0.0.0.0", port))
            except OSError:
                continue
            return probe.getsockname()[1]
    raise OSError("no free port")
