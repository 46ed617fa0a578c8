"""The maker of small runs, for tests of what is made from runs."""

import pytest

from tests.reports.made_up import made_run


@pytest.fixture(scope="session")
def make_run():
    return made_run
