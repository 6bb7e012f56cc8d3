"""A general solver of delay equations, jitcdde: equations compiled by a C compiler, adaptive steps."""

import contextlib
import tempfile
import warnings

import numpy as np

from studies.bench.task import KEEP, TRAVEL, Linear

RELATIVE, ABSOLUTE = 1e-4, 1e-8  # tolerances [1], [m and rad]: errors then match those of the march
LONGEST = 0.5  # [m] of a step


class DelayEquation:
    """The belt line as a delay equation with two delays, compiled once; raises ImportError without jitcdde."""

    def __init__(self, wrap_tail: float, wrap_head: float) -> None:
        import symengine
        from jitcdde import jitcdde, t, y

        ky, ko, ku, yaw = parameters = symengine.symbols("ky ko ku yaw")
        tail, head = t - wrap_tail, t - wrap_head
        upper = ky * (y(0) - y(2, head)) + ko * y(3, head) + ku * (yaw + y(1))
        lower = ky * (y(2) - y(0, tail)) + ko * (y(1, tail) - yaw) + ku * y(3)
        delays = [wrap_tail, wrap_head]
        self.equation = jitcdde(
            [-y(1), -upper, -y(3), -lower], control_pars=parameters, max_delay=max(delays), verbose=False
        )
        self.wraps = delays
        # its build reads the pyproject.toml of the folder it stands in, so it stands in an empty one
        with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
            self.equation.compile_C(simplify=False, do_cse=False)

    def solve(self, case: Linear) -> np.ndarray:
        """y (4, n) [m]."""
        equation = self.equation
        equation.purge_past()
        equation.constant_past(np.zeros(4), time=0.0)
        equation.set_parameters(case.ky, case.ko, case.ku, case.yaw)
        equation.set_integration_parameters(rtol=RELATIVE, atol=ABSOLUTE, first_step=0.02, max_step=LONGEST)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            equation.adjust_diff()
            grid = np.arange(round(TRAVEL / KEEP) + 1) * KEEP
            rows = np.array([np.zeros(4), *(equation.integrate(s) for s in grid[1:])])
        return self._points(grid, rows)

    def _points(self, grid: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """Run-ups as they are; run-offs one wrapped arc later."""
        y1, y3 = rows[:, 0], rows[:, 2]
        y2, y4 = (np.interp(grid - w, grid, y, left=0.0) for w, y in zip(self.wraps, (y1, y3), strict=True))
        return np.stack([y1, y2, y3, y4])
