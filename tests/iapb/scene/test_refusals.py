"""One table of refusals: what a scene may not say, the field that is named, and the line; no text
breaks the reader."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.errors import ArgumentError, SceneError
from iapb.scene import Scene, find_scene, load_scene, scene_from_text

PLANE = """\
name: full
rate: 1000
duration: 1
gravity: [0, -9.81]
bodies:
  - {name: base, joint: fixed}
  - {name: slide, parent: base, joint: prismatic, axis: [2, 0], mass: 1}
  - {name: arm, parent: slide, joint: revolute, center_of_mass: [0.1, 0], mass: 1, shapes: [{kind: box, size: [1, 2]}]}
  - {name: puck, joint: planar, mass: 1, inertia: 1, shapes: [{kind: circle, radius: 0.1}]}
  - {name: foot, joint: fixed}
walls:
  - {name: floor, kind: half_plane, point: [0, 0], normal: [0, 1]}
  - {name: post, kind: circle, radius: 0.1}
  - {name: wedge, kind: polygon, vertices: [[0, 0], [1, 0], [0, 1]]}
contact: {friction: 0.2}
hand: {body: arm}
device: {force_limit: [1, 1], position_resolution: [0, 0], damping: [0, 0]}
couplings:
  four_channel: {stiffness: [1, 1], damping: [1, 1]}
  unilateral: {stiffness: [1, 1], damping: [1, 1]}
"""
SPACE = """\
name: full
dimensions: 3
rate: 1000
duration: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: thing, joint: free_flyer, mass: 1, inertia: [1, 2, 3]}
  - {name: wheel, joint: continuous, axis: [0, 0, 1], inertia: [0, 0, 1]}
walls:
  - {name: floor, kind: half_space, point: [0, 0, 0], normal: [0, 0, 1]}
