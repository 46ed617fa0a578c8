"""Rules between the parts of a scene: names, parents, the hand's body, and list lengths that depend on the tool.

They use the plain values of the file, so they report their mistakes even if other fields are wrong.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from pydantic_core import InitErrorDetails

from iapb.mechanics.joints import KINDS
from iapb.scene.bodies import WORLD
from iapb.scene.parts import located

MAX_SHAPES = 4000  # bodies and walls together; the number of candidate pairs grows with its square


def across_parts(given: Any) -> list[InitErrorDetails]:
    """Return the mistakes between the parts of a scene given as plain values."""
    if not isinstance(given, dict):
        return []
    bodies, walls = _mappings(given.get("bodies")), _mappings(given.get("walls"))
    return [
        *_repeated_names("bodies", bodies),
        *_repeated_names("walls", walls),
        *_parents(bodies),
        *_scattered_trees(bodies),
        *_nothing_moves(bodies),
        *_too_many_shapes(bodies, walls),
        *_friction_pairs(given.get("contact"), bodies, walls),
        *_tool(given, bodies),
    ]


def _mappings(items: Any) -> list[dict[str, Any]]:
    """Return the items of a list; an item that is no mapping becomes an empty one, to keep the numbering."""
    if not isinstance(items, (list, tuple)):
        return []
    return [item if isinstance(item, dict) else {} for item in items]


def _name(mapping: dict[str, Any], field: str = "name", default: str | None = None) -> str | None:
    text = mapping.get(field, default)
    return text if isinstance(text, str) else None


def _repeated_names(where: str, items: list[dict[str, Any]]) -> Iterator[InitErrorDetails]:
    seen: set[str] = {WORLD} if where == "bodies" else set()
    for i, item in enumerate(items):
        name = _name(item)
        if name in seen:
            taken = "the static world" if name == WORLD else "an earlier one"
            yield located((where, i, "name"), name, f"a name of its own: {taken} has this one")
        elif name is not None:
            seen.add(name)


def _parents(bodies: list[dict[str, Any]]) -> Iterator[InitErrorDetails]:
    names = [_name(body) for body in bodies]
    for i, body in enumerate(bodies):
        parent = _name(body, "parent", WORLD)
        if parent is None or parent == WORLD or parent in names[:i]:
            continue
        advice = "listed before it" if parent in names else "of this scene"
        yield located(("bodies", i, "parent"), parent, f"world, or the name of a body {advice}")


def _scattered_trees(bodies: list[dict[str, Any]]) -> Iterator[InitErrorDetails]:
    """Check that the bodies of one tree are consecutive, so that the mass matrix is block diagonal."""
    roots = _roots(bodies)
    for i in range(1, len(roots)):
        if roots[i] is not None and roots[i] != roots[i - 1] and roots[i] in roots[:i]:
            yield located(
                ("bodies", i), _name(bodies[i]), f"its place among the other bodies of {roots[i]}'s tree"
            )


def _roots(bodies: list[dict[str, Any]]) -> list[str | None]:
    """Return the name of each body's root; None if names or parents are wrong."""
    root: dict[str | None, str | None] = {}
    for body in bodies:
        name, parent = _name(body), _name(body, "parent", WORLD)
        root.setdefault(name, name if parent == WORLD else root.get(parent))
    return [root[_name(body)] for body in bodies]


def _nothing_moves(bodies: list[dict[str, Any]]) -> Iterator[InitErrorDetails]:
    if bodies and all(_name(body, "joint") == "fixed" for body in bodies):
        yield located(("bodies", 0, "joint"), "fixed", "at least one body of the scene that can move")


def _too_many_shapes(bodies: list[dict[str, Any]], walls: list[dict[str, Any]]) -> Iterator[InitErrorDetails]:
    count = len(walls) + sum(len(_mappings(body.get("shapes"))) for body in bodies)
    if count > MAX_SHAPES:
        yield located(("bodies",), f"{count} shapes", f"at most {MAX_SHAPES} shapes, walls included")


def _friction_pairs(
    contact: Any, bodies: list[dict[str, Any]], walls: list[dict[str, Any]]
) -> Iterator[InitErrorDetails]:
    """Check that friction pairs name things of the scene, and that no pair occurs twice."""
    names, seen, where = {_name(item) for item in (*bodies, *walls)}, set(), ("contact", "friction_pairs")
    for i, pair in enumerate(_mappings(contact.get("friction_pairs") if isinstance(contact, dict) else None)):
        between = pair.get("between")
        if not isinstance(between, (list, tuple)) or not all(isinstance(name, str) for name in between):
            continue
        for k, name in enumerate(between):
            if name not in names and None not in names:
                yield located((*where, i, "between", k), name, "the name of a body or a wall of this scene")
        if len(between) == 2 and between[0] == between[1]:
            yield located((*where, i, "between"), list(between), "two different things")
        if frozenset(between) in seen:
            yield located((*where, i, "between"), list(between), "two things that no earlier pair names")
        seen.add(frozenset(between))


def _tool(given: dict[str, Any], bodies: list[dict[str, Any]]) -> Iterator[InitErrorDetails]:
    """Check that the hand's body exists and moves, and that its lists have one entry per coordinate of the tool."""
    couplings, device = given.get("couplings"), given.get("device")
    hand = given.get("hand")
    if hand is None:
        for field, section in (("device", device), ("couplings", couplings)):
            if isinstance(section, dict) and any(section.values()):
                yield located((field,), section, "a hand in the scene: without one no device takes part")
        return
    held = _name(hand, "body") if isinstance(hand, dict) else None
    if held is None:
        return
    names = [_name(body) for body in bodies]
    if None in names or not names:
        return  # the unreadable body may be the hand's body
    if held not in names:
        yield located(("hand", "body"), held, "the name of a body of this scene")
        return
    coordinates = _tree_coordinates(bodies, held)
    if coordinates == 0:
        yield located(("hand", "body"), held, "a body that can move")
    if coordinates is not None:
        yield from _lengths("device", device, ("force_limit", "position_resolution", "damping"), coordinates)
        for name, gains in couplings.items() if isinstance(couplings, dict) else ():
            if name in ("four_channel", "unilateral"):
                yield from _lengths(f"couplings.{name}", gains, ("stiffness", "damping"), coordinates)


def _lengths(where: str, section: Any, fields: tuple[str, ...], count: int) -> Iterator[InitErrorDetails]:
    for field in fields if isinstance(section, dict) else ():
        numbers = section.get(field)
        if isinstance(numbers, (list, tuple)) and len(numbers) != count:
            yield located(
                (*where.split("."), field),
                numbers,
                f"{count} number{'' if count == 1 else 's'}, one per coordinate of the tool",
            )


def _tree_coordinates(bodies: list[dict[str, Any]], held: str) -> int | None:
    """Return the number of coordinates of the tree that a body belongs to; None if it cannot be determined."""
    roots = _roots(bodies)
    held_root = roots[[_name(body) for body in bodies].index(held)]
    joints = [_name(body, "joint") for body in bodies]
    if held_root is None or None in roots or any(joint not in KINDS for joint in joints):
        return None
    return sum(KINDS[joint or ""].nv for joint, root in zip(joints, roots, strict=True) if root == held_root)
