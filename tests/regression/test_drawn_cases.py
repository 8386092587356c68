"""Drawn cases of the whole schema end as they should, and agree with another way to compute them."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.drawn_schema.attempts import attempted
from tests.shared.command import alone


@alone
@pytest.mark.slow(minutes=4)
def test_drawn_cases_agree_with_another_way(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No trace, no undocumented status, no hang, and no status 0 with an answer outside of its stated error."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    lines = [attempted(seed, tmp_path / str(seed)) for seed in range(600, 620)]
    assert [line for line in lines if line["findings"]] == []
    assert sum(line["status"] == 0 for line in lines) >= 5
    assert sum(bool(line.get("figures")) for line in lines) >= 3
