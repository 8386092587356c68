"""Cost of the error estimate that follows a run: its companions, set up and marched for some steps."""

from __future__ import annotations

from typing import TYPE_CHECKING

from gapbeam.meshes.distribution.rank_zero import on_rank_zero
from gapbeam.solver.case.analysis_table import Transient
from gapbeam.solver.case.solution_tables import FullModel
from gapbeam.solver.models.model import Model
from gapbeam.studies.error_estimate.companion_marches import companion_motions
from gapbeam.studies.error_estimate.run_errors import errors_wanted, plan_of

if TYPE_CHECKING:
    from mpi4py import MPI

RECORDS = 256  # of each companion that is tried out


def cost_of_errors(model: Model, comm: MPI.Comm) -> tuple[float, int]:
    """Return the wall time that the error estimate of a run takes, s, and the number of its companions.

    Each companion is set up as it will be, and marched for some records; the rest of its steps take as long. What is
    compiled in the first steps of the first companion is kept, and does not count.

    Args:
        model: Of the run.
        comm: Its ranks; the first one works, as it does for the estimate.

    Collective.
    """
    case = model.case
    if not errors_wanted(case) or not isinstance(case.analysis, Transient) or case.analysis.state is not None:
        return 0.0, 0
    computed = {default.key: default.value for default in model.defaults}
    small = comm.size == 1 and not isinstance(case.model, FullModel)

    def tried() -> tuple[float, int]:
        plan = plan_of(case, computed)
        interval = plan.records * (case.output.history_interval or model.step)
        end, body = min(RECORDS * interval, case.time.end), model.body if small else None
        if not small:
            list(companion_motions(case, plan.companions[:1], end, interval, body=body))
        found = list(companion_motions(case, plan.companions, end, interval, body=body))
        set_up = sum(one.seconds - one.march for one in found)
        marches = sum(one.march / one.steps * case.time.end / one.step for one in found if one.steps)
        return set_up + marches, len(found)

    return on_rank_zero(comm, tried)
