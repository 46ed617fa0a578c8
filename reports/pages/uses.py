"""The runs of the manifest, gathered by what was made from them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from reports.pages.records import StoredFile


@dataclass(frozen=True)
class RunsOf:
    """The runs that one claim, topic or figure's input was made from."""

    user: str
    runs: tuple[StoredFile, ...]

    @property
    def id(self) -> str:
        """Where the page lists them."""
        return anchor(self.user)

    @property
    def size(self) -> int:
        """Bytes of all of them."""
        return sum(run.size or 0 for run in self.runs)

    @property
    def missing(self) -> int:
        """How many are not whole files: the simulation gave up, or the file was removed."""
        return sum(run.status != "complete" for run in self.runs)


def anchor(user: str) -> str:
    """Return the id of the line of the manifest that lists a user's runs."""
    return "runs-" + re.sub(r"[^A-Za-z0-9]+", "-", user)


def runs_by_user(files: Sequence[StoredFile]) -> tuple[RunsOf, ...]:
    """Return one entry per user, in the order of first use; a run stands under each of its users."""
    users = dict.fromkeys(user for run in files for user in run.used_by)
    return tuple(RunsOf(user, tuple(run for run in files if user in run.used_by)) for user in users)
