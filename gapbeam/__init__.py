"""gapbeam: dynamic contact of beams and tubes in supports with play."""

from gapbeam.loading import leave_quietly_while_loading

leave_quietly_while_loading()  # before anything that takes long to load

from gapbeam.surroundings import cache_by_default, home_by_default, signals_by_default  # noqa: E402
from gapbeam.threads import one_thread_by_default  # noqa: E402

home_by_default()  # before anything loads Open MPI
cache_by_default()  # before anything loads DOLFINx
signals_by_default()  # before anything loads PETSc
one_thread_by_default()  # before anything loads a numerical library

from gapbeam.api import open_results, run  # noqa: E402

__all__ = ["open_results", "run"]
