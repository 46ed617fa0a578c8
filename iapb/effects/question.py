"""What the decision about an effect may look at: the scene, its mechanism and pairs, and the caller's choices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from iapb.mechanics.mechanism import Mechanism
from iapb.scene import Scene
from iapb.scene.mechanism import mechanism_of, pairs_of, restitution_by_pair, shapes_of

# What each law makes of a scene's contact section; a law that is not listed is taken to use all of it.
PENALTY, IMPULSES, FRICTION, CLUSTERS, NEWNESS = "penalty", "impulses", "friction", "clusters", "newness"
IMPACT_FRICTION, OWN_RESTITUTION = "impact friction", "own restitution"
LAW_USES = {
    "impulse-augmented penalty with impact friction": frozenset(
        {PENALTY, IMPULSES, FRICTION, CLUSTERS, NEWNESS, IMPACT_FRICTION, OWN_RESTITUTION}
    ),
    "impulse-augmented penalty": frozenset({PENALTY, IMPULSES, FRICTION, CLUSTERS, NEWNESS, OWN_RESTITUTION}),
    "penalty": frozenset({PENALTY, FRICTION, CLUSTERS, NEWNESS}),  # new contacts are marked in the record
    "rigid constraints": frozenset({OWN_RESTITUTION}),
}
COUPLING_FIELDS = {"four-channel": "four_channel", "unilateral": "unilateral"}


@dataclass(frozen=True)
class Effect:
    """One effect of a scene: on or off, why, and what leaving it out would change.

    `reason` and `left_out` are sentences for readers; `reason` carries the scene's own values.
    """

    name: str
    active: bool
    reason: str
    left_out: str


@dataclass(frozen=True)
class Question:
    """A scene and the caller's law, coupling and rendering; None = not chosen yet, so the scene decides alone."""

    scene: Scene
    mechanism: Mechanism
    wall_pairs: int  # candidate pairs of a moving shape and a static one
    body_pairs: int  # of shapes of two trees
    tree_pairs: int  # of shapes of one tree
    restitutions: tuple[float, ...]  # different values of e among the pairs, ascending
    law: str | None
    coupling: str | None
    rendering: str | None

    @classmethod
    def about(cls, scene: Scene, law: str | None, coupling: str | None, rendering: str | None) -> Question:
        """Build the mechanism and count the pairs that can touch."""
        mechanism, shapes = mechanism_of(scene), shapes_of(scene)
        counts = {"wall": 0, "body": 0, "tree": 0}
        pairs = pairs_of(scene, shapes)
        values = tuple(float(e) for e in np.unique(restitution_by_pair(scene, pairs)))
        for a, b in pairs:
            tree_a, body_b = mechanism.tree_of_body[shapes.body[a]], shapes.body[b]
            same = body_b >= 0 and mechanism.tree_of_body[body_b] == tree_a
            counts["wall" if body_b < 0 else "tree" if same else "body"] += 1
        return cls(scene, mechanism, counts["wall"], counts["body"], counts["tree"], values, law, coupling, rendering)

    @property
    def pairs(self) -> int:
        """All candidate pairs of shapes."""
        return self.wall_pairs + self.body_pairs + self.tree_pairs

    def law_uses(self, part: str) -> bool:
        """Return whether the law makes anything of a part of the contact section."""
        return self.law is None or part in LAW_USES.get(self.law, {part})

    def unused(self, part: str) -> str | None:
        """Return why no contact needs a part of the contact section; None if one does."""
        if self.pairs == 0:
            return "nothing can touch: the scene has no pair of shapes"
        return None if self.law_uses(part) else f"the law '{self.law}' does not use it"

    def without_device(self) -> str | None:
        """Return why no device takes part; None if one does."""
        if self.scene.hand is None:
            return "the scene has no hand"
        if self.coupling == "none":
            return "no coupling was asked for: the hand holds the tool itself"
        if self.gains() is None:
            wanted = COUPLING_FIELDS.get(self.coupling or "", "")
            return f"the scene gives no gains under couplings{'.' + wanted if wanted else ''}"
        return None

    def gains(self) -> Any:
        """Return the gains of the chosen coupling, those of any coupling where none is chosen; None without."""
        couplings = self.scene.couplings
        if self.coupling is None:
            return couplings.four_channel or couplings.unilateral
        return getattr(couplings, COUPLING_FIELDS.get(self.coupling, "four_channel"))


def number(value: float) -> str:
    """Return a number as a sentence shows it."""
    return f"{value:g}"


def numbers(values: Any) -> str:
    """Return a list of numbers as a sentence shows it."""
    return "[" + ", ".join(number(value) for value in values) + "]"
