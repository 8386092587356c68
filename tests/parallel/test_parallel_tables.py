"""Tables on all ranks, piece by piece: against whole ones, in files that numpy reads, and in any order."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.shared.command import alone, on_ranks

pytestmark = [alone, pytest.mark.versions]


@pytest.mark.slow(minutes=0.1)
def test_tables_come_piece_by_piece(tmp_path: Path) -> None:
    """Three ranks, one of them empty: written by some, read by others in another order, to the bit; faults on all.

    Rank 0 holds a few pieces beside what is its own, not the 15 MB of the whole.
    """
    done = on_ranks(3, tmp_path, program="tests.programs.tables_in_any_order")
    assert done.returncode == 0, done.stderr
    held, whole = json.loads(done.stdout)
    assert whole == 3 * 210_000 * 3 * 8
    assert held < 0.5 * whole
    path = next((tmp_path / "checkpoint").iterdir())
    line, rest = path.read_bytes().split(b"\n", 1)
    text, block = map(int, line.split()[-2:])
    assert len(rest) == text + block
    (tmp_path / "arrays.npz").write_bytes(rest[text:])
    with np.load(tmp_path / "arrays.npz") as stored:
        arrays = dict(stored)
    assert {name: array.shape for name, array in arrays.items()} == {
        "nodes": (60, 3),
        "u": (3, 60, 2),
        "lagged": (60, 2),
        "few": (5,),
    }
    np.savez(tmp_path / "whole.npz", **arrays)
    assert (tmp_path / "whole.npz").read_bytes() == rest[text:]
