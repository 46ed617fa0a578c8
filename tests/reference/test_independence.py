"""Rigid worlds and event-driven truth share descriptions with the engine (docs/architecture.md),
and no algorithm.

The import contract forbids the engine's algorithms; an algorithm could also be called as a method,
such as `system.mechanism.mass_matrix`, so the attributes that the references read are listed here.
"""

from __future__ import annotations

import ast
from pathlib import Path

REFERENCE = Path(__file__).parents[2] / "reference"
WORLDS = (
    "time_stepping",
    "contact_rows",
    "rigid_step",
    "rigid_body",
    "free_motion",
    "scene_events",
)
SHARED = {
    "iapb.contact.finding",  # contacts of given placements
    "iapb.contact.geometry",  # kinds of shapes, their parameters
    "iapb.contact.laws",  # the record of a step, names of the scene's parts
    "iapb.errors",
    "iapb.lazy",
    "iapb.names",
    "iapb.mechanics.mechanism",  # bodies, joints, parents
    "iapb.run",  # the contact states' numbers
    "iapb.scene",
    "iapb.scene.mechanism",  # restitution and friction of a pair
    "iapb.system",  # arrays of the scene, the hand's force
}
READ = {
    "system": {
        "device_mechanism",
        "finder",
        "surfaces",
        "gravity",
        "joint_damping",
        "mechanism",
        "pairs",
        "restitutions",
        "scene",
        "shapes",
        "solids",
        "start",
        "stops",
        "tool_dofs",
        "tool_tree",
    },
    "mechanism": {"bodies", "nq", "nv"},
}
NODES = [
    node
    for name in WORLDS
    for node in ast.walk(ast.parse((REFERENCE / f"{name}.py").read_text("utf-8")))
]


def test_the_references_share_descriptions_with_the_engine_and_no_algorithm() -> None:
    found = {node.module for node in NODES if isinstance(node, ast.ImportFrom)}
    assert {name for name in found if name and name.split(".")[0] == "iapb"} == SHARED
    assert not any(
        isinstance(node, ast.Import) and node.names[0].name.startswith("iapb") for node in NODES
    )
    for owner, allowed in READ.items():
        read = {
            node.attr
            for node in NODES
            if isinstance(node, ast.Attribute)
            and owner in (getattr(node.value, "id", None), getattr(node.value, "attr", None))
        }
        assert read == allowed
    text = (REFERENCE.parent / "docs" / "architecture.md").read_text(encoding="utf-8")
    section = text.split("## What the engine and the references share")[1].split("\n## ")[0]
    assert all(f"`{name}`" in section for name in SHARED)
