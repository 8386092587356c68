"""Slips in tables of a file of several structures: a change of one key, and its refusal at that key."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import gapbeam as gb

Tables = dict[str, Any]
Change = Callable[[Tables, Path], None]


def put(*path: str | int, value: Any) -> Change:
    """Return a change that sets a key; None removes it."""

    def change(given: Tables, _: Path) -> None:
        inside: Any = given
        for part in path[:-1]:
            inside = inside[part]
        if value is None:
            del inside[path[-1]]
        else:
            inside[path[-1]] = value

    return change


def check_refused(given: Tables, where: str, words: str) -> None:
    """Assert status 2, at the key that is wrong, in words that name it."""
    with pytest.raises(gb.CaseError) as refused:
        gb.scene(given)
    assert refused.value.exit_status == 2
    assert any(re.search(where, fault.where) for fault in refused.value.faults), str(refused.value)
    assert re.search(words, str(refused.value)), str(refused.value)


def check_slip(given: Tables, slip: tuple[Change, str, str], folder: Path) -> None:
    """Assert that tables are refused after a change, as `check_refused` does."""
    change, where, words = slip
    change(given, folder)
    check_refused(given, where, words)
