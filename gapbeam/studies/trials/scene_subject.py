"""A file of structures as the subject of a study: its scene, starts, responses and the statistics that they have.

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

from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.case.reading.known_keys import flat
from gapbeam.solver.messages.errors import Interrupted, RunError, UserError
from gapbeam.solver.run.checkpoint.same_model import checksum_of
from gapbeam.solver.run.interruption import Signals
from gapbeam.solver.run.scene_run import SceneMarch, SceneRun, smoothing_of
from gapbeam.solver.run.scene_summary import findings_of
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.scene.scene_march import marcher_of
from gapbeam.solver.scene_file.scene_builder import with_noise
from gapbeam.solver.scene_file.scene_checks import FILES
from gapbeam.solver.scene_file.scene_reader import ReadScene, SceneFile
from gapbeam.solver.system.operators import Array
from gapbeam.studies.engine.worker_memory import LIBRARIES, RECORDS
from gapbeam.studies.trials.case_subject import keeps_contacts, same_places
from gapbeam.studies.trials.response import TrialResponse, stacked
from gapbeam.studies.trials.starts import KICK, Start, drawn_phase, phase_kept, whole_steps

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
        case = self.case.model_copy(update={"load": loads})
        other = SceneSubject(replace(self.file, case=case))
        other.read = replace(self.read, case=case, scene=with_noise(self.scene, loads))
        return other

    def in_scene(self, scene: Scene) -> SceneSubject:
        """Return the subject with another scene of the same structures."""
        other = SceneSubject(self.file)
        other.read = replace(self.read, scene=scene)
        return other

    @property
    def tables(self) -> dict[str, Any]:
        """See `Subject`."""
        return flat(self.case.model_dump(mode="json")) | dict(self.file.changes)

    @property
    def contents(self) -> dict[str, Any]:
        """See `Subject`."""
        files = {key: one for key, one in self.tables.items() if key.rpartition(".")[2] in FILES}
        named = {key: Path(one) for key, one in files.items() if isinstance(one, str)}
        return {f"contents of {key}": checksum_of(path) for key, path in named.items() if path.is_file()}

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
        return self.case.figure

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
        return whole_steps(self.case.load, self.case.time.end, self.read.step)

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
        if any(one.wall is not None for one in scene.contacts) or not all(one.repeats for one in self.case.load):
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
        found = [one.region.penetration(places[:, first : first + one.motions])[0][0] for one, first in parts]
        return np.array(found, dtype=float)

    def respond(self, begin: Start, rings: bool) -> TrialResponse:
        """See `Subject`."""
        del rings
        clock, asked = time.perf_counter(), replace(self.asked, start=begin.state)
        response = TrialResponse()
        try:
            marcher = marcher_of(asked.scene, asked.step, asked.start, asked.scheme)
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
        statistics = march.statistics or march.records.statistics(self.case.figure, is_random=False)
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
            response.findings = findings_of(accounts)
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
