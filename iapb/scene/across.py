"""Rules between the parts of a scene: names, parents, the hand's body, and list lengths that depend on the tool.

They use the plain values of the file, so they report their mistakes even if other fields are wrong.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from iapb.mechanics.joints import KINDS
from iapb.scene.bodies import WORLD, counted
from iapb.scene.parts import Path

MAX_SHAPES = 4000  # bodies and walls together; the number of candidate pairs grows with its square
Mistakes = Iterator[tuple[Path, Any, str]]


def across_parts(given: Any) -> Mistakes:
    """Yield path, value and expectation of each mistake between the parts of a scene given as plain values."""
    if not isinstance(given, dict):
        return
    bodies, walls = _mappings(given, "bodies"), _mappings(given, "walls")
    for where, items, known in (("bodies", bodies, {WORLD: "the static world"}), ("walls", walls, {})):
        for i, item in enumerate(items):
            name = _text(item, "name")
            if name in known:
                yield (where, i, "name"), name, f"a name of its own: {known[name]} has this one"
            elif name is not None:
                known[name] = "an earlier one"
    names, roots = [_text(body, "name") for body in bodies], _roots(bodies)
    for i, body in enumerate(bodies):
        parent = _text(body, "parent", WORLD)
        if parent not in (None, WORLD) and parent not in names[:i]:
            order = "listed before it" if parent in names else "of this scene"
            yield ("bodies", i, "parent"), parent, f"world, or the name of a body {order}"
        if i and roots[i] not in (None, roots[i - 1]) and roots[i] in roots[:i]:  # M would not be block diagonal
            yield ("bodies", i), names[i], f"its place among the other bodies of {roots[i]}'s tree"
    if bodies and all(body.get("joint") == "fixed" for body in bodies):
        yield ("bodies", 0, "joint"), "fixed", "at least one body of the scene that can move"
    count = len(walls) + sum(len(_mappings(body, "shapes")) for body in bodies)
    if count > MAX_SHAPES:
        yield ("bodies",), f"{count} shapes", f"at most {MAX_SHAPES} shapes, walls included"
    yield from _friction_pairs(given, {*names, *(_text(wall, "name") for wall in walls)})
    yield from _tool(given, bodies, names, roots)


def _mappings(given: Any, field: str) -> list[dict[str, Any]]:
    """Return the items of a list; an item that is no mapping becomes an empty one, to keep the numbering."""
    items = given.get(field) if isinstance(given, dict) else None
    return [item if isinstance(item, dict) else {} for item in items] if isinstance(items, list | tuple) else []


def _text(given: Any, field: str, default: str | None = None) -> str | None:
    text = given.get(field, default) if isinstance(given, dict) else None
    return text if isinstance(text, str) else None


def _roots(bodies: list[dict[str, Any]]) -> list[str | None]:
    """Return the name of each body's root; None if names or parents are wrong."""
    root: dict[str | None, str | None] = {}
    for body in bodies:
        name, parent = _text(body, "name"), _text(body, "parent", WORLD)
        root.setdefault(name, name if parent == WORLD else root.get(parent))
    return [root[_text(body, "name")] for body in bodies]


def _friction_pairs(given: Any, names: set[str | None]) -> Mistakes:
    """Check that friction pairs name things of the scene, and that no pair occurs twice."""
    seen: set[frozenset[str]] = set()
    for i, pair in enumerate(_mappings(given.get("contact"), "friction_pairs")):
        between, where = pair.get("between"), ("contact", "friction_pairs", i, "between")
        if not isinstance(between, list | tuple) or not all(isinstance(name, str) for name in between):
            continue
        for k, name in enumerate(between):
            if name not in names and None not in names:
                yield (*where, k), name, "the name of a body or a wall of this scene"
        if len(between) == 2 and between[0] == between[1]:
            yield where, list(between), "two different things"
        if frozenset(between) in seen:
            yield where, list(between), "two things that no earlier pair names"
        seen.add(frozenset(between))


def _tool(given: Any, bodies: list[dict[str, Any]], names: list[str | None], roots: list[str | None]) -> Mistakes:
    """Check that the hand's body exists and moves, and that its lists have one entry per coordinate of the tool."""
    hand, gains, held = given.get("hand"), given.get("couplings"), _text(given.get("hand"), "body")
    sections: list[tuple[Path, Any]] = [(("device",), given.get("device"))]
    if hand is None:
        for path, section in (*sections, (("couplings",), gains)):
            if isinstance(section, dict) and any(section.values()):
                yield path, section, "a hand in the scene: without one no device takes part"
    if held is None or None in names or not names:  # an unreadable body may be the hand's body
        return
    if held not in names:
        yield ("hand", "body"), held, "the name of a body of this scene"
        return
    root, joints = roots[names.index(held)], [_text(body, "joint") for body in bodies]
    if root is None or None in roots or not all(joint in KINDS for joint in joints):
        return
    coordinates = sum(KINDS[str(joint)].nv for joint, own in zip(joints, roots, strict=True) if own == root)
    if coordinates == 0:
        yield ("hand", "body"), held, "a body that can move"
    if isinstance(gains, dict):
        sections += [(("couplings", name), gains.get(name)) for name in ("four_channel", "unilateral")]
    for path, section in sections:
        for field in ("force_limit", "position_resolution", "stiffness", "damping"):
            numbers = section.get(field) if isinstance(section, dict) else None
            if isinstance(numbers, list | tuple) and len(numbers) != coordinates:
                yield (*path, field), numbers, f"{counted(coordinates)}, one per coordinate of the tool"
