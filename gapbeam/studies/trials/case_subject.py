"""A case as the subject of a study: its model, starts, responses and the statistics that they have."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gapbeam.solver.case.analysis_table import Periodic, Transient
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import smoothing_window
from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.case.reading.known_keys import flat
from gapbeam.solver.diagnostics.statistics.run_statistics import RunStatistics
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.models.body_key import body_key
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.checkpoint.same_model import checksum_of
from gapbeam.solver.run.stop_rule import gathered_statistics, has_statistics, statistics_of
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, State, imaged
from gapbeam.studies.engine.worker_memory import worker_memory
from gapbeam.studies.trials.response import TrialResponse, respond
from gapbeam.studies.trials.starts import KeptBody, Start, carried, kicked, seated, span

SAME = 1e-6  # of the range of the gaps: the same basis gives the same gaps
ROUND_OFF = 1e-11  # of the largest gap
BODY = KeptBody()  # of this process


class CaseSubject:
    """A case; a `Subject`.

    Args:
        case: The case.
    """

    moves_by_itself = False
    carried_keys = "support.clearance, contact.stiffness, load.NAME.amplitude or load.NAME.frequency"

    def __init__(self, case: Case) -> None:
        self.case = case

    @cached_property
    def model(self) -> Model:
        """The model; its body is shared with the case before it where it is the same."""
        return BODY.model(self.case)

    @property
    def tables(self) -> dict[str, Any]:
        """See `Subject`."""
        return flat(self.case.model_dump(mode="json"))

    @property
    def contents(self) -> dict[str, Any]:
        """See `Subject`."""
        file = self.case.mesh.file
        if file is None:
            return {}
        return {"contents of mesh.file": checksum_of(Path(file)) if Path(file).is_file() else None}

    @property
    def state_keys(self) -> dict[str, Any]:
        """See `Subject`."""
        return flat(body_key(self.case).model_dump(mode="json"))

    @property
    def figures(self) -> Sequence[Figure]:
        """See `Subject`."""
        return self.case.figure

    @property
    def is_random(self) -> bool:
        """See `Subject`."""
        return has_statistics(self.case)

    @property
    def frequency(self) -> float | None:
        """See `Subject`."""
        return span(self.model)[1]

    @property
    def window(self) -> float:
        """See `Subject`."""
        return smoothing_window(self.case)[0]

    def refuse(self) -> None:
        """See `Subject`."""
        if isinstance(self.case.analysis, Periodic):
            raise UserError(
                'analysis.type = "periodic": a sweep marches to its responses; expected "transient", or a '
                "[analysis.continuation] and gapbeam run, which follow a periodic response along a key"
            )

    def memory_with(self, others: Sequence[CaseSubject]) -> float | None:
        """See `Subject`."""
        return worker_memory(one.case for one in (self, *others))

    def start(self, number: int, seed: int) -> Start:
        """See `Subject`."""
        return seated(self.model) if number == 0 else kicked(self.model, number, seed)

    def carried(self, end: State, before: CaseSubject) -> Start:
        """See `Subject`."""
        return carried(self.model, end, before.case)

    def respond(self, begin: Start, rings: bool) -> TrialResponse:
        """See `Subject`."""
        model = self.model
        interval = self.case.output.history_interval or model.step
        statistics = statistics_of_response(model, interval)
        return respond(model, begin.state, span(model)[0], interval, watched=True, rings=rings, statistics=statistics)

    def stays_linear(self, history: xr.Dataset, after: float) -> bool:
        """See `Subject`."""
        law = self.model.law
        if law.friction is not None or not law.linear:
            return False
        return keeps_contacts(history, after)

    def packed(self, end: State) -> dict[str, Array]:
        """See `Subject`."""
        time = np.asarray(end.time)
        return {"time": time, "u": end.u[0], "v": end.v[0], "depth": end.depth, "pressure": end.pressure}

    def unpacked(self, arrays: Any) -> State | None:
        """See `Subject`."""
        system = self.model.system
        u, v = (imaged(system.operators, arrays[name]) for name in ("u", "v"))
        state = State(float(arrays["time"]), u, v, arrays["depth"], arrays["pressure"])
        depth = system.contact.depth(system.contact.interface.trace(u[VALUE], system.operators), state.time)
        return state if same_places(depth, state.depth) else None


def statistics_of_response(model: Model, interval: float) -> RunStatistics | None:
    """Return the statistics to gather of a response; None where it is no transient.

    A response to a periodic force may turn out chaotic: its statistics are gathered, too. Its force holds it up, so
    that the damping of the beam is no time that its motion remembers.

    Args:
        model: The model.
        interval: Time between records, s.
    """
    if not isinstance(model.case.analysis, Transient):
        return None
    every = max(1, round(interval / model.step))
    return statistics_of(model, every) or gathered_statistics(model, every)


def keeps_contacts(history: xr.Dataset, after: float) -> bool:
    """Return whether no contact point opened or closed from a time on, s."""
    closed = history["active_points"].sel(time=slice(after, None)).values
    return bool(np.all(closed == closed[:1]))


def same_places(found: Array, stored: Array) -> bool:
    """Return whether places of contacts are the same as stored ones: those of one basis are, those of two are not."""
    if not stored.size:
        return True
    allowed = SAME * float(np.ptp(stored)) + ROUND_OFF * float(np.max(np.abs(stored)))
    return found.shape == stored.shape and np.allclose(found, stored, rtol=0.0, atol=allowed)
