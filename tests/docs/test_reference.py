"""The reference of the code: every page names modules that exist, and what is public says what it takes and gives."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections.abc import Callable, Iterator
from importlib import import_module
from types import ModuleType
from typing import Any

import pytest
from blocks import PACKAGES, ROOT

API = sorted((ROOT / "docs/api").glob("*.md"))
MODULES = [name for page in API for name in re.findall(r"automodule:: ([\w.]+)", page.read_text(encoding="utf-8"))]
PACKAGE_NAMES = [(package, name) for package in PACKAGES for name in getattr(import_module(package), "__all__", ())]


def public_functions(module: ModuleType) -> Iterator[tuple[str, Callable[..., Any]]]:
    """Functions and methods that a module defines and does not hide."""
    for name, value in vars(module).items():
        if name.startswith("_") or getattr(value, "__module__", "") != module.__name__:
            continue
        if inspect.isfunction(value):
            yield name, value
        elif inspect.isclass(value):
            yield from ((f"{name}.{inner}", function) for inner, function in vars(value).items()
                        if inspect.isfunction(function) and not inner.startswith("_"))  # fmt: skip


def missing_sections(function: Callable[..., Any]) -> list[str]:
    """Sections that a numpydoc docstring of this function lacks: what goes in, what comes out, what is raised."""
    text, signature = inspect.getdoc(function) or "", inspect.signature(function)
    takes = [name for name in signature.parameters if name not in ("self", "cls")]
    tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
    raises = any(isinstance(node, ast.Raise) for node in ast.walk(tree))
    gives = signature.return_annotation not in (None, "None", inspect.Signature.empty)
    wanted = {"Parameters": bool(takes), "Returns": gives, "Raises": raises}
    return [name for name, needed in wanted.items() if needed and not re.search(rf"^{name}\n-+$", text, flags=re.M)]


@pytest.mark.parametrize("page", API, ids=lambda page: page.stem)
def test_pages_are_in_the_contents(page: Any) -> None:
    assert f"api/{page.stem}" in (ROOT / "docs/index.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", MODULES)
def test_whatever_is_shown_has_a_docstring(name: str) -> None:
    module = import_module(name)
    assert module.__doc__
    assert not [place for place, function in public_functions(module) if not inspect.getdoc(function)]


@pytest.mark.parametrize(("package", "name"), PACKAGE_NAMES, ids=[".".join(each) for each in PACKAGE_NAMES])
def test_names_of_the_packages_say_what_goes_in_and_out(package: str, name: str) -> None:
    value = getattr(import_module(package), name)
    if inspect.isfunction(value):
        assert not missing_sections(value), f"{package}.{name}: its docstring lacks {missing_sections(value)}"
        for parameter in inspect.signature(value).parameters:
            assert re.search(rf"^\s*(\w+, )*{parameter}\b", inspect.getdoc(value) or "", flags=re.M), parameter
    elif inspect.isclass(value):
        assert value.__doc__


def test_a_docstring_without_sections_is_caught() -> None:
    def bare(x: int) -> int:
        """Say nothing."""
        if x:
            raise ValueError
        return x

    assert missing_sections(bare) == ["Parameters", "Returns", "Raises"]
