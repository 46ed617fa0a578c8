"""A counterexample as the source of a test that can be pasted beside the resolver it breaks."""

from __future__ import annotations

import sys
from functools import partial
from typing import Any

import numpy as np

from verification.properties.bounds import FACTORED, KIT, Bounds
from verification.properties.case import ImpactCase
from verification.properties.engine_laws import ENGINE_LAWS

_BY_NAME = {"KIT": KIT, "FACTORED": FACTORED}


def as_test(case: ImpactCase, law: str, bounds: Bounds = KIT, resolver: Any = None) -> str:
    """Return the case as source of a test of `law`; without a resolver that can be imported, its line is a gap.

    A law of the engine's own (a budget, extreme inputs) is put to the engine, whatever the resolver and the bounds.
    """
    if law in ENGINE_LAWS:
        return _test_of_the_engine(case, law)
    table = "UNEQUAL_LAWS" if law.startswith("unequal_") else "LAWS"
    name = next((name for name, known in _BY_NAME.items() if known == bounds), "")
    imports = ["import numpy as np", f"from verification.properties import {table}, ImpactCase"]
    imports.append(f"from verification.properties.bounds import {name or 'Bounds'}")
    return "\n".join([
        *imports,
        import_line(resolver) or "\n# resolver = ...  the one under test",
        *_test_of(case, law),
        f"    residual = {table}[{law!r}].check(case, resolver, {name or _bounds(bounds)})",
        "    assert residual.passed, residual",
    ])  # fmt: skip


def _test_of_the_engine(case: ImpactCase, law: str) -> str:
    return "\n".join([
        "import numpy as np",
        "from verification.properties import ImpactCase",
        "from verification.properties.engine_laws import ENGINE_LAWS",
        *_test_of(case, law),
        f"    law = ENGINE_LAWS[{law!r}]",
        "    residual = law.check(case, law.ours)",
        "    assert residual.passed, residual",
    ])  # fmt: skip


def _test_of(case: ImpactCase, law: str) -> list[str]:
    """The head of the test, and its case."""
    optional = {"translations": case.translations, "unequal": case.unequal}
    arrays = {"mass_matrix": case.mass_matrix, "contact_jacobian": case.contact_jacobian, "velocity": case.velocity}
    arrays |= {name: array for name, array in optional.items() if array is not None}
    more = "".join(f", {name}={name}" for name, array in optional.items() if array is not None)
    return [
        "",
        "",
        f"def test_{law}():",
        *(f"    {key} = {_written(array)}" for key, array in arrays.items()),
        f"    case = ImpactCase(mass_matrix, contact_jacobian, velocity, {case.restitution!r}{more})",
    ]


def import_line(resolver: Any) -> str:
    """Return the lines that give `resolver`, or an empty text for a lambda or something made in place."""
    if isinstance(resolver, partial) and not resolver.args:
        line = _import_of(resolver.func, resolver.func.__name__) if _can_be_imported(resolver.func) else ""
        return line and f"{line}\nfrom functools import partial\n\nresolver = {name_of(resolver, 'partial')}"
    return _import_of(resolver, f"{resolver.__name__} as resolver") if _can_be_imported(resolver) else ""


def name_of(resolver: Any, word: str = "") -> str:
    """Return what a resolver is called, the options of a partial included; `word` writes that as a call."""
    if isinstance(resolver, partial) and not resolver.args:
        options = ", ".join(f"{key}={value!r}" for key, value in resolver.keywords.items())
        name = getattr(resolver.func, "__name__", repr(resolver.func))
        return f"{word}({name}, {options})" if word else f"{name}({options})"
    return getattr(resolver, "__qualname__", None) or repr(resolver)


def _can_be_imported(resolver: Any) -> bool:
    module, name = getattr(resolver, "__module__", None), getattr(resolver, "__qualname__", "")
    if not isinstance(module, str) or module == "__main__":
        return False
    return getattr(sys.modules.get(module), name, None) is resolver


def _import_of(resolver: Any, name: str) -> str:
    return f"from {resolver.__module__} import {name}"


def _bounds(bounds: Bounds) -> str:
    return repr(bounds).replace("=inf", "=np.inf")


def _written(array: np.ndarray) -> str:
    """The array as source; an empty one needs its shape."""
    text = f"np.array({array.tolist()!r}, dtype=float)"
    return text if array.size else f"{text}.reshape({array.shape})"
