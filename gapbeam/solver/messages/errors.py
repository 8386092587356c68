"""Errors that end a run, each with its exit status; faults of a file with where, found, expected and advice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


class RunError(Exception):
    """Error of a run that cannot be trusted or continued; the message says when, where and what to try.

    Attributes:
        exit_status: Exit status of the command.
        reason: Reason in a few words, for `summary.json`: several reasons may share a status.
        run_status: End of the run, for `summary.json`: "failed", "interrupted" or "completed".
    """

    run_status = "failed"
    exit_status = 1
    reason = "internal error"


class NotConverged(RunError):  # noqa: N818 - the field's word
    """The contact solve of a step, or the static seat, did not reach its tolerance."""

    exit_status = 4
    reason = "not converged"

    def __init__(self, message: str, residuals: tuple[float, ...] = (), worst_point: int | None = None) -> None:
        super().__init__(message)
        self.residuals = residuals
        self.worst_point = worst_point


class EnergyCreated(RunError):  # noqa: N818
    """The scheme created more energy than the gates of the case allow."""

    exit_status = 3
    reason = "energy created"


class EnergyLost(RunError):  # noqa: N818
    """The scheme took more energy than the gates of the case allow."""

    exit_status = 3
    reason = "energy lost"


class NotFinite(RunError):  # noqa: N818
    """A NaN or an infinity appeared in the state."""

    exit_status = 4
    reason = "not finite"


class RangeNotCovered(RunError):  # noqa: N818
    """A response curve could not be followed over the range that was asked for."""

    run_status = "completed"
    exit_status = 5
    reason = "range not covered"


class IntervalNotMet(RunError):  # noqa: N818
    """A run came to its longest time before the interval of a statistic was as narrow as asked for."""

    run_status = "completed"
    exit_status = 5
    reason = "interval not met"


class AssumptionBroken(RunError):  # noqa: N818
    """The beam has left what the equations assume: small rotations and strains, inside its support."""

    exit_status = 4
    reason = "assumption broken"


class UserError(RunError):
    """A fault of the input that shows only after reading the case: found, expected, what to try."""

    exit_status = 2
    reason = "refused"


class NotWritten(RunError):  # noqa: N818
    """Results or a checkpoint could not be written."""

    exit_status = 6
    reason = "not written"


class OutOfMemory(RunError):  # noqa: N818
    """The memory of a machine, or the limit that a job has of it, was used up."""

    exit_status = 7
    reason = "out of memory"


class Interrupted(RunError):  # noqa: N818
    """The user, a scheduler or the wall-time limit asked the run to stop."""

    run_status = "interrupted"
    exit_status = 130
    reason = "interrupted"

    def __init__(self, message: str, exit_status: int = 130) -> None:
        super().__init__(message, exit_status)
        self.exit_status = exit_status

    def __str__(self) -> str:
        return str(self.args[0])


LONGEST = 500  # characters of what was found

Key = tuple[str | int, ...]
"""The way to a value in a case file: ("support", "clearance"), ("load", 1, "amplitude")."""


@dataclass(frozen=True)
class Fault:
    """One fault, made to be read by the person who wrote the case file.

    The checks know the key and the other keys that take part in a contradiction (`related`);
    `reading.case_reader` adds `where`, the place in words with file and line, before anybody reads it. `lacks` names
    the arrays of tables in which an entry was looked for and not found: none is missed where one is faulty itself.
    """

    key: Key
    found: str
    expected: str
    hint: str = ""
    related: tuple[Key, ...] = ()
    where: str = ""
    lacks: tuple[str, ...] = ()

    def __str__(self) -> str:
        lines = [_short(self.where), f"  found:    {_short(self.found)}", f"  expected: {self.expected}"]
        if self.hint:
            lines.append(f"  try:      {self.hint}")
        return "\n".join(lines)


def _short(words: str) -> str:
    """Return words of the user's in one line that can be read."""
    line = words.replace("\n", "\\n")
    return line if len(line) <= LONGEST else f"{line[:LONGEST]} ... ({len(line)} characters)"


NOTHING_RUN = "nothing was run."


def in_one_line(message: str) -> str:
    """Return the first line of a message, or the first fault of a case that was refused.

    Args:
        message: Message of an error, such as `str(CaseError)`.
    """
    lines = [line.strip() for line in message.strip().splitlines() if line.strip()] or [""]
    if not lines[0].endswith(NOTHING_RUN) or len(lines) < 2:
        return lines[0]
    place = lines[1][max(lines[1].find("["), 0) :]
    words = [" ".join(line.split()) for line in lines[2:4] if line.startswith(("found:", "expected:"))]
    return f"{place}: {', '.join(words)}"


class CaseError(Exception):
    """A case that cannot be run, with all its faults; `str()` is the whole message."""

    exit_status = 2

    def __init__(self, source: str, faults: Sequence[Fault]) -> None:
        super().__init__(source, faults)
        self.source = source
        self.faults = tuple(faults)

    def __str__(self) -> str:
        count = "a fault" if len(self.faults) == 1 else f"{len(self.faults)} faults"
        return "\n\n".join([f"{self.source} has {count}; {NOTHING_RUN}", *map(str, self.faults)])
