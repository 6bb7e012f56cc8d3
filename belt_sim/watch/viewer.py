"""Watch a 3D belt in MuJoCo's own viewer."""

import time
from typing import Any

import mujoco.viewer

from belt_sim.case import Case
from belt_sim.curves import Curves
from belt_sim.frame import Frame

_LOOK_EVERY = 0.1  # [s]


class ViewerObserver:
    """Shows the scene of a run in the passive viewer, which stays open until it is closed."""

    def __init__(self) -> None:
        self.window: Any = None

    def start(self, case: Case, travel: float) -> None:
        """The scene has not been built yet."""

    def show(self, model: Any, data: Any) -> None:
        """Open the window."""
        self.window = mujoco.viewer.launch_passive(model, data, show_left_ui=False)

    def frame(self, frame: Frame) -> None:
        """Draw the belt as it is now."""
        if self.window.is_running():
            self.window.sync()

    def finish(self, curves: Curves) -> None:
        """Wait until the window is closed."""
        while self.window is not None and self.window.is_running():
            self.window.sync()
            time.sleep(_LOOK_EVERY)
