"""Every field of a scene has bounds, a description and a rule to break; values change under the same rules."""

from __future__ import annotations

import copy
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.errors import ArgumentError, SceneError
from iapb.scene import Scene, find_scene, load_scene, scene_from_text, scene_schema
from iapb.scene.model import scene_text

FULL = scene_from_text("""\
name: full
rate: 1000
duration: 1
gravity: [0, -9.81]
bodies:
  - {name: base, joint: fixed}
  - {name: slide, parent: base, joint: prismatic, axis: [2, 0], mass: 1}
  - name: arm
    parent: slide
    joint: revolute
    center_of_mass: [0.1, 0]
    mass: 1
    shapes: [{kind: box, size: [0.2, 0.02]}, {kind: polygon, vertices: [[0, 0], [1, 0], [0, 1]]}]
  - {name: puck, joint: planar, mass: 1, inertia: 1, shapes: [{kind: circle, radius: 0.1}]}
walls:
  - {name: floor, kind: half_plane, point: [0, 0], normal: [0, 1]}
  - {name: post, kind: circle, radius: 0.1}
  - {name: block, kind: box, size: [1, 1]}
  - {name: wedge, kind: polygon, vertices: [[0, 0], [1, 0], [0, 1]]}
hand: {body: arm}
device: {force_limit: [1, 1], position_resolution: [0, 0], damping: [0, 0]}
couplings:
  four_channel: {stiffness: [1, 1], damping: [1, 1]}
  unilateral: {stiffness: [1, 1], damping: [1, 1]}
""")

NOT_A_NUMBER = ["x", None, True, [1], {}, math.nan, math.inf, 1e10]
NOT_POSITIVE = [*NOT_A_NUMBER, 0.0, -1.0]
NEGATIVE = [*NOT_A_NUMBER, -1e-9]
NOT_A_VECTOR = [1.0, "x", None, [1.0], [1.0, 2.0, 3.0], ["x", 0], [math.nan, 0.0]]
NOT_A_NAME = ["", "a b", "a.b", "1a", "é", "a\n", 3, None, "x" * 65]
NOT_A_PAIR_OF_GAINS = [[1], [1, 1, 1], [-1, 1], [1, "x"], 3, []]

