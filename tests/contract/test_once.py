"""A property worked out once an object, by threads that do not wait for one another."""

from concurrent.futures import ThreadPoolExecutor
from threading import Barrier

from belt_sim.once import once


class Slow:
    def __init__(self, barrier):
        self.barrier, self.times = barrier, 0

    @once
    def value(self):
        """What takes long."""
        self.times += 1
        self.barrier.wait(10.0)
        return self


def test_two_objects_are_asked_at_once_and_each_once_only():
    pair = Barrier(2)
    objects = [Slow(pair), Slow(pair)]
    with ThreadPoolExecutor(2) as pool:
        found = list(pool.map(lambda one: one.value, objects))  # with one lock for both the barrier would break
    assert found == objects
    assert [one.value for one in objects] == objects
    assert [one.times for one in objects] == [1, 1]
    assert Slow.value.__doc__ == "What takes long."
