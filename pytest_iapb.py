"""pytest plugin: one test per law for an impact resolver, or with `device=BareDevice(...)` for a force
law. It imports this project only if a test uses it.

import pytest
from my_solver import resolve

@pytest.mark.iapb(contract="unilateral")
def test_resolve(iapb_law):
    iapb_law(resolve)
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import Any

import pytest

IMPACTS = 1000  # for each law, unless the marker or --iapb-impacts gives another number
_MARKER = (
    "iapb(contract='equality', laws=None, impacts=1000, **options): what `iapb_law` judges by; "
    "options as of verification.check_passivity; with device=BareDevice(...), of check_force"
)


def _at_least(least: int) -> Callable[[str], int]:
    def number(text: str) -> int:
        value = int(text)
        if value < least:
            raise argparse.ArgumentTypeError(f"{text}: expected a whole number, {least} or more")
        return value

    return number


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the options for the number of impacts and the seed."""
    group = parser.getgroup("iapb", "laws of impact resolvers")
    group.addoption(
        "--iapb-impacts",
        type=_at_least(1),
        metavar="N",
        help=f"random impacts for each law [{IMPACTS}]",
    )
    group.addoption(
        "--iapb-seed", type=_at_least(0), default=0, metavar="N", help="seed of the impacts [0]"
    )


def pytest_configure(config: pytest.Config) -> None:
    """Register the marker `iapb`."""
    config.addinivalue_line("markers", _MARKER)


def _asked(node: Any) -> dict[str, Any]:
    """Return the keywords of the nearest marker `iapb`."""
    marker = node.get_closest_marker("iapb")
    return {} if marker is None else dict(marker.kwargs)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Give a test that uses `iapb_law` one parameter for each law of its contract."""
    if "iapb_law" not in metafunc.fixturenames:
        return
    from iapb.errors import IapbError
    from iapb.lazy import needed

    try:
        kits = needed("verification.port.marked", "The fixture iapb_law")
        laws = kits.laws_of(_asked(metafunc.definition))
    except IapbError as error:
        pytest.fail(f"marker iapb: {error}", pytrace=False)
    metafunc.parametrize("iapb_law", list(laws), indirect=True)


@pytest.fixture
def iapb_law(request: pytest.FixtureRequest) -> Callable[[Callable[..., Any]], None]:
    """Return a function that tests a resolver, or a force law if the marker has a device, against one
    law and fails the test with a shrunk counterexample."""
    from verification.port.marked import judged

    asked = _asked(request.node)
    impacts = request.config.getoption("--iapb-impacts")
    if impacts is not None:
        asked["impacts"] = impacts
    asked.setdefault("seed", request.config.getoption("--iapb-seed"))

    def judge(subject: Callable[..., Any]) -> None:
        __tracebackhide__ = True
        report = judged(subject, request.param, IMPACTS, asked)
        if not report.passed:
            pytest.fail(f"{report}\n\nseed {report.seed}", pytrace=False)

    return judge
