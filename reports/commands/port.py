"""`iapb port`: is a force law passive on a haptic device, and what would it need?"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iapb.names import object_named
from reports.figures.port import write_map
from reports.show import Answer, Json, stage_progress
from verification.port import BareDevice, check_force
from verification.port.kit import STAGES

FOLDER = Path("out/port")
FASTEST = 10.0  # [Hz]: hands of people are slower


def port(
    law: Annotated[
        str,
        typer.Argument(
            help="package.module:wall, a function (x, v) -> force on the hand [N], or an object with step and reset."
        ),
    ],
    damping: Annotated[float, typer.Option(help="Damping of the bare device [N s/m].")] = 0.0,
    friction: Annotated[float, typer.Option(help="Coulomb friction of the device [N].")] = 0.0,
    rate: Annotated[float, typer.Option(help="Samples per second [Hz].")] = 1000.0,
    resolution: Annotated[float, typer.Option(help="Resolution of the encoder [m].")] = 0.0,
    delay: Annotated[int, typer.Option(help="Periods by which readings are late.")] = 0,
    start: Annotated[
        str, typer.Option(help="Start of the hand [m]: 0, or 0,0 in the plane.")
    ] = "0",
    json_: Json = False,
) -> Answer:
    """Search the motion of a hand that draws energy from a force law; draw the map of devices."""
    tested = object_named("LAW", law, "package.module:wall")
    device = BareDevice(rate, damping, friction, resolution, delay=delay)
    at = [float(word) for word in start.split(",")]
    with stage_progress() as progress:
        report = check_force(
            tested,
            device,
            start=at if len(at) > 1 else at[0],
            fastest=FASTEST,
            edge=True,
            progress=lambda done, total: progress(STAGES[done - 1], done, total),
        )
    map_file = write_map(FOLDER / f"{law.rpartition(':')[2]}.svg", report)
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
    return Answer(
        facts, [str(report), f"The map of devices: {map_file}"], 0 if report.passed else 1
    )
