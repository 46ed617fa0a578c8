"""The runs of the manifest, grouped by the claim, topic or figure input that uses them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from reports.pages.records import StoredFile


@dataclass(frozen=True)
class RunsOf:
    """The runs behind one claim, topic or figure input."""

    user: str
    runs: tuple[StoredFile, ...]

    @property
    def id(self) -> str:
        """Return the id of the place where the page lists the runs."""
        return anchor(self.user)

    @property
    def size(self) -> int:
        """Return the total size of the runs [bytes]."""
        return sum(run.size or 0 for run in self.runs)

    @property
    def missing(self) -> int:
        """Return the number of incomplete or missing runs: the simulation gave up, or the file was removed."""
        return sum(run.status != "complete" for run in self.runs)


def anchor(user: str) -> str:
    """Return the id of the manifest line that lists the runs of a user (a claim, topic or figure input)."""
    return "runs-" + re.sub(r"[^A-Za-z0-9]+", "-", user)


def runs_by_user(files: Sequence[StoredFile]) -> tuple[RunsOf, ...]:
    """Return one entry per user, in the order of first use; a run is listed under each of its users."""
    users = dict.fromkeys(user for run in files for user in run.used_by)
    return tuple(RunsOf(user, tuple(run for run in files if user in run.used_by)) for user in users)
