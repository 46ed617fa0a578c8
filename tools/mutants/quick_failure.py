"""A pytest plugin: hypothesis stops at the first counterexample; one is enough to notice a mutant."""

from __future__ import annotations

from hypothesis import Phase, settings


def pytest_collection() -> None:
    """After the profiles of tests/conftest.py, before the tests are imported."""
    settings.register_profile("mutants", settings.default, phases=(Phase.explicit, Phase.generate))
    settings.load_profile("mutants")
