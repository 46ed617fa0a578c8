"""Import functions and objects of a user by name, ``package.module:function``."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any

from iapb.errors import ArgumentError
from iapb.names import nearest


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
        near = nearest(attribute, [word for word in dir(home) if not word.startswith("_")])
        guess = f"; did you mean {near}?" if near else ""
        raise ArgumentError(
            argument, name, f"a name of the module {module}, which has no {attribute}{guess}"
        )
    return getattr(home, attribute)
