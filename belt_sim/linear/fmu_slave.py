"""The belt as a functional mock-up unit: what runs inside the FMU. Plain Python, so that any host can load it.

It steps the state space in ``plant.json`` (see fmu.py) over the travel that ``speed`` makes of each step, with the
yaws held.
"""

import json
from pathlib import Path

from pythonfmu3 import CoSimulation, Float64, Fmi3Causality, Fmi3Slave, Fmi3Variability

TERMS = 12  # of the exponential's series, after scaling below one half


class Belt(Fmi3Slave, CoSimulation):
    """Lateral position of a steel belt at its four run-up and run-off points, steered by yawing its pulleys."""

    description = "lateral position of a steel belt on two pulleys"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        plant = json.loads((Path(self.resources) / "plant.json").read_text(encoding="utf-8"))
        self._a, self._b, self._c = plant["a"], plant["b"], plant["c"]
        self._state, self._known = [0.0] * len(self._a), {}
        self.time = self.travel = 0.0
        self.yaw = self.yaw_head = 0.0
        self.speed = plant["speed"]
        self.tension = plant["tension"]
        self.y1 = self.y2 = self.y3 = self.y4 = 0.0
        self._declare()

    def _declare(self):
        continuous, fixed = Fmi3Variability.continuous, Fmi3Variability.fixed
        self.register_variable(Float64("time", causality=Fmi3Causality.independent, variability=continuous))
        for name in ("yaw", "yaw_head", "speed"):
            self.register_variable(Float64(name, causality=Fmi3Causality.input, variability=continuous, start=0.0))
        self.register_variable(Float64("tension", causality=Fmi3Causality.parameter, variability=fixed))
        for name in ("y1", "y2", "y3", "y4", "travel"):
            self.register_variable(Float64(name, causality=Fmi3Causality.output, variability=continuous))

    def do_step(self, current_time, step_size):
        """Advance by ``step_size`` [s]; the yaws [rad] are taken as constant in it."""
        length = self.speed * step_size
        if length < 0:
            return False
        forward = self._known.get(length) or self._known.setdefault(length, _advance(self._a, self._b, length))
        self._state = _times(forward, [*self._state, self.yaw, self.yaw_head])[: len(self._a)]
        self.y1, self.y2, self.y3, self.y4 = _times(self._c, self._state)
        self.travel += length
        return True


def _times(matrix, vector):
    return [sum(m * x for m, x in zip(row, vector) if m) for row in matrix]  # noqa: B905 (any Python 3)


def _product(left, right):
    columns = list(zip(*right))  # noqa: B905
    return [[sum(x * y for x, y in zip(row, col) if x) for col in columns] for row in left]  # noqa: B905


def _advance(a, b, length):
    """exp of [[a, b], [0, 0]] times ``length``: the state after a stretch of travel with its inputs held."""
    n = len(a) + len(b[0])
    system = [[x * length for x in (*ra, *rb)] for ra, rb in zip(a, b)] + [[0.0] * n for _ in b[0]]  # noqa: B905
    size, halvings = max(sum(abs(x) for x in row) for row in system), 0
    while size > 0.5:
        size, halvings = size / 2, halvings + 1
    system = [[x / 2**halvings for x in row] for row in system]
    total = [[float(i == j) for j in range(n)] for i in range(n)]
    term = total
    for k in range(1, TERMS + 1):
        term = [[x / k for x in row] for row in _product(term, system)]
        total = [[x + y for x, y in zip(r, t)] for r, t in zip(total, term)]  # noqa: B905
    for _ in range(halvings):
        total = _product(total, total)
    return total
