"""`iapb verify --resolver package.module:function`: the passivity kit on anybody's impact resolver."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import typer


def verify(
    resolver: Annotated[str, typer.Option(
        help="package.module:function, called as (mass_matrix, contact_jacobian, velocity, restitution).")]
    = "iapb:resolve_impact",
    impacts: Annotated[int, typer.Option(min=1, help="Random impacts to try.")] = 1500,
    seed: Annotated[int, typer.Option(help="Seed of the draw.")] = 0,
    simulator: Annotated[list[str] | None, typer.Option(
        help="Instead, an engine on the fixed scenes: mujoco, drake, ... or all; may be repeated.")] = None,
    scene: Annotated[list[str] | None, typer.Option(help="Only this fixed scene; may be repeated.")] = None,
) -> None:
    """Test an impact resolver against every law; print the verdict, the worst case and a shrunk counterexample."""
    if simulator:
        from reports.commands.verify_simulator import verify_simulators

        verify_simulators(simulator, scene or ())
        return
    from verification import check_passivity

    report = check_passivity(found(resolver), impacts=impacts, seed=seed)
    print(report)
    if not report.passed:
        raise typer.Exit(1)


def found(name: str) -> Callable[..., Any]:
    """Import ``package.module:function``; the working directory counts as a place to look."""
    import importlib
    import os
    import sys

    from iapb.errors import ArgumentError

    module, colon, attribute = name.partition(":")
    if not (module and colon and attribute):
        raise ArgumentError("--resolver", name, "package.module:function")
    if os.getcwd() not in sys.path:
        sys.path.insert(0, os.getcwd())
    try:
        function = getattr(importlib.import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise ArgumentError("--resolver", name, f"a function that can be imported ({error})") from error
    if not callable(function):
        raise ArgumentError("--resolver", name, "something that can be called")
    return function
