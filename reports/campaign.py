"""The laws at length, with their batches on the disk: what was done is not done again, and what broke a law is kept.

    out/verify/<key>/impacts-000000000.h5 …      a table per batch: law, cases, failures, worst residual
    out/verify/<key>/counterexamples/…           runs, for `iapb inspect`: impacts (as FCLIB too) and trajectories

The key is a hash of the code, the resolver and the tolerances, so that a changed line starts afresh. A batch is written
aside and renamed: a killed process leaves whole batches only.
"""

from __future__ import annotations

import hashlib
from collections import Counter
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from contextlib import closing
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from reports.batches import worker_pool
from reports.store.keys import canonical_json, code_version
from reports.store.tables import Column, Table, read_table, write_table

if TYPE_CHECKING:
    from verification.laws.campaign import Batch, BatchOutcome, Subject
    from verification.laws.kit import LawCount

ENGINE = "iapb:resolve_impact"
_TABLE = "laws"
_COMMAND = "iapb verify --full"
# Files of one law: each is a run of about 150 kB. A resolver that breaks a law more often is not understood by more.
KEPT_PER_LAW = 1000


@dataclass(frozen=True)
class CampaignRequest:
    """What is verified: a resolver by its name, the tolerances by theirs, and how much.

    workers : processes at work; 1 = this one.
    """

    resolver: str
    bounds: str
    largest_condition: float
    impacts: int
    trajectories: int
    seed: int
    workers: int

    def subject(self) -> Subject:
        """What the laws are put to; imports the resolver."""
        from reports.by_name import function_named
        from verification.laws import bounds
        from verification.laws.campaign import Subject

        tested = function_named("--resolver", self.resolver)
        return Subject(tested, getattr(bounds, self.bounds), self.largest_condition, self.seed)

    def key(self) -> str:
        """Hash of all that a batch depends on; not how many there are."""
        asked = {"resolver": self.resolver, "bounds": self.bounds, "condition": self.largest_condition,
                 "seed": self.seed, "code": code_version(), "laws": _laws_version()}  # fmt: skip
        return hashlib.sha256(canonical_json(asked).encode()).hexdigest()[:16]


def _laws_version() -> str:
    folder, digest = Path(__file__).resolve().parents[1] / "verification" / "properties", hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(path.relative_to(folder).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()


class Campaign:
    """Batches of one request in a folder of their own."""

    def __init__(self, out: Path, request: CampaignRequest) -> None:
        self.request, self.folder = request, out / request.key()
        self.folder.mkdir(parents=True, exist_ok=True)

    def path_of(self, batch: Batch) -> Path:
        """The file of a batch; its size is in the name, for the last one of a part may be short."""
        return self.folder / f"{batch.part.replace(' ', '_')}-{batch.first:09d}-{batch.count}.h5"

    def run(self, batches: Iterable[Batch], progress: Callable[[str, int, int], None]) -> None:
        """Do the batches that are not there yet, part by part."""
        parts: dict[str, list[Batch]] = {}
        for batch in batches:
            parts.setdefault(batch.part, []).append(batch)
        for part, own in parts.items():
            total = sum(batch.count for batch in own)
            missing = [batch for batch in own if not self.path_of(batch).is_file()]
            done = total - sum(batch.count for batch in missing)
            progress(part, done, total)
            with closing(self._outcomes(missing)) as outcomes:
                for batch, outcome in outcomes:
                    self._keep(batch, outcome)
                    done += batch.count
                    progress(part, done, total)

    def _outcomes(self, batches: list[Batch]) -> Generator[tuple[Batch, BatchOutcome]]:
        """Outcomes as they come; a few batches per worker wait, no more."""
        if self.request.workers == 1 or len(batches) < 2:
            yield from ((batch, outcome_of(self.request, batch)) for batch in batches)
            return
        left = iter(batches)
        with worker_pool(self.request.workers) as pool:

            def begin(count: int) -> dict[Future[BatchOutcome], Batch]:
                return {pool.submit(outcome_of, self.request, batch): batch for batch in islice(left, count)}

            running = begin(2 * self.request.workers)
            while running:
                finished, _ = wait(running, return_when=FIRST_COMPLETED)
                for future in finished:
                    yield running.pop(future), future.result()
                running |= begin(len(finished))

    def _keep(self, batch: Batch, outcome: BatchOutcome) -> None:
        """Counterexamples first: a batch that is there has all of its own, up to KEPT_PER_LAW in the whole folder."""
        from reports.campaign_counterexamples import keep_counterexample

        kept = Counter(path.stem.rsplit("-", 1)[-1] for path in self.counterexamples())
        for found in outcome.found:
            kept[found.law] += 1
            if kept[found.law] <= KEPT_PER_LAW:
                keep_counterexample(self.folder / "counterexamples", found, self.request)
        write_table(self.path_of(batch), _table(batch, outcome))

    def counts(self, batches: Iterable[Batch]) -> dict[str, dict[str, LawCount]]:
        """Sums over the batches that are there, by part and law."""
        from verification.laws.kit import added

        sums: dict[str, dict[str, LawCount]] = {}
        for batch in batches:
            if self.path_of(batch).is_file():
                own = sums.setdefault(batch.part, {})
                for count in _read(self.path_of(batch)):
                    own[count.law] = added(own[count.law], count) if count.law in own else count
        return sums

    def seconds(self, batches: Iterable[Batch]) -> float:
        """Time that all batches took, one after the other [s]."""
        paths = [self.path_of(batch) for batch in batches]
        return sum(float(read_table(path)["seconds"][0]) for path in paths if path.is_file())

    def counterexamples(self) -> list[Path]:
        """Files of what broke a law."""
        return sorted((self.folder / "counterexamples").glob("*.h5"))


def outcome_of(request: CampaignRequest, batch: Batch) -> BatchOutcome:
    """Do one batch; in a process of its own it finds its resolver by name."""
    from verification.laws.campaign import do_batch

    return do_batch(batch, request.subject())


def _table(batch: Batch, outcome: BatchOutcome) -> Table:
    counts = outcome.counts
    worst: list[Any] = [count.worst for count in counts]
    columns = (
        Column("law", tuple(count.law for count in counts), "1", "law"),
        Column("checked", np.array([count.checked for count in counts]), "1", "cases that it applied to"),
        Column("failures", np.array([count.failures for count in counts]), "1", "cases that broke it"),
        Column("worst", np.array([one.value for one in worst]), "1", "residual nearest to its tolerance"),
        Column("tolerance", np.array([one.tolerance for one in worst]), "1", "its tolerance"),
        Column("seconds", np.full(len(counts), outcome.seconds), "s", "time of the whole batch"),
    )
    return Table(_TABLE, columns, f"{batch.part}, cases {batch.first} and {batch.count - 1} more", command=_COMMAND)


def _read(path: Path) -> Iterator[LawCount]:
    from verification.laws.bounds import LawResidual
    from verification.laws.kit import LawCount

    table = read_table(path, _TABLE)
    rows = zip(*(table[name] for name in ("law", "checked", "failures", "worst", "tolerance")), strict=True)
    for law, checked, failures, value, tolerance in rows:
        yield LawCount(str(law), int(checked), int(failures), LawResidual(str(law), float(value), float(tolerance)))
