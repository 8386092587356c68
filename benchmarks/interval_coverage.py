"""Coverage of 95 % intervals: Ornstein-Uhlenbeck records, and rattling under white noise.

environment/run python3 -m benchmarks.interval_coverage [signals of rattling] [seconds of each]
"""

from __future__ import annotations

import sys

import numpy as np

from gapbeam.solver.diagnostics.statistics.batch_interval import interval_of_mean, verdict_on
from tests.shared.rattlers import between_stops, marched
from tests.verification.test_interval_coverage import ornstein_uhlenbeck

RECORDS, SIGNALS, SECONDS = 600, 100, 600.0
RULED = "| {} |\n|{}"
OF_RECORDS = ("relaxation times", "mean", "mean square", "judged good", "of these, mean", "mean square")
OF_RATTLING = ("stops", "figure", "exact", "mean of all signals", "intervals that hold it", "mean half width")


def print_records() -> None:
    """Print the coverage of means and mean squares of Ornstein-Uhlenbeck records by their length."""
    print(RULED.format(" | ".join(OF_RECORDS), "---|" * len(OF_RECORDS)))
    for relaxations in (10, 22, 55, 110, 220, 1000):
        rows = []
        for seed in range(RECORDS):
            x = ornstein_uhlenbeck(seed, relaxations)
            mean, square = interval_of_mean(x), interval_of_mean(x * x, positive=True)
            rows.append((mean.low <= 0.0 <= mean.high, square.low <= 1.0 <= square.high, verdict_on(x) == "good"))
        held = np.array(rows, dtype=float)
        good = held[held[:, 2] > 0.0]
        shares = [*held.mean(axis=0), *(good[:, :2].mean(axis=0) if len(good) else (np.nan, np.nan))]
        print(f"| {relaxations} | " + " | ".join(f"{100 * share:.1f} %" for share in shares) + " |")


def print_rattling(signals: int, seconds: float) -> None:
    """Print how far figures of rattling are off the exact ones, and how often their intervals hold them."""
    print(RULED.format(" | ".join(OF_RATTLING), "---|" * len(OF_RATTLING)))
    for count in (1, 2):
        rattler = between_stops(count)
        found = [
            {one.name: one.interval for one in marched(rattler, seed, seconds).figures()} for seed in range(signals)
        ]
        for name, exact in rattler.exact.items():
            intervals = [one[name] for one in found]
            held = np.mean([one.low <= exact <= one.high for one in intervals])
            value = np.mean([one.value for one in intervals])
            width = np.mean([one.relative for one in intervals])
            off = f"{value:.5f} ({value / exact - 1:+.1%})"
            print(f"| {count} | `{name}` | {exact:.5f} | {off} | {held:.1%} | {width:.1%} |", flush=True)


if __name__ == "__main__":
    print_records()
    given = [float(word) for word in sys.argv[1:]]
    print_rattling(int(given[0]) if given else SIGNALS, given[1] if given[1:] else SECONDS)
