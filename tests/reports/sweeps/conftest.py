"""A small study, and the scene that it sweeps."""

from __future__ import annotations

import pytest

from reports.sweeps.study import Study, study_from_text

SMALL = """\
name: small
scene: two_discs
values: {duration: 0.06, bodies.striker.position.0: -0.06}
grid:
  contact.restitution: [0, 1]
random: {count: 3, seed: 3, values: {bodies.striker.velocity.1: {from: -0.1, to: 0.1}}}
"""


@pytest.fixture
def study() -> Study:
    return study_from_text(SMALL)


@pytest.fixture
def text() -> str:
    return SMALL
