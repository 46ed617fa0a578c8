"""The full verification campaign, stored batch by batch: batches are computed once, counterexamples are kept.

    out/verify/<key>/impacts-000000000.h5 …      a table per batch: law, cases, failures, worst residual
    out/verify/<key>/counterexamples/…           records of impacts and runs, for `iapb inspect`

The key is a hash of the code, the resolver and the tolerances, so that a change of the code starts a new campaign. A
batch is written to a temporary file and renamed: a killed process leaves complete batches only.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Any

from reports.batches import here, processes
from reports.counterexamples import CampaignRequest, keep_counterexample
from reports.store.tables import read_record, write_record
from verification.laws.bounds import LawCount, LawResidual
from verification.laws.campaign import Batch, BatchOutcome, do_batch

# Largest number of files per law; each is a run of about 150 kB. More counterexamples would not give more insight.
KEPT_PER_LAW = 1000


class Campaign:
    """The batches of one request, in their own folder."""

    def __init__(self, out: Path, request: CampaignRequest) -> None:
        self.request, self.folder = request, out / request.key()

    def path_of(self, batch: Batch) -> Path:
        """Return the file of a batch. The name contains the batch size, as the last batch of a part may be shorter."""
        return self.folder / f"{batch.part.replace(' ', '_')}-{batch.first:09d}-{batch.count}.h5"

    def run(self, batches: Iterable[Batch], progress: Callable[[str, int, int], None]) -> None:
        """Compute the batches that have no file yet, part by part."""
        every = list(batches)
        scheduler = here if self.request.workers == 1 else processes(self.request.workers)
        for part in dict.fromkeys(batch.part for batch in every):
            own = [batch for batch in every if batch.part == part]
            missing = [batch for batch in own if not self.path_of(batch).is_file()]
            total = sum(batch.count for batch in own)
            done = total - sum(batch.count for batch in missing)
            progress(part, done, total)
            with closing(scheduler(partial(outcome_of, self.request), missing)) as results:
                for batch, outcome in results:
                    self._keep(batch, outcome)
                    done += batch.count
                    progress(part, done, total)

    def _keep(self, batch: Batch, outcome: BatchOutcome) -> None:
        """Write the counterexamples, at most KEPT_PER_LAW per law in the folder, then the table of the batch.

        Because of this order, every batch file has its counterexamples beside it.
        """
        kept = Counter(path.stem.rsplit("-", 1)[-1] for path in self.counterexamples())
        for found in outcome.found:
            kept[found.law] += 1
            if kept[found.law] <= KEPT_PER_LAW:
                keep_counterexample(self.folder / "counterexamples", found, self.request)
        title = f"{batch.part}, cases {batch.first} and {batch.count - 1} more"
        write_record(self.path_of(batch), {"laws": outcome.counts, "seconds": outcome.seconds}, title,
                     command="iapb verify --full")  # fmt: skip

    def _stored(self, batches: Iterable[Batch]) -> Iterator[tuple[Batch, Any]]:
        return ((batch, read_record(path)) for batch in batches if (path := self.path_of(batch)).is_file())

    def counts(self, batches: Iterable[Batch]) -> dict[str, dict[str, LawCount]]:
        """Return the counts summed over the stored batches, by part and law."""
        sums: dict[str, dict[str, LawCount]] = {}
        for batch, stored in self._stored(batches):
            own = sums.setdefault(batch.part, {})
            for told in stored["laws"]:
                count = LawCount(**told | {"worst": told["worst"] and LawResidual(**told["worst"])})
                own[count.law] = own[count.law] + count if count.law in own else count
        return sums

    def seconds(self, batches: Iterable[Batch]) -> float:
        """Return the sum of the computing times of all batches [s]."""
        return sum(stored["seconds"] for _, stored in self._stored(batches))

    def counterexamples(self) -> list[Path]:
        """Return the files of all counterexamples."""
        return sorted((self.folder / "counterexamples").glob("*.h5"))


def outcome_of(request: CampaignRequest, batch: Batch) -> BatchOutcome:
    """Compute one batch. The resolver is imported by its name, so this also works in a worker process."""
    return do_batch(batch, request.subject())