REFUSED: list[tuple[str, list[Any]]] = [
    ("integrator", ["leapfrog"]),
    ("contact.forces", ["explicit"]),
    ("name", NOT_A_NAME),
    ("title", [3, None, "x" * 2001]),
    ("source", [3, None, "x" * 2001]),
    ("rate", [*NOT_POSITIVE, 1.1e6]),
    ("duration", [*NOT_POSITIVE, 1e-4, 1e5]),
    ("gravity", [v for v in NOT_A_VECTOR if v is not None]),
    ("bodies", [[], None, {}, "x", [3]]),
    ("bodies.puck.name", [*NOT_A_NAME, "arm", "world"]),
    ("bodies.arm.parent", [*NOT_A_NAME, "puck", "arm", "nobody"]),
    ("bodies.arm.joint", ["hinge", None, 3, "planar"]),
    ("bodies.slide.axis", [*NOT_A_VECTOR, [0.0, 0.0]]),
    ("bodies.arm.axis", [[1.0, 0.0]]),
    ("bodies.arm.origin", NOT_A_VECTOR),
    ("bodies.arm.angle", NOT_A_NUMBER),
    ("bodies.arm.center_of_mass", [*NOT_A_VECTOR, [0.0, 0.0]]),
    ("bodies.arm.mass", [*NEGATIVE, 0.0]),
    ("bodies.slide.mass", NOT_POSITIVE),
    ("bodies.puck.mass", NOT_POSITIVE),
    ("bodies.puck.inertia", NOT_POSITIVE),
    ("bodies.puck.density", [x for x in NOT_POSITIVE if x is not None]),
    ("bodies.arm.inertia", NEGATIVE),
    ("bodies.arm.restitution", [x for x in [*NEGATIVE, 1.001, -1.0] if x is not None]),
    ("bodies.arm.friction", [x for x in NEGATIVE if x is not None]),
    ("walls.floor.friction", [x for x in NEGATIVE if x is not None]),
    ("bodies.arm.joint_damping", [*(x for x in NEGATIVE if x != [1]), [1.0, 1.0], [-1.0]]),
    ("bodies.puck.joint_damping", [1.0, [1.0, 1.0], [1.0, 1.0, -1.0]]),
    ("bodies.arm.joint_limits", [1.0, [1.0], [1.0, 2.0], [1.0, -1.0], [0.0, 0.0], ["x", 1.0], [-1.0, math.nan]]),
    ("bodies.puck.joint_limits", [[-1.0, 1.0]]),
    ("bodies.base.joint_limits", [[-1.0, 1.0]]),
    ("walls.floor.restitution", [x for x in [*NEGATIVE, 1.001, -1.0] if x is not None]),
    ("walls.post.restitution", [1.001]),
    ("bodies.arm.shapes", [None, 3, [3], [{"kind": "capsule"}], [{"kind": "half_plane"}], [{}]]),
    ("bodies.arm.shapes.0.size", [[0.0, 1.0], [1.0, -1.0], [1.0], 1.0]),
    ("bodies.arm.shapes.0.center", NOT_A_VECTOR),
    ("bodies.arm.shapes.0.angle", NOT_A_NUMBER),
    ("bodies.puck.shapes.0.radius", NOT_POSITIVE),
    ("bodies.puck.shapes.0.center", NOT_A_VECTOR),
    ("bodies.arm.shapes.1.center", NOT_A_VECTOR),
    ("bodies.arm.shapes.1.angle", NOT_A_NUMBER),
    ("bodies.base.position", [[0.0]]),
    ("bodies.arm.position", [[0.0, 0.0], ["x"], 0.0, [math.nan]]),
    ("bodies.puck.position", [[0.0], [0.0, 0.0, 0.0, 0.0]]),
    ("bodies.puck.velocity", [[0.0], ["x", 0.0, 0.0]]),
    ("walls", [None, 3, [3], [{"kind": "circle", "radius": 1}]]),
    ("walls.post.name", [*NOT_A_NAME, "floor"]),
    ("walls.floor.kind", ["plane", None, "box"]),
    ("walls.floor.point", NOT_A_VECTOR),
    ("walls.floor.normal", [*NOT_A_VECTOR, [0.0, 0.0]]),
    ("walls.post.radius", NOT_POSITIVE),
    ("walls.block.size", [[0.0, 1.0], 3]),
    ("contact.auto", [1, "true", None]),
    ("contact.resting_start", [1, "true", None]),
    ("contact.stiffness", NEGATIVE),
    ("contact.damping", NEGATIVE),
    ("contact.penalty", ["soft", None, True]),
    ("contact.friction", NEGATIVE),
    ("contact.friction_pairs", [1, [1], [{"between": ["arm", "nobody"], "friction": 0.1}],
                                [{"between": ["arm"], "friction": 0.1}], [{"between": ["arm", "puck"], "friction": -1}],
                                [{"between": ["arm", "puck"], "friction": 0.1}] * 2]),
    ("contact.friction_law", ["dry", "Coulomb", None, True]),
    ("contact.friction_velocity", NOT_POSITIVE),
    ("contact.restitution", [*NEGATIVE, 1.001, -1.0]),
    ("contact.approach_velocity", NEGATIVE),
    ("contact.cluster_distance", NEGATIVE),
    ("contact.coherence_distance", NEGATIVE),
    ("contact.self_collision_rows", ["both", None]),
    ("contact.self_collisions", [1, "true", None]),
    ("hand.body", [*NOT_A_NAME, "nobody", "floor"]),
    ("hand.point", NOT_A_VECTOR),
    ("hand.force", [[1.0, 2.0], 3.0, None, [math.nan, 0.0, 0.0]]),
    ("hand.force_table", [1.0, [1.0], [[0.0, 1.0]], [[0.0, 1.0, 1.0, "x"]], [[0.0] * 4, [0.0] * 4]]),
    ("hand.force_function", ["t", ["t"], ["t", "t", "u"], ["t", "t", "1/t"], [None, "t", "t"]]),
    ("device.force_limit", [*NOT_A_PAIR_OF_GAINS, [0, 1]]),
    ("device.delay", [-1, 1001, 1.0, "1", None, True]),
    ("device.position_resolution", NOT_A_PAIR_OF_GAINS),
    ("device.damping", NOT_A_PAIR_OF_GAINS),
    ("device.waveform", ["bell", "", "Step", 0, None, True]),
    ("couplings.four_channel.stiffness", NOT_A_PAIR_OF_GAINS),
    ("couplings.four_channel.damping", NOT_A_PAIR_OF_GAINS),
    ("couplings.unilateral.stiffness", NOT_A_PAIR_OF_GAINS),
    ("couplings.unilateral.damping", NOT_A_PAIR_OF_GAINS),
]


