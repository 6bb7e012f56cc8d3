"""What every fault owes: sizes of real machines, nothing at null, something when typical."""

import numpy as np
import pytest
from virtual_bench import YAW, plan_of, steps_a_wrap

from belt_sim.effects.base import library
from belt_sim.line.hooks import overrides
from belt_sim.virtual_rig.hidden import CATALOGUE, RANDOM_LIBRARY, UNMODELLED
from belt_sim.virtual_rig.make import BASES
from belt_sim.virtual_rig.march import TrueErrors, observe, true_line
from belt_sim.virtual_rig.plan import Plan, RunSetting
from belt_sim.virtual_rig.space import IN_SCENE, WEIGHT

FAULTS = CATALOGUE | UNMODELLED
#: Slack and fast, either way round, with the yaw applied late.
PLAN = plan_of(
    *(RunSetting(tension=7e6, yaw=YAW, speed=5.0, direction=d, yaw_at=1.0) for d in (1.0, -1.0)),
    length=32.0,
    spacing=1.0,
)
PLAN = Plan(**{**vars(PLAN), "signals": PLAN.signals | {"phi": "upper_mid_span"}})


def readings(*faults, bases=BASES) -> np.ndarray:
    """On a flat belt and on one that tilts, shape (bases, signals, n, runs)."""
    with steps_a_wrap(1):
        return np.stack([observe(PLAN, true_line(PLAN, base, TrueErrors()), faults) for base in bases])


@pytest.fixture(scope="module")
def clean():
    return readings()


def typical(cls, **more):
    """The fault with all its sizes as they typically are."""
    return cls(**{name: size.typical for name, size in cls.sizes.items()}, **more)


def test_their_sizes_are_a_machines():
    for name, cls in FAULTS.items():
        assert cls.sizes, name
        for parameter, size in cls.sizes.items():
            assert getattr(cls(), parameter) == 0.0, name
            assert 0 < size.typical <= size.limit, name
            assert size.unit, name
            assert not size.place or size.place in PLAN.signals.values(), name
        assert set(cls.part_of) < set(BASES), name


def test_the_catalogue_holds_twins_of_effects_and_unmodelled_faults_have_none():
    effects = set(library())
    assert set(CATALOGUE) <= effects
    assert not set(UNMODELLED) & effects


def test_what_can_be_hidden_in_3d_is_what_has_a_scene():
    assert {WEIGHT, *(name for name in CATALOGUE if overrides(library()[name], ("scene",)))} == {*IN_SCENE}


@pytest.mark.parametrize("name", CATALOGUE)
def test_what_is_hidden_is_no_larger_than_what_its_twin_takes_for_a_machines(name):
    """Two authors, one machine. A wobble is one size here and a cosine and a sine there."""
    numbers = library()[name].parameters
    for parameter, size in CATALOGUE[name].sizes.items():
        same = [numbers[parameter]] if parameter in numbers else [p for p in numbers.values() if p.unit == size.unit]
        most = max(max(map(abs, p.plausible)) for p in same)
        assert size.limit <= most * (1 + 1e-9), f"{name}.{parameter}: {size.limit:g} hidden, {most:g} plausible"


def test_places_in_the_lot_are_taken_once():
    assert len({cls.id for cls in RANDOM_LIBRARY}) == len(RANDOM_LIBRARY) == 29


def test_at_null_nothing_changes_bit_for_bit(clean):
    """All at once: the line adds up what faults do, so that none hides what another does."""
    together = readings(*(cls() for cls in FAULTS.values()))
    if not np.array_equal(together, clean):
        pytest.fail(f"not null: {[n for n, cls in FAULTS.items() if not np.array_equal(readings(cls()), clean)]}")


def test_at_their_typical_sizes_all_show(clean):
    """By half the white noise of one reading [m], on a belt that tilts."""
    seen = {name: readings(typical(cls), bases=["strip"])[0] for name, cls in FAULTS.items()}
    largest = {name: np.abs(shown - clean[BASES.index("strip")])[:4].max() for name, shown in seen.items()}
    assert [name for name, most in largest.items() if most <= 10e-6] == []
