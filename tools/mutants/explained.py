"""Survivors that are no gap in the tests, each with its reason (explained.toml)."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path

from tools.mutants.judge import Judgement

TABLE = Path(__file__).with_name("explained.toml")
# No result can differ; or what differs is speed, memory, or a choice inside a margin that no law fixes.
KINDS = ("equivalent", "harmless")


@dataclass(frozen=True)
class Explanation:
    """Why a change of this line may go unnoticed."""

    file: str
    line: str
    kind: str
    reason: str
    becomes: str = ""  # empty: whatever the line becomes

    def fits(self, judgement: Judgement) -> bool:
        """Does it explain this survivor?"""
        same_line = (self.file, self.line) == (judgement.file, judgement.line)
        return same_line and self.becomes in ("", judgement.becomes)


def explanations(table: Path = TABLE) -> list[Explanation]:
    """Read the table; a kind that it does not know is an error."""
    read = [Explanation(**entry) for entry in tomllib.loads(table.read_text()).get("survivor", [])]
    for entry in read:
        if entry.kind not in KINDS:
            raise ValueError(f"{table.name}: {entry.file}: kind is one of {KINDS}, not {entry.kind!r}")
    return read


def explanation_of(judgement: Judgement, table: list[Explanation]) -> Explanation | None:
    """The first that fits."""
    return next((entry for entry in table if entry.fits(judgement)), None)
