"""Names of a package that are loaded when first used, so that importing the package costs next to nothing."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from iapb.errors import IapbError, MissingDependencyError, name_the_extra


def lazy_names(
    package: str, homes: Mapping[str, str]
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` of a package whose names live in other modules.

    Parameters
    ----------
    package : the package's ``__name__``.
    homes : name -> module that it is imported from; ".case" is one in the package.
    """

    def load(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
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
    """Return an optional module, imported now; who lacks it gets one sentence that says how to install it.

    Where a package of the user's hides one of this project's, the error names both and the way out.
    """
    if hidden := hidden_package():
        raise IapbError(hidden)
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        named = name_the_extra(error, purpose)
        if named is not error:
            raise named from error
        package = module.partition(".")[0]
        raise MissingDependencyError(package, purpose, f"pip install {package}") from error


def hidden_package() -> str:
    """Say which package of this project is hidden by one of the same name elsewhere; empty where none is."""
    ours = Path(__file__).resolve().parents[1]
    for name in ("reference", "verification", "reports"):
        spec = find_spec(name)
        places = [*(spec.submodule_search_locations or ()), spec.origin] if spec else []
        found = [Path(place).resolve() for place in places if place]
        if found and not any(place.is_relative_to(ours / name) for place in found):
            return (f"{found[0]} hides the package {ours / name}, which has the same name. Rename yours, or take its "
                    "folder off Python's import path.")  # fmt: skip
    return ""


def extension(group: str, name: str) -> Any:
    """Return what an installed package offers under an entry point: so packages above add to the ones below."""
    for offered in entry_points(group=group, name=name):
        return _loaded(offered, f"{group}: {name}")
    raise MissingDependencyError("iapb[report]", f"{group}: {name}", "pip install 'iapb[report]'")


def load_extensions(group: str) -> None:
    """Import everything that installed packages offer in a group."""
    for offered in entry_points(group=group):
        _loaded(offered, group)


def _loaded(offered: Any, purpose: str) -> Any:
    try:
        return offered.load()
    except ModuleNotFoundError as error:
        raise name_the_extra(error, purpose) from error
