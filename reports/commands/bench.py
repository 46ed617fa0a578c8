"""`iapb bench`: accuracy against computing time, and speed ratios, all measured in one run."""

from __future__ import annotations

import math
import re
from datetime import date
from functools import partial
from typing import Annotated

import typer

from iapb.errors import ArgumentError
from reports.provenance import processor
from reports.show import Answer, Json, sentence, stage_progress
from verification.cost.accuracy import recommended, short_time, which_method, work_precision
from verification.finding import NOT_COMPUTED, NOT_TESTABLE, REFUTED, REPRODUCED, Part
from verification.haptic_rate import haptic_study

# tables that --json alone has
LONG = ("motions", "C19", "C22", "robots", "our time over theirs")


def bench(
    full: Annotated[bool, typer.Option("--full", help="More repeats and steps.")] = False,
    budget: Annotated[
        str,
        typer.Option("--budget", help="Name the method for an impact in this time, such as 50us."),
    ] = "",
    contacts: Annotated[int, typer.Option("--contacts", help="Contacts of that impact.")] = 20,
    coordinates: Annotated[
        int, typer.Option("--coordinates", help="Coordinates of that impact.")
    ] = 6,
    json_: Json = False,
) -> Answer:
    """Time a step, an impact and a motion; compare with MuJoCo, Pinocchio, solvers and the printed
    formula."""
    if budget:
        return _recommended(seconds_of(budget), contacts, coordinates)
    with stage_progress() as progress:
        topic = haptic_study("full" if full else "quick", partial(progress, "tables"))
        methods = work_precision(progress=partial(progress, "methods on problems"))
    facts = {
        "processor": processor(),
        "verdict": topic.verdict,
        "parts": topic.parts,
        "failures": topic.failures,
        "tables": {name: table.records() for name, table in topic.tables.items()}
        | {"methods on problems": methods.records()},
    }
    shown = {name: table for name, table in topic.tables.items() if name not in LONG}
    shown["which method for a size"] = recommended(methods)
    lines = [
        line
        for name, table in shown.items()
        for line in (f"\n{name.capitalize()}", table, sentence(table.note))
    ]
    lines += ["", *map(_target, topic.parts)]
    lines.append(f"Further tables with --json: {', '.join((*LONG, 'methods on problems'))}.")
    lines += [f"Not computed: {one.case}: {one.error}: {one.reason}" for one in topic.failures]
    return Answer(facts, lines, 1 if topic.failures else 0)


def _target(part: Part) -> str:
    """Return a line on a target: met or missed, and the number."""
    words = {
        REPRODUCED: "met",
        REFUTED: "missed",
        NOT_TESTABLE: "no value",
        NOT_COMPUTED: "not measured",
    }
    if part.value is None:
        return f"{words[part.verdict]}: {part.name}"
    wanted = f"{'at least' if part.least else 'at most'} {part.limit:g}"
    return f"{words[part.verdict]}: {part.name}: {part.value:.3g} (target: {wanted})"


UNITS = {"ns": 1e-9, "us": 1e-6, "µs": 1e-6, "ms": 1e-3, "s": 1.0}


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


def _recommended(budget: float, contacts: int, coordinates: int) -> Answer:
    """Return the recommended method in one sentence for each way of calling, and the machine of the
    measurement."""
    found = which_method(budget, contacts, coordinates)
    none = (
        f"In {short_time(budget)} no method solves {contacts} contacts on {coordinates} "
        f"coordinates without a gain "
        "of energy."
    )
    return Answer(
        {"processor": processor(), "choices": found},
        [
            *(map(str, found) if found else (none,)),
            f"Measured on {processor()}, {date.today()}, on nine hard impacts of this size.",
        ],
    )
