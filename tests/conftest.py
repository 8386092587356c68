"""What every test is held to."""

from __future__ import annotations

import logging
from collections.abc import Iterator

import pytest


@pytest.fixture(autouse=True)
def log_left_alone() -> Iterator[None]:
    """Fail the test that leaves the log changed: commands set theirs up, so they are called in other processes."""
    logger = logging.getLogger("gapbeam")
    before = logger.propagate, logger.level, list(logger.handlers)
    yield
    assert (logger.propagate, logger.level, logger.handlers) == before, "call commands by tests.command.called"
