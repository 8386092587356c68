"""Write cases/signals/transport.csv, a made-up record of a support in a transport: python3 docs/transport_signal.py."""

from __future__ import annotations

from pathlib import Path

import numpy as np

FILE = Path(__file__).resolve().parents[1] / "cases" / "signals" / "transport.csv"
RATE, END = 2000.0, 0.5
HEADER = """\
# Acceleration of a support in a transport, along the bending direction of the beam, upward. Not measured: made by
# docs/transport_signal.py as a = 2 exp(-((t - 0.14)/0.05)^2) sin(2 pi 23 t) + p(t), in g, with the shock of a curb
# p(t) = 6 sin(pi (t - 0.3)/0.011)^2 for 0.3 s < t < 0.311 s, else 0; 2000 rows in a second.
time (s),acceleration (g)
"""


def acceleration(time: np.ndarray) -> np.ndarray:
    """Return the acceleration at times in s, g."""
    shock = np.where((time > 0.3) & (time < 0.311), 6.0 * np.sin(np.pi * (time - 0.3) / 0.011) ** 2, 0.0)
    return np.asarray(2.0 * np.exp(-(((time - 0.14) / 0.05) ** 2)) * np.sin(2.0 * np.pi * 23.0 * time) + shock)


def page() -> str:
    """Return the contents of the file."""
    times = np.arange(round(END * RATE) + 1) / RATE
    rows = (f"{time:.4f},{value:.6f}\n" for time, value in zip(times, acceleration(times), strict=True))
    return HEADER + "".join(rows)


if __name__ == "__main__":
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_text(page(), encoding="utf-8")
