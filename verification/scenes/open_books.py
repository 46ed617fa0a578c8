"""What the energy books of a scene leave open, at its own step and at shorter ones: does it fall with the order?

A force held over a step does not do the work of the force that changes within it. That error is the integrator's, and
falls with its declared order; anything in the books that does not fall is a fault. The two parts are judged by their
sizes, so that one cannot hide the other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from iapb.mechanics.integrators import INTEGRATORS
from iapb.run import Run
from iapb.scene import Scene
from verification.scenes.scene_measures import EnergyBook, energy_book, share

REFINEMENTS = (1, 2, 4)  # steps of the scene's length, of half and of a quarter of it
ROUNDING = 1e-12  # share of all energy in the books: some thousand sums in double precision stay below
ORDER_SLACK = 0.25  # by which a measured order may fall short: collisions come at other instants at another step


@dataclass(frozen=True)
class OpenBooks:
    """`open_shares` [-] at each refinement that was tried, of the energy turned over; `order` None: at rounding."""

    scene: str
    refinements: tuple[int, ...]
    open_shares: tuple[float, ...]
    declared_order: int
    order: float | None

    @property
    def falls_as_declared(self) -> bool:
        """Whether what is open is rounding, or falls at least with the declared order."""
        return self.order is None or self.order >= self.declared_order - ORDER_SLACK


def left_open(book: EnergyBook) -> float:
    """Return the size [J] of what the motion and the springs make up, added without signs."""
    return abs(book.from_motion) + abs(book.from_springs)


def is_rounding(book: EnergyBook) -> bool:
    """Tell whether what is open is no more than rounding of the energies in the books."""
    return left_open(book) <= ROUNDING * max(abs(book.start), abs(book.end), book.turned_over)


def measured_order(first: float, last: float, refinement: float) -> float:
    """Return p of an error that falls as step^p from `first` to `last`, over a refinement of the step."""
    return math.log(first / last) / math.log(refinement) if last > 0.0 else math.inf


def open_books(
    scene: Scene, simulate: Callable[[Scene], Run], refinements: Sequence[int] = REFINEMENTS
) -> OpenBooks:
    """Run a scene at shorter and shorter steps and return what its books leave open.

    simulate : returns the run of a scene, in whatever world
    """
    books: list[EnergyBook] = []
    for factor in refinements:
        run = simulate(scene.with_values({"rate": scene.rate * factor}))
        books.append(energy_book(run))
        if is_rounding(books[-1]):
            break
    done = tuple(refinements[: len(books)])
    shares = tuple(share(left_open(book), book.turned_over) for book in books)
    falls = None if len(done) < 2 else measured_order(left_open(books[0]), left_open(books[-1]), done[-1] / done[0])
    return OpenBooks(scene.name, done, shares, INTEGRATORS[run.law_settings["integrator"]].order, falls)
