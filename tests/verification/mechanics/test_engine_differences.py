"""The engine beside the references: the same mechanics and contacts on every scene, and a shift that is noticed."""

from __future__ import annotations

from dataclasses import astuple

import pytest

from iapb.scene import find_scene, load_scene, scene_names
from reference import contact_finding
from reference.contact_finding import find_contacts
from verification.mechanics import engine_differences
from verification.mechanics.engine_differences import scene_difference


@pytest.mark.parametrize("name", scene_names())
def test_engine_and_reference_find_the_same_contacts(name: str) -> None:
    """Two codes of other operations agree to rounding on all but a few configurations."""
    found = scene_difference(load_scene(find_scene(name)), configurations=30)
    assert found.apart <= 3
    assert max(astuple(found)[3:7]) <= 1e-13 and max(astuple(found)[8:]) <= 1e-12


def test_a_contact_that_is_off_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    def shifted(*arguments: object) -> contact_finding.Contacts:
        found = find_contacts(*arguments)  # type: ignore[arg-type]
        return found._replace(gap=found.gap + 1e-10)

    monkeypatch.setattr(engine_differences, "find_contacts", shifted)
    assert scene_difference(load_scene(find_scene("peg_corner")), configurations=3).gap >= 0.99e-10
