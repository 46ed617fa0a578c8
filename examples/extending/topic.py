"""A topic of the report: for how much of the time the peg touches the corner, by world.

In the project it is a file of `verification` or reports/evidence, and one line of `TOPICS` in
reports/evidence/topics.py. A template of a page shows its tables.

Prints:
    reproduced
"""

import numpy as np

from reports.evidence.topics import TOPICS, plans
from reports.runner import Runner
from verification.check import Check, Study, Topic
from verification.table import Row


def worlds(study: Study) -> tuple[str, ...]:
    """Return the cases."""
    return ("IAPB", "PB")


def share(study: Study, world: str) -> Row:
    """Return the share of steps with a contact in one world."""
    run = study.run(study.scene("peg_corner"), world)
    touches = np.diff(run.contacts.offsets) > 0
    return {"world": world, "share of steps in contact": float(np.mean(touches))}


def is_most(row: Row) -> bool:
    """Return whether the peg touches for most of the time."""
    return bool(row["share of steps in contact"] > 0.5)


TOPIC = Topic(
    key="time-in-contact",
    title="Time in contact",
    question="How much of the time do the worlds keep the peg in contact?",
    checks=(
        Check(
            key="shares",
            question="The peg is in contact for most of the time.",
            cases=worlds,
            row=share,
            holds=is_most,
        ),
    ),
)
TOPICS["time-in-contact"] = f"{__name__}:TOPIC"

made = plans()["time-in-contact"].compute(Runner("out/runs"), "quick", lambda done, total: None, [])
print(made.parts[0].verdict)