@pytest.mark.parametrize(("path", "values"), REFUSED, ids=[path for path, _ in REFUSED])
def test_every_field_refuses_what_it_cannot_take(path: str, values: list[Any]) -> None:
    field = path.split(".")[-1]
    for value in values:
        with pytest.raises(SceneError) as caught:
            FULL.with_values({path: value})
        near = [m for m in caught.value.mistakes if field in m.path or m.path.startswith(path.split(".")[0])]
        assert near, f"{path} = {value!r} was refused, but the mistake points elsewhere: {caught.value}"


def field_names(part: Any) -> set[str]:
    """Return the names of all fields below a plain value."""
    if isinstance(part, list):
        return set().union(*map(field_names, part)) if part else set()
    if not isinstance(part, dict):
        return set()
    return set(part).union(*(field_names(value) for value in part.values()))


def test_no_field_is_left_out_above() -> None:
    tried = {path.split(".")[-1] for path, _ in REFUSED}
    parts = {"contact", "hand", "device", "couplings", "four_channel", "unilateral"}
    untried = field_names(FULL.resolved()) - tried - parts
    assert untried == {"vertices"}  # has a test of its own


@pytest.mark.parametrize(
    "part", ["contact", "hand", "device", "couplings", "bodies.arm", "walls.post", "couplings.unilateral"]
)
def test_unknown_fields_are_refused_everywhere(part: str) -> None:
    with pytest.raises(SceneError, match="one of the known fields"):
        FULL.with_values({f"{part}.masss": 1})


def test_bodies_of_one_tree_stand_together() -> None:
    plain = FULL.resolved()
    plain["bodies"] = [plain["bodies"][i] for i in (0, 1, 3, 2)]
    with pytest.raises(ValueError, match="its place among the other bodies of base's tree"):
        Scene.model_validate(plain)


def test_hand_must_hold_what_moves_and_a_device_needs_a_hand() -> None:
    with pytest.raises(SceneError, match="a hand in the scene"):
        FULL.with_values({"hand": None})
    fixed = {"name": "wall_bracket", "joint": "fixed"}
    plain = FULL.with_values({"device": None, "couplings": {}}).resolved()
    plain["bodies"].append(fixed)
    plain["hand"]["body"] = "wall_bracket"
    with pytest.raises(ValueError, match="a body that can move"):
        Scene.model_validate(plain)
    with pytest.raises(SceneError, match="at least one body of the scene that can move"):
        scene_from_text("name: a\nrate: 1\nduration: 1\nbodies: [{name: b, joint: fixed}]")


def test_resolved_scene_and_its_text_read_back_as_the_same_scene() -> None:
    plain = FULL.resolved()
    assert Scene.model_validate(copy.deepcopy(plain)).resolved() == plain
    assert scene_from_text(scene_text(FULL)).resolved() == plain


