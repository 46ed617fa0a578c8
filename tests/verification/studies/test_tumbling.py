"""The free tumbling body drifts with the order that each integrator declares."""

from __future__ import annotations

import pytest

from iapb.mechanics.integrators import INTEGRATORS
from verification.studies.tumbling import Drift, measured_order, study_tumbling

# The slope between two steps differs from the order by a term of the order of the step itself.
SLOPE = 0.1


@pytest.fixture(scope="module")
def drifts() -> tuple[Drift, ...]:
    return study_tumbling(duration=0.5, rates=(1000.0, 2000.0))


@pytest.mark.parametrize("name", INTEGRATORS)
def test_attitude_converges_with_the_declared_order(drifts: tuple[Drift, ...], name: str) -> None:
    mine = [drift for drift in drifts if drift.integrator == name]
    assert measured_order(mine, "attitude") == pytest.approx(mine[0].declared_order, abs=SLOPE)


@pytest.mark.parametrize("name", INTEGRATORS)
@pytest.mark.parametrize("quantity", ["energy", "momentum"])
def test_energy_and_angular_momentum_drift_falls_at_least_as_declared(
    drifts: tuple[Drift, ...], name: str, quantity: str
) -> None:
    mine = [drift for drift in drifts if drift.integrator == name]
    assert measured_order(mine, quantity) > mine[0].declared_order - SLOPE
