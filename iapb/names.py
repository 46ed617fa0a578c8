"""Names that a user gives: messages for unknown ones, and objects imported by name,
``package.module:function``."""

from __future__ import annotations

import difflib
import os
import sys
from collections.abc import Callable, Iterable
from importlib import import_module
from os import fspath
from os.path import exists, isfile
from typing import Any

from iapb.errors import ArgumentError


def nearest(wrong: Any, known: Iterable[Any]) -> str:
    """Return the known name most similar to `wrong`, ignoring case; empty if none is similar."""
    spelt = {str(name).casefold(): str(name) for name in known}
    near = difflib.get_close_matches(str(wrong).casefold(), spelt, n=1)
    return spelt[near[0]] if near else ""


def one_of(wrong: Any, known: Iterable[Any], lead: str = "one of ") -> str:
    """Say what was expected instead of `wrong`: ``one of peg_corner, two_discs; did you mean
    peg_corner?``."""
    names = [str(name) for name in known]
    return lead + ", ".join(names) + hint(wrong, names)


def hint(wrong: Any, known: Iterable[Any]) -> str:
    """Return text that asks for the known name most similar to `wrong`; empty if none is similar."""
    near = nearest(wrong, known)
    return f"; did you mean {near}?" if near else ""


def in_metres(length: float) -> str:
    """Return a length [m] as text, in millimetres below 1 m."""
    return f"{length:.3g} m" if length >= 1.0 else f"{1e3 * length:.3g} mm"


def bytes_of(path: Any, most: int, expected: str) -> bytes:
    """Return the first `most` bytes of a file; an ArgumentError says what file was expected."""
    try:
        if exists(path) and not isfile(path):
            raise ValueError("no regular file")  # a pipe would be waited for
        with open(fspath(path), "rb") as file:  # a number would be an open file
            return file.read(most)
    except (OSError, TypeError, ValueError) as failure:
        reason = getattr(failure, "strerror", None) or failure
        raise ArgumentError("path", str(path), f"{expected} ({reason})") from failure


def function_named(argument: str, name: str) -> Callable[..., Any]:
    """Import a function like `object_named`."""
    function: Callable[..., Any] = object_named(argument, name, "package.module:function")
    if not callable(function):
        raise ArgumentError(argument, name, "something that can be called")
    return function


def object_named(argument: str, name: str, form: str) -> Any:
    """Import an object, also from the working directory; raise ArgumentError if that fails.

    argument : the option or argument that the name was given for
    form : the expected form of the name
    """
    module, colon, attribute = name.partition(":")
    if not (module and colon and attribute):
        raise ArgumentError(argument, name, form)
    if os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())
    try:
        home = import_module(module)
    except Exception as error:  # a user's module may raise anything
        why = f"{type(error).__name__}: {error}"
        raise ArgumentError(argument, name, f"a module that can be imported ({why})") from error
    if not hasattr(home, attribute):
        public = [word for word in dir(home) if not word.startswith("_")]
        expected = f"a name of the module {module}, which has no {attribute}"
        raise ArgumentError(argument, name, expected + hint(attribute, public))
    return getattr(home, attribute)
