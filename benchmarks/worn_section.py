"""Frequency shift of a tube that is worn all around at its supports, which a life prediction does not model.

environment/run python3 -m benchmarks.worn_section [depth in mm]
"""

from __future__ import annotations

import sys
import tempfile
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import gapbeam

CASE = Path(__file__).parents[1] / "cases" / "tube-turbulence.toml"
DEPTH = 0.1  # mm
BEAM = {"type": "beam"}


def frequencies(case: dict[str, Any]) -> dict[str, list[float]]:
    """Return the frequencies of bending by what the supports do, Hz."""
    with tempfile.TemporaryDirectory() as folder:
        found = gapbeam.modes(case, output=Path(folder) / "modes").comparison
    return {name: list(map(float, state.bending()[0][: found.count])) for name, state in found.states.items()}


def main(words: Sequence[str]) -> None:
    """Print the table."""
    depth = 1.0e-3 * float(words[0] if words else DEPTH)
    case = tomllib.loads(CASE.read_text(encoding="utf-8")) | {"model": BEAM}
    beam = case["beam"]
    section = beam["section"] | {"wall": beam["section"]["wall"] - depth}
    thin = {"thickness": beam["thickness"] - 2.0 * depth, "width": beam["width"] - 2.0 * depth, "section": section}
    worn = [{"name": f"{one['name']}-worn", "from": one["from"], "to": one["to"]} | thin for one in case["support"]]
    new, old = frequencies(case), frequencies(case | {"segment": worn})
    print("| supports | mode | new, Hz | worn, Hz | change |\n|---|---|---|---|---|")
    for state, values in new.items():
        for number, (one, other) in enumerate(zip(values, old[state], strict=True), 1):
            print(f"| {state} | {number} | {one:.2f} | {other:.2f} | {other / one - 1.0:+.2%} |")


if __name__ == "__main__":
    main(sys.argv[1:])