"""
FULL = scene_from_text(PLANE)
FULL_SPACE = scene_from_text(SPACE)

NOT_A_NUMBER = ["x", None, True, [1], {}, math.nan, math.inf, 1e10]
NOT_POSITIVE = [*NOT_A_NUMBER, 0.0, -1.0]
NEGATIVE = [*NOT_A_NUMBER, -1e-9]
OWN = [value for value in NEGATIVE if value is not None]  # None: not given
NOT_A_VECTOR = [1.0, "x", None, [1.0], [1.0, 2.0, 3.0, 4.0], ["x", 0], [math.nan, 0.0]]
NOT_A_NAME = ["", "a b", "a.b", "1a", "é", "a\n", 3, None, "x" * 65]
NOT_A_PAIR_OF_GAINS = [[1], [1, 1, 1], [-1, 1], [1, "x"], 3, []]

# path: values that are refused there; the mistake names the field
IN_THE_PLANE: dict[str, list[Any]] = {
    "name": [name for name in NOT_A_NAME if name != "a.b"],
    "rate": [*NOT_POSITIVE, 1.1e6],
    "duration": [*NOT_POSITIVE, 1e-4, 1e5],
    "integrator": ["leapfrog"],
    "gravity": [value for value in NOT_A_VECTOR if value is not None],
    "bodies": [[], None, {}, "x", [3], [{"name": "b", "joint": "fixed"}]],
    "bodies.puck.name": [*NOT_A_NAME, "arm", "world"],
    "bodies.arm.parent": [*NOT_A_NAME, "puck", "arm", "nobody"],
    "bodies.arm.joint": ["hinge", None, 3, "planar", "free_flyer"],
    "bodies.arm.axis": [[1.0, 0.0]],
    "bodies.arm.mass": NEGATIVE,
    "bodies.puck.density": [value for value in NOT_POSITIVE if value is not None],
    "bodies.slide.density": [1.0],  # no shapes
    "bodies.arm.joint_damping": [*(x for x in NEGATIVE if x != [1]), [1.0, 1.0], [-1.0]],
    "bodies.arm.joint_friction": [*(x for x in NEGATIVE if x != [1]), [1.0, 1.0], [-1.0]],
    "bodies.arm.joint_mimic": [
        3,
        {},
        {"body": "nobody"},
        {"body": "arm"},
        {"body": "base"},
        {"body": "slide", "multiplier": "x"},
        {"body": "slide", "offset": math.inf},
        {"body": "slide", "factor": 2.0},
    ],
    "bodies.puck.joint_mimic": [{"body": "slide"}],
    "bodies.puck.joint_damping": [1.0, [1.0, 1.0], [1.0, 1.0, -1.0]],
    "bodies.arm.joint_limits": [
        1.0,
        [1.0],
        [1.0, 2.0],
        [1.0, -1.0],
        [0.0, 0.0],
        ["x", 1.0],
        [-1.0, math.nan],
    ],
    "bodies.puck.joint_limits": [[-1.0, 1.0]],
    "bodies.base.joint_limits": [[-1.0, 1.0]],
    "bodies.arm.shapes": [None, 3, [3], [{"kind": "capsule"}], [{"kind": "half_plane"}], [{}]],
    "bodies.arm.shapes.0.size": [[0.0, 1.0], [1.0, -1.0], [1.0], 1.0],
    "bodies.base.position": [[0.0]],
    "bodies.arm.position": [[0.0, 0.0], ["x"], 0.0, [math.nan]],
    "bodies.puck.position": [[0.0], [0.0, 0.0, 0.0, 0.0]],
    "bodies.puck.velocity": [[0.0], ["x", 0.0, 0.0]],
    "walls": [None, 3, [3], [{"kind": "circle", "radius": 1}]],
    "walls.post.name": [*NOT_A_NAME, "floor"],
    "walls.floor.kind": ["plane", None, "box"],
    "walls.wedge.vertices": [
        3,
        [[0, 0], [1, 0]],
        [[0, 0], [1, 0], [2, 0]],
        [[0, 0], [1, 0], [1, 0], [0, 1]],
        [[0, 0, 0], [1, 0], [0, 1]],
        [[0, 0], [2, 0], [2, 2], [1, 0.5]],
        [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]],
        [[0, 0], [1, 1], [1, 0], [0, 1]],
        [[math.cos(4 * math.pi * k / 5), math.sin(4 * math.pi * k / 5)] for k in range(5)],
    ],  # a pentagram
    "contact.forces": ["explicit", None],
    "contact.stiffness": [value for value in OWN if value != 1e10] + [1.1e15],
    "contact.damping": [value for value in OWN if value != 1e10] + [1.1e15],
    "contact.penalty": ["soft", None, True],
    "contact.restitution": [*NEGATIVE, 1.001],
    "contact.self_collision_rows": ["both", None],
    "contact.impact_time": ["now", None],
    "hand.body": [*NOT_A_NAME, "nobody", "floor", "foot"],
    "hand.force": [[1.0, 2.0], 3.0, None, [math.nan, 0.0, 0.0]],
    "hand.force_table": [1.0, [1.0], [[0.0, 1.0]], [[0.0, 1.0, 1.0, "x"]], [[0.0] * 4, [0.0] * 4]],
    "hand.force_function": [
        "t",
        ["t"],
        [None, "t", "t"],
        *(
            [text, "0", "0"]
            for text in (
                "__import__('os').system('ls')",
                "t.real",
                "open(t)",
                "t if t else 1",
                "(",
                "sin()",
                "1/t",
                "2**0.5",
                "1e400",
                "'1'",
                "",
                "[t]",
                "u",
                "9" * 1900,
                "-" * 1900 + "1",
            )
        ),
    ],
    "device": [[], 3],
    "device.force_limit": [*NOT_A_PAIR_OF_GAINS, [0, 1]],
    "device.delay": [-1, 1001, 1.0, "1", None, True],
    **{
        path: values
        for values, paths in (
            (
                NOT_POSITIVE,
                "bodies.puck.shapes.0.radius contact.friction_velocity",
            ),
            (
                NEGATIVE,
                "bodies.slide.mass bodies.puck.mass bodies.puck.inertia "
                "bodies.arm.inertia contact.friction contact.approach_velocity "
                "contact.cluster_distance "
                "contact.coherence_distance",
            ),
            (NOT_A_NUMBER, "bodies.arm.angle bodies.arm.shapes.0.angle"),
            (
                NOT_A_VECTOR,
                "bodies.arm.origin bodies.arm.shapes.0.center walls.floor.point hand.point "
                "bodies.arm.center_of_mass",
            ),
            (OWN, "bodies.arm.friction walls.floor.friction"),
            ([*OWN, 1.001], "bodies.arm.restitution walls.floor.restitution"),
            (
                NOT_A_PAIR_OF_GAINS,
                "device.position_resolution device.damping couplings.four_channel.stiffness "
                "couplings.four_channel.damping couplings.unilateral.stiffness "
                "couplings.unilateral.damping",
            ),
            ([1, "true", None], "contact.self_collisions"),
            ([3, None, "x" * 2001], "title source"),
            (
                [*NOT_A_VECTOR, [0.0, 0.0]],
                "bodies.slide.axis walls.floor.normal",
            ),
        )
        for path in paths.split()
    },
}
IN_SPACE: dict[str, list[Any]] = {
    "dimensions": [2, None],
    "gravity": [[0.0, 1.0]],
    "bodies.thing.joint": ["hinge"],
    "bodies.thing.mass": [-1.0],
    "bodies.thing.position": [[0, 0, 0], [0, 0, 0, 0, 0, 1, 1]],
    "bodies.thing.inertia": [
        [[1, 0.1, 0], [0.2, 2, 0], [0, 0, 3]],
        1.0,
    ],
    "bodies.wheel.axis": [None, [0, 0], [0, 0, 0]],
    "bodies.wheel.position": [[1, 1]],
    "walls.floor.normal": [[0, 1], [0, 0, 0]],
}
TABLE = [(FULL, *row) for row in IN_THE_PLANE.items()] + [
    (FULL_SPACE, *row) for row in IN_SPACE.items()
]


@pytest.mark.parametrize(("scene", "path", "values"), TABLE, ids=[row[1] for row in TABLE])
def test_every_field_refuses_what_it_cannot_take(
    scene: Scene, path: str, values: list[Any]
) -> None:
    field = path.split(".")[-1]
    for value in values:
        with pytest.raises(SceneError) as caught:
            scene.with_values({path: value})
        near = [
            m
            for m in caught.value.mistakes
            if field in m.path or m.path.startswith(path.split(".")[0])
        ]
        assert near, (
            f"{path} = {value!r} was refused, but the mistake points elsewhere: {caught.value}"
        )


def field_names(part: Any) -> set[str]:
    """Return the names of all fields below a plain value."""
    items = part.values() if isinstance(part, dict) else part if isinstance(part, list) else ()
    return set(part if isinstance(part, dict) else ()).union(*map(field_names, items))


def test_no_field_is_left_out_above() -> None:
    tried = {path.split(".")[-1] for path in IN_THE_PLANE}
    assert field_names(FULL.resolved()) - tried == {
        "contact",
        "hand",
        "couplings",
        "four_channel",
        "unilateral",
    }


# (text that is replaced, its replacement, field of the mistake, its line); in the plane unless the
# text is of SPACE
WRITTEN = [
    ("rate: 1000", "rate: fast", "rate", 2),
    ("rate: 1000", "rate: 1\nrate: 2", "rate", 3),
    ("duration: 1\n", "", "duration", 1),
    ("joint: fixed", "joint: fixd", "bodies[0].joint", 6),
    ("axis: [2, 0], ", "", "bodies[1].axis", 7),
    ("size: [1, 2]", "size: [1, 2], colour: red", "bodies[2].shapes[0].colour", 8),
    ("radius: 0.1}]}\n", "}]}\n", "bodies[3].shapes[0].radius", 9),
    ("joint: planar, mass: 1", "joint: planar, density: 3, mass: 1", "bodies[3].density", 9),
    ("kind: half_plane", "kind: halfplane", "walls[0].kind", 12),
    ("normal: [0, 1]", "normal: [0, 0]", "walls[0].normal", 12),
    ("friction: 0.2", "fricton: 0.2", "contact.fricton", 15),
    *(
        ("friction: 0.2", f"friction: {word}", "contact.friction", 15)
        for word in (
            ".nan",
            ".inf",
            "1e999",
            "yes",
            "0x10",
            "1_000",
            "'1'",
            "true",
            "null",
            "[1]",
            "9" * 5000,
        )
    ),
    ("body: arm", "body: am", "hand.body", 16),
    ("hand: {body: arm}\n", "", "device", 16),
    ("damping: [0, 0]", "damping: [0]", "device.damping", 17),
    ("dimensions: 3\n", "", "bodies[0].joint", 6),
    ("dimensions: 3\n", "", "dimensions", 1),
    ("inertia: [1, 2, 3]", "inertia: 1", "bodies[0].inertia", 7),
]


@pytest.mark.parametrize(("old", "new", "field", "line"), WRITTEN)
def test_a_mistake_stands_at_its_line(old: str, new: str, field: str, line: int) -> None:
    text = next(text for text in (PLANE, SPACE) if old in text).replace(old, new, 1)
    with pytest.raises(SceneError) as caught:
        scene_from_text(text, "wrong.yaml")
    found = {mistake.path: mistake for mistake in caught.value.mistakes}
    assert field in found and found[field].line == line, found
    assert all(mistake.file == "wrong.yaml" and mistake.expected for mistake in found.values())


def test_all_mistakes_come_at_once_as_an_editor_expects_them() -> None:
    wrong = (
        PLANE.replace("rate: 1000", "rate: 0")
        .replace("mass: 1, inertia", "mass: -1, inertia")
        .replace("friction: 0.2", "fricton: 0.2")
        .replace("body: arm", "body: am")
    )
    with pytest.raises(SceneError) as caught:
        scene_from_text(wrong, "wrong.yaml")
    places = [
        (m.line, wrong.splitlines()[m.line - 1][m.column - 1 :][:7], m.path)
        for m in caught.value.mistakes
    ]
    assert places == [
        (2, "0", "rate"),
        (9, "-1, ine", "bodies[3].mass"),
        (15, "fricton", "contact.fricton"),
        (16, "am}", "hand.body"),
    ]
    assert str(caught.value.mistakes[0]).startswith(
        "wrong.yaml:2:7: rate = 0: expected a number >= "
    )
    assert "did you mean friction?" in caught.value.mistakes[2].expected
    with pytest.raises(SceneError) as caught:
        FULL.with_values({"bodies.puck.mass": -1, "contact.frition": 3, "device.delay": 2.5})
    assert {m.path for m in caught.value.mistakes} == {
        "bodies[3].mass",
        "contact.frition",
        "device.delay",
    }


@pytest.mark.parametrize(
    "part", ["contact", "hand", "device", "couplings.unilateral", "bodies.arm", "walls.post"]
)
def test_unknown_fields_are_refused_everywhere(part: str) -> None:
    with pytest.raises(SceneError) as caught:
        FULL.with_values({f"{part}.masss": 1})
    assert caught.value.mistakes[0].path.endswith(".masss")


def test_bodies_of_one_tree_stand_together() -> None:
    plain = FULL.resolved()
    plain["bodies"] = [plain["bodies"][i] for i in (0, 1, 3, 2)]
    with pytest.raises(ValueError, match="base's tree"):
        Scene.model_validate(plain)


@pytest.mark.parametrize(
    ("text", "line", "word"),
    [
        ("name: [1, 2\nrate: 3\n", 2, "YAML"),
        ("name: 'open\n", 2, "YAML"),
        ("\tname: x\n", 1, "YAML"),
        ("name: \x00\n", 1, "YAML"),
        ('name: "\\UFFFFFFFF"\n', 1, "YAML"),
        ("name: !!python/object/apply:os.getcwd []\n", 1, "tags"),
        ("a: 1\n---\nb: 2\n", 2, "document"),
        ("a: *b\n", 1, "alias"),
        ("a: &x [1, *x]\n", 1, "levels"),
        ("? [1, 2]\n: 3\n", 1, "name of a field"),
        ("a: " + "[" * 100 + "]" * 100, 1, "levels"),
        ("a: " + "[" * 5_000, 1, "YAML"),
        (
            "a: &a ["
            + "1, " * 400
            + "1]\nb: &b ["
            + "*a, " * 400
            + "*a]\nc: ["
            + "*b, " * 9
            + "*b]\n",
            1,
            "smaller",
        ),
        ("#" * 1_000_001, 1, "at most 1000000"),
        *((text, 1, "mapping") for text in ("", "3\n", "[]\n", "just words\n", "~\n")),
    ],
)
def test_what_is_no_document_is_one_mistake_with_its_line(text: str, line: int, word: str) -> None:
    with pytest.raises(SceneError) as caught:
        scene_from_text(text)
    (mistake,) = caught.value.mistakes
    assert (mistake.path, mistake.line) == ("(file)", line) and word in mistake.expected


def test_files_that_cannot_be_read_say_why(tmp_path: Path) -> None:
    for path in (tmp_path / "absent.yaml", tmp_path, 0, None):  # 0 would be the standard input
        with pytest.raises(ArgumentError, match="^path = "):
            load_scene(path)  # type: ignore[arg-type]
    path = tmp_path / "latin.yaml"
    path.write_bytes(b"name: a\ntitle: \xe9\xff\n")
    with pytest.raises(SceneError, match=r"latin.yaml:2:1.*UTF-8"):
        load_scene(path)


@pytest.mark.parametrize(
    "name",
    [None, 3, b"peg_corner", {}, "a\0b", "a" * 5000, "a/" + "b" * 5000, "a" * 5000 + ".yaml"],
    ids=lambda name: repr(name)[:9],
)
def test_what_cannot_be_a_scene_is_named(name: Any) -> None:
    with pytest.raises(ArgumentError, match="^scene = "):
        find_scene(name)


@pytest.mark.parametrize(
    "path", ["bodies.peg_2.mass", "contact.friction.x", "walls.7.point", "bodies..mass", "", 3]
)
def test_paths_that_lead_nowhere_are_named(path: Any) -> None:
    with pytest.raises(ArgumentError) as caught:
        FULL.with_values({path: 1})
    assert caught.value.value == path


@pytest.mark.parametrize(
    "values",
    [
        None,
        [("duration", 1)],
        "duration",
        {"hand.force": (x for x in (1, 2, 3))},
        {"gravity": {0.0, 9.0}},
    ],
    ids=["none", "pairs", "text", "generator", "set"],
)
def test_new_values_of_a_wrong_kind_are_named(values: Any) -> None:
    with pytest.raises(ArgumentError, match="^values = "):
        FULL.with_values(values)


junk = st.recursive(
    st.none()
    | st.booleans()
    | st.integers()
    | st.floats()
    | st.text(max_size=8)
    | st.binary(max_size=4),
    lambda inner: (
        st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=6), inner, max_size=4)
    ),
    max_leaves=8,
)


@given(
    st.dictionaries(
        st.sampled_from(
            [
                "name",
                "rate",
                "bodies",
                "bodies.arm",
                "bodies.arm.shapes",
                "bodies.arm.shapes.0",
                "bodies.arm.shapes.0.kind",
                "bodies.arm.position",
                "walls",
                "walls.floor",
                "walls.floor.kind",
                "contact",
                "hand",
                "device",
                "couplings",
                "couplings.four_channel",
                "gravity",
            ]
        ),
        junk,
        min_size=1,
        max_size=2,
    )
)
def test_no_value_whatever_ends_in_another_error(values: dict[str, Any]) -> None:
    try:
        changed = FULL.with_values(values)
    except (SceneError, ArgumentError):
        return
    assert scene_from_text(changed.source_text).resolved() == changed.resolved()


@given(st.text(alphabet=st.sampled_from("[]{}:,-?&*!|>'\"%@#~ \n\tab01.e"), max_size=60))
def test_any_text_is_a_scene_or_a_scene_error(text: str) -> None:
    try:
        scene_from_text(text)
    except SceneError as refusal:
        assert refusal.mistakes
        for mistake in refusal.mistakes:
            assert 1 <= mistake.line <= len(text.splitlines()) + 2 and mistake.column >= 1
            assert mistake.path and mistake.expected
