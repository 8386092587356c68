"""gapbeam: dynamic contact of beams and tubes in supports with play."""

from gapbeam.surroundings import cache_by_default, home_by_default
from gapbeam.threads import one_thread_by_default

home_by_default()  # before anything loads Open MPI
cache_by_default()  # before anything loads DOLFINx
one_thread_by_default()  # before anything loads a numerical library

from gapbeam.api import open_results, run  # noqa: E402

__all__ = ["open_results", "run"]