@pytest.mark.parametrize("title", [
    "", "a wall", "null", "Yes", "1e-3", "0x10", "# no comment", "a: b", "- a", "two\nlines\r", "it's \"so\" \\n",
    " a ", "Größe 😀", "\x07\x7f\x85\u2028\ufeff\ud7ff", "[a, b]", "{a}", "&a *b !c %d @e `f",
    "---", "... a", "a #b", "?", "~"])
def test_any_text_stands_in_the_text_of_a_scene(title: str) -> None:
    named = FULL.with_values({"title": title})
    assert scene_from_text(named.source_text).title == title


def test_scene_is_immutable() -> None:
    with pytest.raises(ValueError, match="frozen"):
        FULL.rate = 3.0  # type: ignore[misc]


@given(st.lists(st.floats(0.0, 2.0 * math.pi), min_size=3, max_size=12, unique=True), st.booleans())
def test_points_on_a_circle_in_order_are_convex_and_stored_counterclockwise(
    angles: list[float], clockwise: bool
) -> None:
    angles = sorted(angles, reverse=clockwise)
    gaps = [
        abs(b - a)
        for a, b in zip(angles, [*angles[1:], angles[0] + (-1) ** clockwise * 2 * math.pi], strict=True)
    ]
    if min(gaps) < 1e-3:
        return
    scene = FULL.with_values({"walls.wedge.vertices": [[math.cos(a), math.sin(a)] for a in angles]})
    corners = scene.walls[3].vertices  # type: ignore[union-attr]
    area = sum(
        x0 * y1 - x1 * y0 for (x0, y0), (x1, y1) in zip(corners, [*corners[1:], corners[0]], strict=True)
    )
    assert area > 0.0


@pytest.mark.parametrize(
    "vertices",
    [
        [[0, 0], [1, 0]],
        [[0, 0], [1, 0], [2, 0]],
        [[0, 0], [1, 0], [1, 0], [0, 1]],
        [[0, 0], [2, 0], [2, 2], [1, 0.5]],
        [[math.cos(4 * math.pi * k / 5), math.sin(4 * math.pi * k / 5)] for k in range(5)],  # a pentagram
        [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]],
        [[0, 0], [1, 1], [1, 0], [0, 1]],
        [[0, 0, 0], [1, 0], [0, 1]],
        3,
    ],
)
def test_polygons_that_are_not_convex_are_refused(vertices: Any) -> None:
    with pytest.raises(SceneError, match="vertices"):
        FULL.with_values({"walls.wedge.vertices": vertices})


def test_schema_describes_every_field_and_states_every_default() -> None:
    schema = scene_schema()
    parts = list(schema["$defs"].values())
    fields = [(part["title"], name, field) for part in parts for name, field in part["properties"].items()]
    assert not [f"{part}.{name}" for part, name, field in fields if not field.get("description")]
    without = [
        name for part, name, field in fields if part == "Contact" and "default" not in field["description"]
    ]
    assert not without
    assert all(part["additionalProperties"] is False for part in parts)


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
         "couplings.four_channel", "gravity"]


@given(st.dictionaries(st.sampled_from(PATHS), junk, min_size=1, max_size=2))
def test_no_value_whatever_ends_in_another_error(values: dict[str, Any]) -> None:
    try:
        changed = PEG.with_values(values)
    except (SceneError, ArgumentError):
        return
    assert scene_from_text(changed.source_text).resolved() == changed.resolved()


@pytest.mark.parametrize("values", [None, [("duration", 1)], "duration", {"hand.force": (x for x in (1, 2, 3))},
                                    {"gravity": {0.0, 9.0}}], ids=["none", "pairs", "text", "generator", "set"])
def test_new_values_of_a_wrong_kind_are_named(values):
    with pytest.raises(ArgumentError, match="^values = "):
        PEG.with_values(values)
