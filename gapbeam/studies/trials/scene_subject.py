"""Cases and files of structures as subjects of studies: their models or scenes, starts, responses and statistics.

A kick is a random combination of the shapes into which contacts and loads that vary bend the structures,

    (omega^2 + W^2) q = B^T e_i    or    (omega^2 + W^2) q = p_j max |s_j - mean s_j|,

with the modal frequencies W, contact motions B and load patterns p_j; its kinetic energy is uniform up to twice the sum
of q . p / 2 of the loads.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gapbeam.solver.case.analysis_table import Periodic, Transient
from gapbeam.solver.case.case import Case
from gapbeam.solver.case.computed_defaults import smoothing_window
from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.case.reading.overrides import unit_of_key
from gapbeam.solver.case.reading.value_words import flat
from gapbeam.solver.diagnostics.statistics.run_statistics import RunStatistics
from gapbeam.solver.loads.load_choice import forcing_frequencies
from gapbeam.solver.messages.errors import Interrupted, RunError, UserError
from gapbeam.solver.models.body import body_key
from gapbeam.solver.models.model import Model
from gapbeam.solver.run.checkpoint.same_model import checksum_of
from gapbeam.solver.run.interruption import Signals
from gapbeam.solver.run.scene_run import SceneMarch, SceneRun, smoothing_of
from gapbeam.solver.run.scene_summary import findings_of
from gapbeam.solver.run.stop_rule import gathered_statistics, has_statistics, statistics_of
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.scene_file.scene_builder import with_noise
from gapbeam.solver.scene_file.scene_checks import FILES
from gapbeam.solver.scene_file.scene_reader import ReadScene, SceneFile
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.semi_discrete import VALUE, State, imaged
from gapbeam.studies.engine.worker_memory import LIBRARIES, RECORDS, worker_memory
from gapbeam.studies.trials.response import TrialResponse, respond, stacked
from gapbeam.studies.trials.starts import (
    KICK,
    KeptBody,
    Start,
    carried,
    drawn_phase,
    kicked,
    phase_kept,
    seated,
    span,
    whole_steps,
)

SAME = 1e-6  # of the range of the gaps: the same basis gives the same gaps
ROUND_OFF = 1e-11  # of the largest gap
BODY = KeptBody()  # of this process


def file_contents(tables: Mapping[str, Any]) -> dict[str, str]:
    """Return checksums of the files that tables name, by dotted keys, where no key `checksum` stands beside."""
    found = {}
    for key, one in tables.items():
        table, _, name = key.rpartition(".")
        if name in FILES and isinstance(one, str) and f"{table}.checksum" not in tables and Path(one).is_file():
            found[f"contents of {key}"] = checksum_of(Path(one))
    return found


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
        return file_contents(self.tables)

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

    def unit_of(self, key: str) -> str:
        """See `Subject`."""
        return unit_of_key(key, self.case.model_dump(mode="json"))

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
        return seated(self.model) if number == 0 else kicked(self.model, self.case.load, number, seed)

    def carried(self, end: State, before: CaseSubject) -> Start:
        """See `Subject`."""
        return carried(self.model, self.case.load, end, before.case.load)

    def respond(self, begin: Start, rings: bool) -> TrialResponse:
        """See `Subject`."""
        model = self.model
        interval = self.case.output.history_interval or model.step
        statistics = statistics_of_response(self.case, model, interval)
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


def statistics_of_response(case: Case, model: Model, interval: float) -> RunStatistics | None:
    """Return the statistics to gather of a response; None where it is no transient.

    A response to a periodic force may turn out chaotic: its statistics are gathered, too. Its force holds it up, so
    that the damping of the beam is no time that its motion remembers.

    Args:
        case: The case.
        model: Its model.
        interval: Time between records, s.
    """
    if not isinstance(case.analysis, Transient):
        return None
    every = max(1, round(interval / model.step))
    return statistics_of(case, model, every) or gathered_statistics(case, model, every)


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


KEPT = ("structure", "point", "joint", "mass")
"""Tables that a state depends on, beside the ends of pairs and the types of feedback."""
KEPT_PARTS = ("between", "region.type", "type", "span.structure", "points", "modes", "law.type")
LINEAR = ("kelvin-voigt",)
FLAT = ("HalfPlane", "Slot")
SAMPLES = 200  # of a period of the forcing, or of the run


class SceneSubject:
    """A file of structures; a `Subject`.

    Args:
        file: Its checked tables.
    """

    carried_keys = "the clearance or stiffness of a pair, the velocity of a flow, load.NAME.amplitude or .frequency"

    def __init__(self, file: SceneFile) -> None:
        self.file, self.case = file, file.case

    @cached_property
    def read(self) -> ReadScene:
        """The file with its scene.

        Raises:
            CaseError: A structure cannot be read, or parts do not fit.
        """
        return self.file.read()

    @property
    def scene(self) -> Scene:
        """The scene."""
        return self.read.scene

    def with_other_noise(self, number: int) -> SceneSubject:
        """Return the subject with noise independent of this one, another for each number; all else is shared."""
        if not self.is_random or number == 0:
            return self
        loads = tuple(load.with_other_noise(number) for load in self.case.load)
        given, read = (one.model_copy(update={"load": loads}) for one in (self.case, self.read.case))
        other = SceneSubject(replace(self.file, case=given))
        other.read = replace(self.read, case=read, scene=with_noise(self.scene, loads), finer=None)
        return other

    def in_scene(self, scene: Scene) -> SceneSubject:
        """Return the subject with another scene of the same structures."""
        other = SceneSubject(self.file)
        other.read = replace(self.read, scene=scene, finer=None)
        return other

    @property
    def tables(self) -> dict[str, Any]:
        """See `Subject`."""
        return flat(self.case.model_dump(mode="json")) | dict(self.file.changes)

    @property
    def contents(self) -> dict[str, Any]:
        """See `Subject`."""
        return file_contents(self.tables)

    @property
    def state_keys(self) -> dict[str, Any]:
        """See `Subject`."""
        return {
            key: value
            for key, value in self.tables.items()
            if key.partition(".")[0] in KEPT or (key.startswith(("pair.", "feedback.")) and key.endswith(KEPT_PARTS))
        }

    @property
    def figures(self) -> Sequence[Figure]:
        """See `Subject`."""
        return self.read.case.figure

    @property
    def is_random(self) -> bool:
        """See `Subject`."""
        return any(load.noise for load in self.case.load)

    @property
    def moves_by_itself(self) -> bool:
        """See `Subject`."""
        return bool(self.scene.feedbacks)

    @property
    def frequency(self) -> float | None:
        """See `Subject`."""
        return self._span[1]

    @property
    def window(self) -> float:
        """See `Subject`."""
        return float(smoothing_of(self.asked, self.case.time.end)["window"])

    @cached_property
    def asked(self) -> SceneRun:
        """The run that its file asks for."""
        return SceneRun(self.scene, **self.read.march())

    @property
    def _span(self) -> tuple[int, float | None]:
        return whole_steps(forcing_frequencies(self.case.load), self.case.time.end, self.read.step)

    def unit_of(self, key: str) -> str:
        """See `Subject`."""
        return self.file.unit_of(key)

    def refuse(self) -> None:
        """See `Subject`: a file of structures is always a march."""

    def memory_with(self, others: Sequence[SceneSubject]) -> float | None:
        """See `Subject`."""
        del others
        return LIBRARIES + RECORDS

    def start(self, number: int, seed: int) -> Start:
        """See `Subject`."""
        begin, word = self.asked.start or self.scene.state(), self.case.start.state
        if number == 0:
            return Start(begin, word)
        scene, draw = self.scene, np.random.default_rng([seed, number])
        if scene.is_large:
            raise UserError("starts: kicks are in modes; expected reduce = { modes = 40 } in each [[structure]]")
        end = 1.0 / self.frequency if self.frequency else self.case.time.end
        times = np.linspace(0.0, end, SAMPLES, endpoint=False) + max((x.rise_time for x in self.case.load), default=0.0)
        sizes = [float(np.ptp(load.table(times))) / 2.0 for load in scene.loads]
        omega = 2.0 * np.pi * (self.frequency or 1.0 / end)
        soft = 1.0 / (scene.squares + omega**2)[:, None]
        forces = scene.load_columns[:, : len(sizes)] * np.array(sizes)
        energy = 0.5 * float(np.sum(forces * soft * forces))
        if not energy > 0.0:
            raise UserError("starts: kicks have the energy that loads bring, and no load varies; expected starts = 1")
        shapes = soft * np.hstack([forces[:, np.array(sizes) > 0.0], scene.contact_rows.T])
        shapes = shapes / np.sqrt(np.sum(shapes**2, axis=0))
        speed: Array = shapes @ draw.standard_normal(shapes.shape[1])
        speed *= np.sqrt(draw.uniform(0.0, KICK) * energy / (0.5 * float(speed @ speed)))
        steps = drawn_phase(self.case.load, self.read.step, draw)
        if any(one.is_moved for one in scene.contacts) or not all(one.repeats for one in self.case.load):
            steps = 0
        return Start(replace(begin, t=steps * self.read.step, v=begin.v + speed[:, None]), f"kick {number}")

    def carried(self, end: SceneState, before: SceneSubject) -> Start:
        """See `Subject`."""
        scene, step = self.scene, self.read.step
        mine = scene.state()
        for name in ("q", "v", "z", "F"):
            if getattr(mine, name).shape != getattr(end, name).shape:
                raise UserError(
                    f"`carry=True`: found a state with {len(getattr(end, name))} values of {name}, expected "
                    f"{len(getattr(mine, name))} as at this point; choose a key that leaves delays as they are"
                )
        begin, notes = phase_kept(self.case.load, step, end.t, before.case.load)
        deeper = self._depths(end.q, begin) - np.maximum(before._depths(end.q, end.t), 0.0)
        largest = float(deeper.max(initial=0.0))
        if largest > 1e-9 * float(np.abs(scene.offsets).max(initial=0.0)):
            notes.append(f"starts {largest:.3g} m deeper in its contacts than the point before ended: they are closer")
        return Start(replace(end, t=begin), "carried", tuple(notes))

    def _depths(self, q: Array, t: float) -> Array:
        """Return the penetration of each contact, (contacts,), m."""
        places = self.scene.places(q, t).T
        parts = zip(self.scene.contacts, self.scene.first, strict=False)
        found = [one.penetration(places[:, first : first + one.motions])[0][0] for one, first in parts]
        return np.array(found, dtype=float)

    def respond(self, begin: Start, rings: bool) -> TrialResponse:
        """See `Subject`."""
        del rings
        clock, asked = time.perf_counter(), replace(self.asked, start=begin.state)
        response = TrialResponse()
        try:
            marcher = asked.marcher()
            asked.scene.check_feedback(marcher.z, self.case.time.end)
            march = SceneMarch(asked, marcher, self._span[0], asked.limits, Signals(None))
            self._take(march, response)
        except Interrupted:
            raise
        except RunError as error:
            response.failed(error)
        response.seconds = time.perf_counter() - clock
        return response

    def _take(self, march: SceneMarch, response: TrialResponse) -> None:
        """March, and take records, figures and findings into a response.

        Raises:
            RunError: The march did not pass.
        """
        parts, marcher, accounts = list[Any](), march.marcher, march.accounts
        statistics = march.statistics or march.records.statistics(self.figures, is_random=False)
        response.statistics = statistics
        try:
            for rows in march.rows():
                if rows is not None:
                    parts.append(rows)
                    statistics.see(rows)
        finally:
            ledger = accounts.ledger
            scale = ledger.exchanged if ledger.exchanged > 0.0 else np.nan
            response.labels, response.history = march.records.labels, stacked(parts)
            response.steps, response.reached, response.end = marcher.count, marcher.t, marcher.state
            response.created, response.residual = accounts.gates.growth(ledger), ledger.residual / scale
            response.lost = ledger.algorithmic / scale
            response.penetration = float(accounts.depth.max(initial=0.0))
            response.peak_force = float(accounts.force.max(initial=0.0))
            response.iterations = marcher.passes / max(marcher.count, 1)
            response.findings = findings_of(accounts, march.growth)
        march.judge()

    def stays_linear(self, history: xr.Dataset, after: float) -> bool:
        """See `Subject`."""
        linear = all(
            one.law.kind.name in LINEAR and one.region.kind.name in FLAT and not one.is_rough
            for one in self.scene.contacts
        )
        return linear and keeps_contacts(history, after)

    def packed(self, end: SceneState) -> dict[str, Array]:
        """See `Subject`."""
        names = [name for name, value in vars(end).items() if value is not None]
        arrays = {name: np.asarray(getattr(end, name)) for name in names}
        return arrays | {"places": self.scene.places(end.q, end.t)}

    def unpacked(self, arrays: Mapping[str, Any]) -> SceneState | None:
        """See `Subject`."""
        known = {name: arrays[name] for name in arrays if name not in ("places", "t")}
        state = SceneState(float(arrays["t"]), **known)
        return state if same_places(self.scene.places(state.q, state.t), arrays["places"]) else None
