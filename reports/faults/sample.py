"""A run to lose: a few hundred steps of the peg, told apart by a number in its inputs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from iapb.run import Run
from reports.store import RunStore, read_run
from reports.store.keys import content_hash


@cache
def sample_run() -> Run:
    """The run itself, simulated once per process."""
    from iapb import find_scene, load_scene
    from reference.worlds import run_world

    return run_world(load_scene(find_scene("peg_corner")).with_values({"duration": 0.4}), "IAPB")


def numbered(number: int) -> Run:
    """A run that differs from the others in its results."""
    run = sample_run()
    return replace(run, q=run.q + float(number))


def inputs_of(number: int) -> dict[str, Any]:
    """What the store files it under."""
    return {"number": number}


def open_store(folder: Path) -> RunStore:
    """A store whose keys do not depend on the code: hashing that takes longer than what is tried here."""
    return RunStore(folder, code="faults")


def whole(store: RunStore, number: int) -> bool:
    """Whether the run of that number is there and is what was stored."""
    path = store.path_of(inputs_of(number))
    return path.is_file() and content_hash(read_run(path)) == content_hash(numbered(number))


def in_child(work: Callable[..., None], *arguments: Any) -> Any:
    """Start `work` in a process that shares what was simulated so far; return the process."""
    process = get_context("fork").Process(target=work, args=arguments)
    process.start()
    return process
