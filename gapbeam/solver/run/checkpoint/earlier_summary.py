"""The summary of an earlier run in a results folder, as far as it can be read."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from gapbeam.solver.record_table import SUMMARY_FILE

LARGEST_SUMMARY = 64 * 2**20  # bytes


def earlier_summary(folder: Path) -> dict[str, Any]:
    """Return the summary of a run; of one that cannot be read, nothing."""
    path = folder / SUMMARY_FILE
    try:
        if path.stat().st_size > LARGEST_SUMMARY:
            return {}
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) and isinstance(found.get("message"), str) else {}
