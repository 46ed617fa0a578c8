"""`iapb bench`: the method for one impact within a time, measured now."""

from __future__ import annotations

import math
import re
from datetime import date
from typing import Annotated

import typer

from iapb.errors import ArgumentError
from reports.provenance import processor
from reports.show import Answer, Json
from verification.cost.accuracy import short_time, which_method

UNITS = {"ns": 1e-9, "us": 1e-6, "µs": 1e-6, "ms": 1e-3, "s": 1.0}


def bench(
    budget: Annotated[
        str, typer.Option("--budget", help="Time for an impact, such as 50us or 0.5ms.")
    ],
    contacts: Annotated[int, typer.Option("--contacts", help="Contacts of that impact.")] = 20,
    coordinates: Annotated[
        int, typer.Option("--coordinates", help="Coordinates of that impact.")
    ] = 6,
    json_: Json = False,
) -> Answer:
    """Name the method that solves most of nine hard impacts of a size within a time, measured
    now."""
    seconds = seconds_of(budget)
    found = which_method(seconds, contacts, coordinates)
    none = (
        f"In {short_time(seconds)} no method solves {contacts} contacts on {coordinates} "
        "coordinates without a gain of energy."
    )
    lines = [str(each) for each in found] or [none]
    measured = f"Measured on {processor()}, {date.today()}, on nine hard impacts of this size."
    return Answer({"processor": processor(), "choices": found}, [*lines, measured])


def seconds_of(text: str) -> float:
    """Return a time given with its unit, such as 50us or 0.5ms, in seconds."""
    found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*(ns|us|µs|ms|s)\s*", text)
    try:
        seconds = float(found[1]) * UNITS[found[2]]  # type: ignore[index]
    except (TypeError, ValueError):
        seconds = math.inf
    if not math.isfinite(seconds):
        raise ArgumentError("budget", text, "a time with its unit, e.g. 50us")
    return seconds
