"""Run the cases at full length at all sizes, and print differences other than the size.

environment/run python3 -m benchmarks.similarity [name ...]
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from benchmarks.similarity.similar_cases import SIMILAR_CASES
from benchmarks.similarity.similar_runs import AT_ROUND_OFF, SIZES, difference, largest, motion


def main() -> None:
    """Print, case by case and size by size, whether messages agree and which history differs most."""
    for one in SIMILAR_CASES:
        if len(sys.argv) > 1 and one.name not in sys.argv[1:]:
            continue
        with tempfile.TemporaryDirectory() as place:
            case = one.case(whole=True)
            unit = motion(case, 1.0, Path(place) / "unit")
            for size in SIZES:
                other = motion(case, size, Path(place) / "other")
                apart = {
                    name: difference(values, other.history[name], largest(unit, name))
                    for name, values in unit.history.items()
                    if name not in AT_ROUND_OFF
                }
                worst = max(apart, key=lambda name: apart[name])
                said = (
                    "same messages" if (unit.lines, unit.message) == (other.lines, other.message) else "OTHER MESSAGES"
                )
                print(
                    f"{one.name} x {size:g}: status {unit.status}, {other.status}; {said}; {worst} {apart[worst]:.2g}"
                )


if __name__ == "__main__":
    main()
