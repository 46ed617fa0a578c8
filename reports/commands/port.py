"""`iapb port`: is a force law passive on a haptic device, and what would it need?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iapb.errors import ArgumentError
from iapb.names import object_named
from reports.show import Answer, Json, stage_progress

FOLDER = Path("out/port")
FASTEST = 10.0  # [Hz]: hands of people are slower


def port(
    law: Annotated[
        str,
        typer.Argument(
            help="package.module:wall, a function (x, v) -> force on the hand (N), or an object with step and reset."
        ),
    ],
    damping: Annotated[float, typer.Option(help="Damping of the bare device (N s/m).")] = 0.0,
    friction: Annotated[float, typer.Option(help="Coulomb friction of the device (N).")] = 0.0,
    rate: Annotated[float, typer.Option(help="Samples per second (Hz).")] = 1000.0,
    resolution: Annotated[float, typer.Option(help="Resolution of the encoder (m).")] = 0.0,
    delay: Annotated[int, typer.Option(help="Periods by which readings are late.")] = 0,
    reach: Annotated[
        float, typer.Option(help="How far the hand moves from the start along each axis (m).")
    ] = 0.01,
    start: Annotated[
        str, typer.Option(help="Where the hand starts (m): 0, or 0,0 in the plane.")
    ] = "0",
    stored: Annotated[
        float, typer.Option(help="Energy that the law may give from there (J).")
    ] = 0.0,
    fastest: Annotated[float, typer.Option(help="Frequency of slow hands (Hz).")] = FASTEST,
    limit: Annotated[float | None, typer.Option(help="Largest force that is allowed (N).")] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Seed of the search.")] = 0,
    patience: Annotated[float, typer.Option(help="Time for the search (s).")] = 600.0,
    json_: Json = False,
) -> Answer:
    """Search the motion of a hand that draws energy from a force law; draw the map of devices.

    Example: iapb port my_wall:wall --damping 0.5
    """
    from reports.figures.port import law_svg
    from reports.store.io import write_whole
    from verification.port.device import BareDevice
    from verification.port.kit import STAGES, check_force

    tested = object_named("LAW", law, "package.module:wall")
    device = BareDevice(rate, damping, friction, resolution, reach, delay)
    with stage_progress() as progress:
        report = check_force(
            tested,
            device,
            start=_coordinates(start),
            stored=stored,
            fastest=fastest,
            limit=limit,
            seed=seed,
            patience=patience,
            edge=True,
            progress=lambda done, total: progress(STAGES[done - 1], done, total),
        )
    map_file = None
    lines = [str(report)]
    if len(report.edge):  # a law without forces, and a search out of time, have none
        map_file = FOLDER / f"{law.rpartition(':')[2]}.svg"
        write_whole(map_file, law_svg(report))
        lines.append(f"The map of devices: {map_file}")
    facts = {
        "law": report.law,
        "passed": report.passed,
        "broken_laws": report.broken_laws,
        "damping_needed": report.damping_needed,
        "friction_needed": report.friction_needed,
        "slow_damping": report.slow_damping,
        "map": map_file,
        "report": str(report),
    }
    return Answer(facts, lines, 0 if report.passed else 1)


def _coordinates(start: str) -> float | list[float]:
    """Return a number, or the numbers between commas."""
    try:
        at = [float(word) for word in start.split(",")]
    except ValueError:
        expected = "a number, or two or three with commas between [m]"
        raise ArgumentError("--start", start, expected) from None
    return at if len(at) > 1 else at[0]
