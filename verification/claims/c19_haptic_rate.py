"""C19: one pseudo-inverse meets the haptic rate with many simultaneous collisions (open question of VII, VIII)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from verification.claims.claim import Claim
from verification.finding import Column, Row, Table, table_of

if TYPE_CHECKING:
    from verification.claims.study import Study

COLUMNS = (
    Column("method", condition=True, part=True),
    Column("coordinates", condition=True),
    Column("contacts", condition=True),
    Column("late calls", "of 1000", timed=True),
    Column("time", "µs", timed=True),
)
MANY = 60  # collisions at once: ten times the six of the paper's peg in the hole


def measure(study: Study) -> Table:
    """Both methods over coordinates and contacts."""
    from verification.cost.haptic_rate import haptic_rate

    return table_of(COLUMNS, (
        {"method": trial.method, "coordinates": trial.coordinates, "contacts": trial.contacts,
         "late calls": trial.late, "time": 1e6 * trial.seconds}
        for trial in haptic_rate()
    ))  # fmt: skip


def holds(row: Row) -> bool | None:
    """At most one call in a thousand takes longer than 1 ms; None beyond MANY contacts, of which nothing is claimed."""
    from verification.cost.haptic_rate import ALLOWED

    return None if row["contacts"] > MANY else bool(row["late calls"] <= ALLOWED)


def finding(table: Table) -> str:
    """One sentence."""
    from verification.cost.haptic_rate import ALLOWED

    texts = []
    for method in dict.fromkeys(table.column("method")):
        trials = table.where(method=method).records()
        most = dict.fromkeys((row["coordinates"] for row in trials), 0)
        for row in trials:
            if row["late calls"] <= ALLOWED:
                most[row["coordinates"]] = max(most[row["coordinates"]], row["contacts"])
        texts.append(f"{method}: " + ", ".join(f"{count} at d = {d}" for d, count in most.items()))
    return f"Most contacts with 99.9 % of the impacts under 1 ms, on this machine: {'; '.join(texts)}."


CLAIM = Claim(
    id="C19",
    statement="One pseudo-inverse per step meets the haptic rate with many simultaneous collisions.",
    place="Sections VII and VIII, as an open question",
    quantity="How many of 1000 impacts take longer than 1 ms, one after the other, for c contacts whose rows span two "
    "thirds of d coordinates: the printed formula (21) in numpy, and its factored form compiled. Once a size is late, "
    "larger ones are not tried. Times are the thread's own, on this machine.",
    tolerance="One call in a thousand may be late; a size that is late is tried three times. "
    f"Up to {MANY} contacts are taken as many.",
    measure=measure,
    holds=holds,
    finding=finding,
    map_axes=("contacts", "coordinates"),
    map_panels="method",
)
