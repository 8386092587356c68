"""Errors that end a run, each with its exit status."""

from __future__ import annotations


class RunError(Exception):
    """Error of a run that cannot be trusted or continued; the message says when, where and what to try.

    Attributes:
        exit_status: Of the command.
        reason: In a few words, for `summary.json`: several reasons may share a status.
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
