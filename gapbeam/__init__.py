"""gapbeam: dynamic contact of beams and tubes in supports with play."""

from gapbeam.api import open_results, run

__all__ = ["open_results", "run"]
