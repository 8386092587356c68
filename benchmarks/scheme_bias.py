"""Bias of rattling figures by scheme and step, against the exact stationary law of a mass with one stop.

environment/run python3 -m benchmarks.scheme_bias [seconds of each of 16 masses] [name of a scheme to march alone]

Schemes that no compiled march has go with 64 masses and a 50th of the seconds.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence

from gapbeam.solver.integrators.scheme_choice import scheme_names, scheme_of
from gapbeam.solver.messages.errors import RunError
from tests.shared.masses_under_noise import FIGURES, Biases, biases_of

SECONDS = 20000.0
MANY, SHORTER = 64, 50.0  # masses of marches in Python, in which more of them cost little, and their spans
STEPS = (1, 2, 4, 8, 16)  # in a contact
UNSTABLE = 20.0  # times the exact figure
REBOUNDS = {"moreau-jean": {"restitution": 1.0}}  # impulses without loss: other stops take energy


def print_biases(name: str, seconds: float) -> None:
    """Print the biases of a scheme, a line for each step, each figure with its standard error."""
    scheme, started = scheme_of(name, **REBOUNDS.get(name, {})), time.process_time()
    marches = (seconds,) if scheme.kernel is not None else (seconds / SHORTER, MANY)
    for steps in STEPS:
        try:
            cells = _cells(biases_of(scheme, steps, *marches))
        except RunError:
            cells = ["no march"] * len(FIGURES)
        print(f"| `{name}` | {'tc' if steps == 1 else f'tc/{steps}'} | {' | '.join(cells)} |", flush=True)
    print(f"<!-- {name}: {time.process_time() - started:.0f} s of processor time -->", flush=True)


def _cells(found: Biases) -> list[str]:
    """Return the cells of a figure."""
    if not all(abs(one) < UNSTABLE for one in found.relative.values()):
        return ["unstable"] + [""] * (len(FIGURES) - 1)
    if found.halved:
        return [f"{found.halved} parts of halved steps"] + [""] * (len(FIGURES) - 1)
    return [
        f"{100 * found.relative[name]:+.2g} ± {100 * found.errors[name]:.1g}" if name in found.relative else ""
        for name in FIGURES
    ]


def main(words: Sequence[str]) -> None:
    """Print the table."""
    print("| scheme | step | " + " | ".join(f"{name}, %" for name in FIGURES) + " |\n" + "|---" * 7 + "|")
    for name in scheme_names():
        if not words[1:] or words[1] == name:
            print_biases(name, float(words[0]) if words else SECONDS)


if __name__ == "__main__":
    main(sys.argv[1:])
