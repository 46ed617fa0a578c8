"""Rigid worlds and event-driven truth share descriptions with the engine (docs/architecture.md), and no algorithm."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[2]
WORLDS = ("time_stepping", "contact_finding", "contact_rows", "rigid_step", "free_motion", "event_driven",
          "scene_events")  # fmt: skip

SHARED = {
    "iapb.contact.geometry",  # kinds of shapes, their parameters
    "iapb.contact.laws",  # the record of a step, names of the scene's parts
    "iapb.errors", "iapb.lazy", "iapb.names",
    "iapb.mechanics.mechanism",  # bodies, joints, parents
    "iapb.run",  # the contact states' numbers
    "iapb.scene", "iapb.scene.mechanism",  # restitution and friction of a pair
    "iapb.system",  # arrays of the scene, the hand's force
}  # fmt: skip
READ = {
    "system": {"device_mechanism", "frictions", "gravity", "joint_damping", "mechanism", "pairs", "restitutions",
               "scene", "shapes", "start", "stops", "tool_dofs", "tool_tree"},
    "mechanism": {"bodies", "nq", "nv"},
}  # fmt: skip


@cache
def tree(module: str) -> ast.Module:
    path = ROOT / Path(*module.split("."))
    path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return ast.parse(path.read_text(encoding="utf-8"))


def imported(module: str) -> Iterator[str]:
    """Return the modules that a module imports, also inside functions: `from a import b` is a.b if that is a module."""
    for node in ast.walk(tree(module)):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            base = ROOT / Path(*node.module.split("."))
            for alias in node.names:
                inner = (base / f"{alias.name}.py").is_file() or (base / alias.name).is_dir()
                yield f"{node.module}.{alias.name}" if inner else node.module


def reached() -> set[str]:
    """Return the modules of `reference` that the worlds and the truth consist of."""
    found, waiting = set[str](), [f"reference.{name}" for name in WORLDS]
    while waiting:
        module = waiting.pop()
        if module not in found:
            found.add(module)
            waiting += [name for name in imported(module) if name.startswith("reference.")]
    return found


def read(module: str, owner: str) -> set[str]:
    """Return the attributes read from names or attributes called `owner`."""
    return {node.attr for node in ast.walk(tree(module)) if isinstance(node, ast.Attribute)
            and (getattr(node.value, "id", None) == owner or getattr(node.value, "attr", None) == owner)}  # fmt: skip


def test_the_references_import_descriptions_of_the_engine_and_no_algorithm() -> None:
    found = {name for module in reached() for name in imported(module) if name.split(".")[0] == "iapb"}
    assert found == SHARED
    assert not [name for name in found if "kernels" in name or "integrators" in name or "impact" in name]
    assert "reference.rigid_body" in reached() and "reference.complementarity.laws" in reached()


def test_the_references_read_only_descriptions_from_the_engines_objects() -> None:
    """An algorithm could also be called as a method, such as `system.mechanism.mass_matrix`."""
    modules = reached() - {"reference.event_driven"}  # its `system` is its own LinearSystem
    for owner, allowed in READ.items():
        assert set().union(*(read(module, owner) for module in modules)) == allowed


def test_the_shared_modules_are_named_in_the_documents() -> None:
    text = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    section = text.split("## What the engine and the references share")[1].split("\n## ")[0]
    assert all(f"`{name}`" in section for name in SHARED)
