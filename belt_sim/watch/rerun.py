"""Watch a belt in Rerun: live in a viewer, or as a recording on disk."""

import os
import socket
import sys
from collections.abc import Callable
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.errors import BeltError
from belt_sim.frame import Frame
from belt_sim.watch import series
from belt_sim.watch.geometry import TRUE, ViewScale, view_scale_of
from belt_sim.watch.observers import has_display
from belt_sim.watch.scene import DRAWN_ROOT, TRUE_ROOT, Scene, of_run

APPLICATION = "belt-sim"
DATA_PORT, VIEWER_PORT = 9876, 9090  # Rerun's own defaults
EVERY = 0.1  # [m] of travel between two readings
PICTURES = 100  # of the belt, at most, in a run


class RerunObserver:
    """Logs numbers each ``every`` [m], the belt at most PICTURES times.

    Where to is the business of ``open_sink(recording)`` and ``close_sink()``. live: every instant is sent as it comes;
    else all are sent at the end as columns, which a viewer reads in a fraction of the time.
    """

    def __init__(
        self,
        open_sink: Callable[[rr.RecordingStream], None],
        close_sink: Callable[[], None],
        *,
        every: float = EVERY,
        look: ViewScale | None = None,
        live: bool = True,
    ) -> None:
        self.live = live
        self.kept: list[tuple[float, float, dict[str, float]]] = []
        self.pictures: list[Frame] = []
        self.open_sink, self.close_sink, self.every, self.look = open_sink, close_sink, every, look
        self.between = every
        self.recording: rr.RecordingStream | None = None
        self.scenes: list[Scene] = []
        self.seen: set[str] = set()
        self.last = self.last_picture = float("-inf")

    def start(self, case: Case, travel: float) -> None:
        """Open the sink, send the blueprint and everything that does not move."""
        self.recording = rr.RecordingStream(APPLICATION)
        self.open_sink(self.recording)
        look, self.between = self.look or view_scale_of(case, travel), max(self.every, travel / PICTURES)
        send_blueprint(self.recording, of_run(case, travel, look, self.live))
        roots = ((TRUE_ROOT, TRUE), (DRAWN_ROOT, look))
        self.scenes = [Scene(self.recording, root, case, k) for root, k in roots]
        series.start(self.recording)

    def frame(self, frame: Frame) -> None:
        """Log this instant, unless the last one is less than ``every`` [m] of travel ago."""
        if self.recording is None or frame.travel - self.last < self.every * (1.0 - 1e-6):
            return
        self.last = frame.travel
        shown = frame.travel - self.last_picture >= self.between * (1.0 - 1e-6)
        self.last_picture = frame.travel if shown else self.last_picture
        row = frame.travel, frame.time, series.numbers(frame)
        if not self.live:
            self.kept.append(row)
            self.pictures += [frame] if shown else []
            return
        for scene in self.scenes if shown else ():
            scene.frames([frame])
        series.columns(self.recording, [row], self.seen)

    def finish(self, curves: Curves) -> None:
        """Flush and close; a file gets its name only now."""
        if self.recording is not None:
            if self.kept:
                series.columns(self.recording, self.kept, self.seen)
                for scene in self.scenes:
                    scene.frames(self.pictures)
            self.recording.flush()
            self.close_sink()


def send_blueprint(recording: rr.RecordingStream, layout: rrb.Blueprint) -> None:
    """Make ``layout`` the way in which the recording opens."""
    rr.send_blueprint(layout, recording=recording)


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


def to_file(path: str | os.PathLike, *, every: float = EVERY, look: ViewScale | None = None) -> RerunObserver:
    """Observer that writes ``path`` (.rrd), numbers each ``every`` [m]; open it with `rerun PATH`."""
    file = RecordingFile(path)
    return RerunObserver(file.open, file.close, every=every, look=look, live=False)


def live(
    *, every: float = EVERY, look: ViewScale | None = None, say: Callable[[str], None] | None = None
) -> RerunObserver:
    """Observer that shows the run in Rerun's own window or, where there is no display, in a web viewer.

    ``say`` gets one line with the viewer's address (default: standard error). ``start`` raises BeltError when
    no viewer can be opened.
    """

    def open_viewer(recording: rr.RecordingStream) -> None:
        try:
            if has_display():
                recording.spawn()
            else:
                _serve(recording, say or (lambda line: print(line, file=sys.stderr)))
        except (RuntimeError, OSError, ValueError) as cause:
            reason = str(cause).strip().splitlines()[0]
            raise BeltError(f"watch = rerun: no viewer could be opened ({reason}); use watch=rrd") from cause

    return RerunObserver(open_viewer, lambda: None, every=every, look=look)


def _serve(recording: rr.RecordingStream, say: Callable[[str], None]) -> None:
    """Serve the recording and the web viewer from this process, for as long as it lives."""
    address = rr.serve_grpc(recording=recording, grpc_port=_free_port(DATA_PORT))
    web_port = _free_port(VIEWER_PORT)
    rr.serve_web_viewer(web_port=web_port, open_browser=False, connect_to=address)
    say(f"watch = rerun: open http://localhost:{web_port}/?url={address} in a browser")


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
