"""What is damaged, and who reads it: `KINDS` by name."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from reports.fuzz.mutate import Rng, damaged_bytes, damaged_text, damaged_values

_STEPS = 3  # of a scene that is read all the same: it must also start


@dataclass(frozen=True)
class Kind:
    """One kind of input.

    samples : valid inputs, as bytes, by file name
    damaged : (sample, another sample, rng) -> wrong input
    read : reads a file; ends without a word, or raises an IapbError
    """

    name: str
    samples: Callable[[], dict[str, bytes]]
    damaged: Callable[[bytes, bytes, Rng], bytes]
    read: Callable[[Path], None]


def prepare(folder: Path) -> None:
    """Put beside the cases what they may refer to: the robots of the scenes."""
    import shutil

    from iapb.scene import scene_folder

    shutil.copytree(scene_folder() / "robots", folder / "robots", dirs_exist_ok=True)


def _text_or_bytes(sample: bytes, other: bytes, rng: Rng) -> bytes:
    return damaged_text(sample.decode(), rng, other.decode())


def _scene_or_text(sample: bytes, other: bytes, rng: Rng) -> bytes:
    """Half of the cases are damaged as values: they are always YAML, and get past the first look."""
    if rng.random() < 0.5:
        return _text_or_bytes(sample, other, rng)
    return json.dumps(damaged_values(_plain(sample), rng)).encode()


@cache
def _plain(sample: bytes) -> Any:
    from iapb.scene.document import read_document

    return read_document(sample.decode())[0].value


def _only_bytes(sample: bytes, other: bytes, rng: Rng) -> bytes:
    return damaged_bytes(sample, rng)


@cache
def _scene_texts() -> dict[str, bytes]:
    from iapb.scene import scene_folder

    return {path.name: path.read_bytes() for path in sorted(scene_folder().glob("*.yaml"))}


def _planar() -> dict[str, bytes]:
    return {name: text for name, text in _scene_texts().items() if b"\ndimensions: 3" not in text}


def _spatial() -> dict[str, bytes]:
    return {name: text for name, text in _scene_texts().items() if b"\ndimensions: 3" in text}


def _read_scene(path: Path) -> None:
    """What every command does with a scene: read it, decide its effects, start it."""
    from iapb import decide_effects, load_scene, simulate

    scene = load_scene(path)
    decide_effects(scene)
    simulate(scene, steps=min(_STEPS, scene.steps))


def _studies() -> dict[str, bytes]:
    from iapb.scene import scene_folder

    return {path.name: path.read_bytes() for path in sorted((scene_folder() / "sweeps").glob("*.yaml"))}


def _read_study(path: Path) -> None:
    """Read it, find its scene, and spell out its first points."""
    from itertools import islice

    from reports.sweeps.files import scene_of
    from reports.sweeps.points import points_of
    from reports.sweeps.study import load_study

    study = load_study(path)
    list(islice(points_of(study, str(scene_of(study, path))), _STEPS))


def _robots() -> dict[str, bytes]:
    from iapb.scene import scene_folder

    return {path.name: path.read_bytes() for path in sorted((scene_folder() / "robots").glob("*.urdf"))}


def _read_robot(path: Path) -> None:
    from iapb.mechanics.urdf import read_urdf
    from iapb.mechanics.urdf_collision import read_collisions

    read_urdf(path)
    read_collisions(path)


def _read_problem(path: Path) -> None:
    from reference.datasets import read_problem

    read_problem(path)


def _read_results(path: Path) -> None:
    """A run file, or a table: as `iapb inspect` and the report read it."""
    import contextlib
    import io

    from iapb.errors import RunFileError
    from reports.commands.inspect import inspect
    from reports.store.tables import read_table

    try:
        with contextlib.redirect_stdout(io.StringIO()):
            inspect(path, 3)
    except RunFileError:
        read_table(path, "sample")


def _kinds() -> tuple[Kind, ...]:
    from reports.fuzz import samples
    from reports.fuzz.command_line import damaged_line, lines, run_line

    return (
        Kind("scenes in the plane", _planar, _scene_or_text, _read_scene),
        Kind("scenes in space", _spatial, _scene_or_text, _read_scene),
        Kind("URDF robots", _robots, _text_or_bytes, _read_robot),
        Kind("sweep studies", _studies, _scene_or_text, _read_study),
        Kind("LCP and MLCP files", samples.problem_texts, _only_text_or_bytes, _read_problem),
        Kind("FCLIB files", samples.fclib_files, samples.damaged_hdf5, _read_problem),
        Kind("run files and tables", samples.result_files, _only_bytes, _read_results),
        Kind("sealed run files", samples.result_files, samples.damaged_hdf5_sealed, _read_results),
        Kind("command lines", lines, damaged_line, run_line),
    )


def _only_text_or_bytes(sample: bytes, other: bytes, rng: Rng) -> bytes:
    """Texts as texts; what is compressed, as bytes."""
    if sample[:2] == b"\x1f\x8b":
        return damaged_bytes(sample, rng)
    return damaged_text(sample.decode(), rng, "" if other[:2] == b"\x1f\x8b" else other.decode())


@cache
def kinds() -> dict[str, Kind]:
    """Every kind of input by name."""
    return {kind.name: kind for kind in _kinds()}
