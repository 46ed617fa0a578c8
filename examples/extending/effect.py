"""An effect: whether contacts may pull, with the reason.

In the project it is one row of `EFFECTS` in iapb/effects.py. An effect that changes the step
needs a flag of its name in `Switches` (iapb/contact/kernels/world.py), too.

Prints:
    False contact.penalty = clamped
    True contact.penalty = printed
"""

from iapb import decide_effects, find_scene, load_scene
from iapb.contact.laws import PENALTY, Penalty
from iapb.effects import EFFECTS, Question, Rule


def clamped(question: Question) -> str:
    """Return why the effect is off; empty if it is on."""
    is_printed = question.scene.contact.penalty == "printed"
    return "" if is_printed else "contact.penalty = clamped"


EFFECTS["pulling_contacts"] = Rule(
    on=lambda question: "contact.penalty = printed",
    left_out="a body that leaves would never be held back",
    off=clamped,
    parts=(PENALTY,),
)

scene = load_scene(find_scene("peg_corner"))
for value in ("clamped", "printed"):
    effects = decide_effects(scene.with_values({"contact.penalty": value}), law=Penalty())
    found = next(effect for effect in effects if effect.name == "pulling_contacts")
    print(found.active, found.reason)
