"""Rendering of impulses: limits are met exactly, one factor is passive, clipping is not."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iapb.errors import ArgumentError
from iapb.haptics.rendering import effective_restitution, render_impulse

DT, LIMIT = 1.0 / 512.0, np.array([15.0, 15.0, 1.0])  # the paper's rate and F_limit

impulse = st.lists(st.floats(-10.0, 10.0), min_size=3, max_size=3)


@given(impulse)
def test_full_is_equation_26_whatever_the_limit(impulse):
    rendered = render_impulse(impulse, DT, LIMIT, "full")
    assert np.array_equal(rendered.device_force, np.array(impulse) / DT)
    assert np.array_equal(rendered.tool_impulse, impulse) and rendered.share == 1.0


@given(impulse, st.floats(1e-4, 1e-2), st.sampled_from(["saturate", "scale", "spread"]))
def test_the_device_never_exceeds_its_limit_not_even_by_rounding(impulse, dt, rendering):
    rendered = render_impulse(impulse, dt, LIMIT, rendering)
    assert np.all(np.abs(rendered.device_force) <= LIMIT)
    if np.all(np.abs(impulse) / dt <= LIMIT):  # within reach nothing is changed
        assert np.array_equal(rendered.tool_impulse, impulse) and not rendered.unfinished


@given(impulse, st.sampled_from(["scale", "spread"]))
def test_scaling_is_one_factor_and_the_largest_one(impulse, rendering):
    rendered = render_impulse(impulse, DT, LIMIT, rendering)
    assert 0.0 <= rendered.share <= 1.0
    assert np.array_equal(rendered.tool_impulse, rendered.share * np.array(impulse))
    assert np.array_equal(rendered.device_force, rendered.tool_impulse / DT)
    if rendered.share < 1.0:
        more = rendered.share * (1.0 + 1e-12) * np.abs(impulse) / DT
        assert np.any(more > LIMIT)
    assert rendered.unfinished == (rendering == "spread" and rendered.share < 1.0)


@given(impulse)
def test_saturation_gives_the_tool_everything_and_the_device_what_it_can(impulse):
    rendered = render_impulse(impulse, DT, LIMIT, "saturate")
    assert np.array_equal(rendered.tool_impulse, impulse)
    assert np.array_equal(rendered.device_force, np.clip(np.array(impulse) / DT, -LIMIT, LIMIT))


def test_a_coordinate_without_limit_does_not_bind():
    rendered = render_impulse([1e3, 0.01], DT, [np.inf, 15.0], "scale")
    assert rendered.share == 1.0


@given(st.floats(-1.0, 1.0), st.floats(0.0, 1.0), st.floats(-3.0, -1e-3))
def test_a_scaled_impulse_is_an_impact_of_smaller_restitution(restitution, share, velocity):
    smaller = effective_restitution(restitution, share)
    assert -1.0 <= smaller <= restitution + 1e-15
    scaled = velocity - share * (1.0 + restitution) * velocity
    assert scaled == pytest.approx(-smaller * velocity, abs=1e-14)


def oblique_impact():
    """Unit mass, frictionless elastic impact on a wall with normal (0.8, 0.6): v and the impulse."""
    velocity, normal = np.array([-1.0, 0.5]), np.array([0.8, 0.6])
    return velocity, -2.0 * (normal @ velocity) * normal


@given(st.floats(1e-3, 1e3))
def test_scaling_never_adds_kinetic_energy(limit):
    velocity, impulse = oblique_impact()
    rendered = render_impulse(impulse, 1.0, [limit, limit], "scale")
    after = velocity + rendered.device_force
    assert after @ after <= velocity @ velocity * (1.0 + 1e-15)


def test_clipping_component_by_component_can_add_energy_at_the_device():
    """Erratum 5: the wrong twin of the test above."""
    velocity, impulse = oblique_impact()
    after = velocity + render_impulse(impulse, 1.0, [0.1, 1.0], "saturate").device_force
    assert after @ after > 1.5 * (velocity @ velocity)


def spread_out(mass, velocity, restitution, limit, dt):
    """Velocity after spreading an impact on one wall over as many steps as it takes, and their number."""
    for step in range(1, 1000):
        rendered = render_impulse([-(1.0 + restitution) * mass * velocity], dt, [limit], "spread")
        velocity += rendered.tool_impulse[0] / mass
        if velocity >= 0.0 or not rendered.unfinished:
            return velocity, step
    raise AssertionError("spreading does not end")


def test_spreading_delivers_the_prescribed_velocity_for_plastic_impacts_only():
    """Erratum 5, with its numbers: 0.0025 m/s instead of 0.05 m/s."""
    velocity, steps = spread_out(2.0, -0.1, 0.0, 15.0, DT)
    assert velocity == pytest.approx(0.0, abs=1e-15) and steps == 7
    velocity, _ = spread_out(2.0, -0.1, 0.5, 15.0, DT)
    assert velocity == pytest.approx(0.0025, abs=5e-5) and abs(velocity - 0.05) > 0.04


@pytest.mark.parametrize(
    ("argument", "call"),
    [
        ("impulse", ([np.nan], DT, [1.0], "scale")),
        ("dt", ([1.0], 0.0, [1.0], "scale")),
        ("force_limit", ([1.0], DT, [0.0], "scale")),
        ("force_limit", ([1.0], DT, [1.0, 1.0], "scale")),
        ("rendering", ([1.0], DT, [1.0], "stretch")),
    ],
)
def test_wrong_arguments_are_named(argument, call):
    with pytest.raises(ArgumentError) as caught:
        render_impulse(*call)
    assert caught.value.argument == argument
