"""A property that is worked out once an object.

``functools.cached_property`` of Python 3.11 lets one thread at a time work out that property, of whatever object; here
threads that ask several objects do not wait for one another. Two that ask one object at once may both work it out.
"""

from collections.abc import Callable
from typing import Any, Generic, TypeVar, overload

T = TypeVar("T")


class once(Generic[T]):
    """Decorates a method without arguments; what it gave stands in the object's ``__dict__``."""

    def __init__(self, made: Callable[[Any], T]) -> None:
        self._made, self._name, self.__doc__ = made, made.__name__, made.__doc__

    def __set_name__(self, owner: type, name: str) -> None:
        self._name = name

    @overload
    def __get__(self, of: None, owner: type) -> "once[T]": ...

    @overload
    def __get__(self, of: object, owner: type) -> T: ...

    def __get__(self, of: object | None, owner: type) -> "once[T] | T":
        if of is None:
            return self
        found = self._made(of)
        of.__dict__[self._name] = found
        return found
