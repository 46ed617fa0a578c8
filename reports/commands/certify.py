"""`iapb certify RUN…`: check every recorded impact exactly, for energy gain and for consistent
impulse and velocity."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Annotated, TextIO

import numpy as np
import typer

from iapb import Certificate, certify_impacts
from iapb import certify as certify_run
from iapb.errors import ArgumentError, IapbError, RunFileError, counted
from reference.hdf5 import READ_BUDGET
from reports.show import Answer, Json, one_line, said
from reports.store.check import is_run
from reports.store.io import written_aside
from reports.store.runs import opened_run
from verification.certificate import EXPORT_HEAD, exported, exported_run

_GIVEN = ("mass_matrix", "v_minus", "v_plus")


def certify(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="RUN...",
            help="Run files (.h5), folders of them, or impacts of another engine (.npz).",
        ),
    ],
    export: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE",
            help="Write every impact as a line of integers, for the checker proved in Coq.",
        ),
    ] = None,
    json_: Json = False,
) -> Answer:
    """Judge every recorded impact exactly: energy gain, and whether impulses and velocities are
    consistent."""
    paths = list(
        dict.fromkeys(
            path
            for given in files
            for path in (sorted(filter(is_run, given.rglob("*.h5"))) if given.is_dir() else [given])
        )
    )
    if not paths:
        raise ArgumentError(
            "RUN", ", ".join(map(str, files)), "run files, or folders that hold some"
        )
    found = dict[Path, Certificate]()
    unread = dict[Path, str]()
    if export:
        found = _exported(paths, export)
    for path in [] if export else paths:
        try:
            found[path] = _certificate(path)
        except (IapbError, OSError) as error:
            if len(paths) == 1:
                raise
            unread[path] = f"not certified: {said(error, path)}"
    failed = [path for path, one in found.items() if not one.passed]
    judged = {
        path: asdict(one) | {"passed": one.passed, "words": one.words()}
        for path, one in found.items()
    }
    lines = [*(f"{one_line(path)}: {why}" for path, why in unread.items()), *_lines(found, failed)]
    return Answer(
        {"passed": not failed and not unread, "files": judged, "unread": unread},
        lines,
        int(bool(failed or unread)),
    )


def _exported(paths: list[Path], export: Path) -> dict[Path, Certificate]:
    """Certify the files and write their impacts to `export`; if a file cannot be read, `export` is
    not changed."""
    if export.exists() and (
        not export.is_file() or any(path.exists() and path.samefile(export) for path in paths)
    ):
        raise ArgumentError("--export", str(export), "a new file, not one of the certified files")
    with (
        written_aside(export.resolve(), replace=True) as aside,
        aside.open("w", encoding="utf-8") as target,
    ):
        target.write(f"{EXPORT_HEAD}\n")
        found = {path: _certificate(path, target) for path in paths}
        target.write(f"end {sum(one.impacts for one in found.values())}\n")
    return found


def _lines(found: dict[Path, Certificate], failed: list[Path]) -> Iterator[str]:
    """Yield the certificate of each file: its residuals, how it was decided, and the first energy
    gain."""
    for path, one in found.items():
        yield f"{one_line(path)}: {one.words()}"
        residuals = {
            "M(v⁺ − v⁻) − impulse": one.momentum,
            "impulse − Jᵀp": one.span,
            "sum of impulses": one.total,
            "restitution": one.restitution,
        }
        sizes = [f"{name} {x:.1e}" for name, x in residuals.items() if not np.isnan(x)]
        if sizes:
            yield f"  largest relative residuals: {', '.join(sizes)}"
        if one.impacts:
            decided = one.impacts - one.by_integers
            yield (
                f"  decided by a double-double error bound: {decided} (of these {one.checked} "
                f"confirmed in exact "
                f"integer arithmetic); decided in exact integer arithmetic: {one.by_integers}"
            )
    impacts = sum(one.impacts for one in found.values())
    gains = sum(one.gains for one in found.values())
    yield f"{counted(impacts, 'impact')} of {counted(len(found), 'file')}: {gains} gained energy (exact)."
    for path in failed[:1]:
        if found[path].counterexample:
            yield f"\nImpact {found[path].first_gain} of {path}:\n{found[path].counterexample}"


def _certificate(path: Path, export: TextIO | None = None) -> Certificate:
    """Return the certificate of a run file or of an impact archive of any engine; write its impacts
    to `export`."""
    if path.suffix == ".npz":
        arrays = _archived(path)
        certificate = certify_impacts(**arrays)
        if export:
            export.writelines(f"{line}\n" for line in exported(*(arrays[name] for name in _GIVEN)))
        return certificate
    with opened_run(path) as (run, _):
        certificate = certify_run(run)
        if export:
            export.writelines(f"{line}\n" for line in exported_run(run))
    return certificate


def _archived(path: Path) -> dict[str, np.ndarray]:
    try:
        if path.exists() and not path.is_file():
            raise ValueError("no regular file")  # a pipe would be waited for
        with zipfile.ZipFile(path) as members, np.load(path, allow_pickle=False) as archive:
            if (size := sum(member.file_size for member in members.infolist())) > READ_BUDGET:
                raise ValueError(f"it unpacks to {size} bytes: expected at most {READ_BUDGET}")
            arrays = {name: archive[name] for name in (*_GIVEN, "impulse") if name in archive.files}
    except Exception as error:  # a damaged or foreign archive can raise any exception
        raise RunFileError(f"{path}: no archive of arrays: {error}") from None
    missing = [name for name in _GIVEN if name not in arrays]
    if missing:
        raise RunFileError(
            f"{path}: {', '.join(missing)} missing; docs/certificate.md states the format"
        )
    return arrays
