"""Changing values of a scene for sweeps: same checks, and a text that gives the changed scene."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.errors import ArgumentError, SceneError
from iapb.scene import find_scene, load_scene, scene_from_text

PEG = load_scene(find_scene("peg_corner"))


def test_values_are_set_by_name_and_by_number_and_the_scene_itself_stays() -> None:
    changed = PEG.with_values(
        {"contact.friction": 0.3, "bodies.peg.position.2": 0.1, "walls.1.point": [0, 1]}
    )
    assert changed.contact.friction == 0.3
    assert changed.bodies[0].position == (*PEG.bodies[0].position[:2], 0.1)
    assert changed.walls[1].point == (0.0, 1.0)  # type: ignore[union-attr]
    assert PEG.contact.friction == 0.0


def test_numpy_values_are_taken() -> None:
    changed = PEG.with_values({"bodies.peg.position": np.array([0.1, -0.2, 0.3]), "rate": np.float64(256)})
    assert (changed.bodies[0].position, changed.rate) == ((0.1, -0.2, 0.3), 256.0)


def test_an_absent_section_is_made_and_its_defaults_apply() -> None:
    free = PEG.with_values({"device": None})
    assert free.with_values({"device.delay": 3}).resolved()["device"]["force_limit"] is None


@given(st.floats(0.0, 1e9), st.floats(-1e9, 1e9), st.floats(0.0, 1.0))
def test_text_of_a_changed_scene_gives_that_scene_to_the_last_bit(
    friction: float, angle: float, e: float
) -> None:
    changed = PEG.with_values(
        {"contact.friction": friction, "bodies.peg.position.2": angle, "contact.restitution": e}
    )
    assert scene_from_text(changed.source_text).resolved() == changed.resolved()


def test_all_wrong_values_are_reported_with_their_paths() -> None:
    with pytest.raises(SceneError) as caught:
        PEG.with_values({"bodies.peg.mass": -1, "contact.frition": 3, "device.delay": 2.5})
    assert {m.path for m in caught.value.mistakes} == {"bodies[0].mass", "contact.frition", "device.delay"}
    assert "peg_corner with new values: bodies[0].mass = -1" in str(caught.value)


@pytest.mark.parametrize(
    "path", ["bodies.peg_2.mass", "contact.friction.x", "walls.7.point", "bodies..mass", "", 3]
)
def test_paths_that_lead_nowhere_are_named(path: Any) -> None:
    with pytest.raises(ArgumentError) as caught:
        PEG.with_values({path: 1})
    assert caught.value.value == path


junk = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | st.binary(max_size=4),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=4),
    max_leaves=8,
)
PATHS = ["name", "rate", "bodies", "bodies.peg", "bodies.peg.shapes", "bodies.peg.shapes.0", "bodies.peg.shapes.0.kind",
         "bodies.peg.position", "walls", "walls.floor", "walls.floor.kind", "contact", "hand", "device", "couplings",
         "couplings.four_channel", "gravity"]  # fmt: skip


@given(st.dictionaries(st.sampled_from(PATHS), junk, min_size=1, max_size=2))
def test_no_value_whatever_ends_in_another_error(values: dict[str, Any]) -> None:
    try:
        changed = PEG.with_values(values)
    except (SceneError, ArgumentError):
        return
    assert scene_from_text(changed.source_text).resolved() == changed.resolved()
