"""The clock: warm, in random order, compiled code within compiled code; what fails takes no further
turns."""

from __future__ import annotations

from verification.clock import sampler, take_turns


def test_contestants_take_turns_in_an_order_that_changes_and_the_first_round_does_not_count() -> (
    None
):
    order: list[str] = []

    def contestant(name: str) -> float:
        order.append(name)
        return float(len(order))

    found = take_turns({name: lambda name=name: contestant(name) for name in "abc"}, 20)  # type: ignore[misc]
    rounds = ["".join(order[k : k + 3]) for k in range(0, len(order), 3)]
    assert len(rounds) == 21 and {"".join(sorted(each)) for each in rounds} == {"abc"}
    assert len(set(rounds)) == 6  # every order occurs
    assert [len(times.samples) for times in found.values()] == [20] * 3
    assert (
        min(min(times.samples) for times in found.values()) > 3.0
    )  # the warm round had 1, 2 and 3


def test_the_first_call_does_not_say_how_many_a_sample_needs() -> None:
    """It loads machine code, and what takes so long once would be timed alone and with cold caches
    ever after."""
    calls: list[int] = []

    def call() -> None:
        calls.append(sum(range(1_000_000 if not calls else 10)))

    sample = sampler(call)
    before = len(calls)
    sample()
    assert len(calls) - before > 100  # a warm sample, then one that counts
