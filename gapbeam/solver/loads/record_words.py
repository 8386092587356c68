"""How fast a record is, and what it holds, in words."""

from __future__ import annotations

from gapbeam.solver.loads.recorded_function import MOST_POWER, RecordedSignal


def record_words(signal: RecordedSignal, step: float) -> tuple[str, str]:
    """Return the frequency of interest of a record, and how many rows and steps show it.

    Args:
        signal: The record.
        step: Time step, s.
    """
    curve, frequency = signal.curve, signal.content.below(MOST_POWER)
    words = (
        f"below which {MOST_POWER:.0%} of its power lie, {1.0 / (frequency * step):.4g} steps per period; "
        if frequency > 0.0
        else ""
    )
    words += f"{len(curve.knots)} rows over {curve.span:.6g} s, every {curve.interval:.4g} s; peak {signal.peak:.4g}"
    return f"{frequency:.4g} Hz", words
