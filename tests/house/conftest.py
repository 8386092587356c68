"""Trees of all sources, kept without the garbage collector: it took two thirds of the time."""

from __future__ import annotations

import gc
from collections.abc import Iterator

import pytest

from tests.house.test_house_rules import imports, nodes, tree


@pytest.fixture(autouse=True, scope="module")
def uncollected() -> Iterator[None]:
    """Leave the collector out while the rules of a module walk the trees, and leave no tree behind."""
    gc.disable()
    yield
    for kept in (imports, nodes, tree):
        kept.cache_clear()
    gc.enable()
