"""What every test is held to, and how long the slow ones may take together."""

from __future__ import annotations

import gc
import logging
import os
import signal
import time
from collections.abc import Iterator

import pytest
from hypothesis import settings

BEGAN = pytest.StashKey[float]()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption(
        "--within", type=float, metavar="MINUTES", help="begin no test that is not expected to end this soon"
    )
    parser.addoption("--longest", type=float, metavar="MINUTES", help="leave out tests expected to take longer")


def pytest_configure(config: pytest.Config) -> None:
    config.stash[BEGAN] = time.monotonic()
    gc.disable()  # until all tests are collected
    os.environ["GAPBEAM_ERRORS"] = "none"  # the tests of error estimates ask for them
    os.environ["GAPBEAM_KEEP"] = "none"  # a basis that an earlier test kept would hide what this one changes
    settings.register_profile("no wall time", deadline=None)
    settings.load_profile("no wall time")
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell that starts tests beside itself ignores Ctrl-C


def minutes_of(item: pytest.Item) -> float:
    """Return how long a test is expected to take: what its mark `slow` says, or one minute."""
    mark = item.get_closest_marker("slow")
    return float(mark.kwargs.get("minutes", 1.0)) if mark else 1.0


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """With --within, begin with the tests that take least: most are run. With --longest, leave the others out."""
    longest = config.getoption("longest")
    if longest is not None:
        config.hook.pytest_deselected(items=[item for item in items if minutes_of(item) > longest])
        items[:] = [item for item in items if minutes_of(item) <= longest]
    if config.getoption("within") is not None:
        items.sort(key=minutes_of)


def pytest_collection_finish() -> None:
    """Keep the garbage collector away from ten thousand tests and their modules."""
    gc.freeze()
    gc.enable()


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Leave out, by name, what would not end in time."""
    within = item.config.getoption("within")
    if within is not None:
        left = within - (time.monotonic() - item.config.stash[BEGAN]) / 60.0
        if minutes_of(item) > left:
            pytest.skip(f"not run, {max(left, 0.0):.0f} of {within:g} minutes left: {item.nodeid}")


@pytest.fixture(autouse=True)
def log_restored() -> Iterator[None]:
    """Fail the test that leaves the log changed: commands set theirs up, so they are called in other processes."""
    logger = logging.getLogger("gapbeam")
    before = logger.propagate, logger.level, list(logger.handlers)
    yield
    assert (logger.propagate, logger.level, logger.handlers) == before, "call commands by tests.command.called"
