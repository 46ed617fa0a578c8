"""Load the names of a package at their first use, so that importing the package is fast."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from iapb.errors import IapbError, MissingDependencyError, installing, name_the_extra


def lazy_names(
    package: str, homes: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` of a package whose names live in other
    modules.

    Parameters
    ----------
    package : the package's ``__name__``.
    homes : maps each name to its module; ".case" is a module of the package; "" marks a name that an
        upper package brings, as an entry point of the group "package.names".
    """

    def load(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        if not homes[name]:
            return extension(f"{package}.names", name)
        try:
            home = import_module(homes[name], package)
        except ModuleNotFoundError as error:
            raise name_the_extra(error, f"{package}.{name}") from error
        value = getattr(home, name)
        setattr(sys.modules[package], name, value)
        return value

    def names() -> list[str]:
        return sorted({*vars(sys.modules[package]), *homes})

    return load, names, sorted(homes)


def needed(module: str, purpose: str) -> Any:
    """Import and return an optional module; if it is missing, raise an error that says how to
    install it.

    If a package of the user hides one of this project, the error names both and says how to fix it.
    """
    if hidden := hidden_package():
        raise IapbError(hidden)
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        named = name_the_extra(error, purpose)
        if named is error:
            named = MissingDependencyError(str(error.name), purpose, installing("all"))
        raise named from error


def hidden_package() -> str:
    """Say which package of this project another one of the same name hides; empty if none is
    hidden."""
    ours = Path(__file__).resolve().parents[1]
    for name in ("reference", "verification", "reports"):
        spec = find_spec(name)
        places = [*(spec.submodule_search_locations or ()), spec.origin] if spec else []
        found = [Path(place).resolve() for place in places if place]
        if found and not any(place.is_relative_to(ours / name) for place in found):
            return (
                f"{found[0]} hides the package {ours / name}, which has the same name. Rename "
                f"yours, or take its "
                "folder off Python's import path."
            )
    return ""


def extension(group: str, name: str) -> Any:
    """Load the object that an installed package offers as an entry point; upper packages extend
    lower ones this way."""
    for found in load_extensions(group, name):
        return found
    raise MissingDependencyError("the extra report", f"{group}: {name}", installing("report"))


def load_extensions(group: str, name: str = "", purpose: str = "") -> list[Any]:
    """Import everything that installed packages offer in a group, or what they offer under a name;
    an error says that the purpose needs a package."""
    try:
        offered = entry_points(group=group, name=name) if name else entry_points(group=group)
        return [each.load() for each in offered]
    except ModuleNotFoundError as error:
        raise name_the_extra(error, purpose or f"{group}: {name}") from error
