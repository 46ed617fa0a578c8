"""Somebody's own function by name: found beside the working directory, and whatever is wrong with it is said."""

from __future__ import annotations

import sys

import pytest

from iapb.errors import ArgumentError
from reports.by_name import function_named


@pytest.fixture
def module(tmp_path, monkeypatch):
    """Write a module into the working directory; return its name."""
    def write(name, text):
        (tmp_path / f"{name}.py").write_text(text)
        monkeypatch.delitem(sys.modules, name, raising=False)
        return name

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", sys.path.copy())
    return write


def test_a_function_in_the_working_directory_is_found(module):
    name = module("own_resolver_a", "def resolve(*arguments): return arguments")
    assert function_named("--resolver", f"{name}:resolve")(1, 2) == (1, 2)


@pytest.mark.parametrize(("text", "said"), [
    ("def resolve(:", "SyntaxError"), ("resolve = 1 / 0", "ZeroDivisionError"), ("import no_such_thing", "no_such"),
    ("resolver = print", "did you mean resolver?"), ("resolve = 3", "something that can be called"),
])  # fmt: skip
def test_a_module_that_fails_is_a_mistake_of_the_name_given(module, text, said):
    name = module(f"own_resolver_{abs(hash(text))}", text)
    with pytest.raises(ArgumentError, match="--resolver") as wrong:
        function_named("--resolver", f"{name}:resolve")
    assert said in str(wrong.value)


@pytest.mark.parametrize("name", ["", ":", "module", "module:", ":function", ".relative:function", "a b:c"])
def test_a_name_of_another_form_is_refused(name):
    with pytest.raises(ArgumentError, match="--device"):
        function_named("--device", name, "module:factory")
