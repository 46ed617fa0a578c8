"""Topic: what the paper's couplings, and walls from the literature, need of a device."""

from __future__ import annotations

from verification.check import Topic
from verification.stability.port import EDGES, PORT, port_numbers

TOPIC = Topic(
    key="stability",
    title="The hand's port",
    question="A virtual wall in a sampled loop can feed energy to the hand. A search moves the hand, and "
    "measures the energy that it draws from the loop. Colgate's condition, b >= KT/2 + |B| with the "
    "period T, makes a wall of spring and damper passive for every hand, if the sensors are ideal.",
    checks=(PORT, EDGES),
    numbers=port_numbers,
)
