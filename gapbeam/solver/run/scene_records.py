"""Records of a scene for `history.h5`, of the same names as those of cases, and its accounts at every step.

Accounts are energies, gates, impacts, peaks and contact times.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.case.solution_tables import Gates
from gapbeam.solver.diagnostics.contact_episodes import RESOLVING_STEPS, UNSEEN, ImpactList, approach_speed
from gapbeam.solver.diagnostics.energy_gates import EnergyGates
from gapbeam.solver.diagnostics.energy_ledger import ESTIMATE, ROUND_OFF_SAFETY, Ledger
from gapbeam.solver.diagnostics.statistics.batch_interval import MOST, BlockEnds
from gapbeam.solver.diagnostics.statistics.run_statistics import RecordStatistics
from gapbeam.solver.run.clamp_energies import ClampEnergies
from gapbeam.solver.run.contact_block import ContactBlock, contacts_of
from gapbeam.solver.scene.feedback import Feedback, outputs_of
from gapbeam.solver.scene.flow_margin import eigenvalues
from gapbeam.solver.scene.linear_scheme import LinearScheme, StepRecords
from gapbeam.solver.scene.marcher import TOLERANCE, Marcher
from gapbeam.solver.scene.reaction_rows import ReactionRows
from gapbeam.solver.scene.recorded_places import components_of, gauges_of, struck_places, turning_places
from gapbeam.solver.scene.scene_load import BaseMotion
from gapbeam.solver.scene.step_kernel import DAMPED, KINETIC, LAW, LOADED, RUBBED, STORED, STRAIN, WALLED
from gapbeam.solver.scene.surface_stress import TENSOR, von_mises
from gapbeam.solver.schema.record_table import HISTORY, STRUCK, TURNING
from gapbeam.solver.system.operators import Array
from gapbeam.solver.system.slip_modes import closed_part

PATTERN = re.compile(r"-\d+$")
"""End of the name of a load that is one of several patterns."""
EPS = float(np.finfo(float).eps)


def promises_balance(scheme: LinearScheme) -> bool:
    """Return whether a scheme keeps the energy balance at any step: the midpoint rule with the mean of the law."""
    return scheme.level == 0.5 and scheme.law == 0.0 and not scheme.is_accelerated


@dataclass
class EnergyBlock:
    """Energies after each step of a block, (steps,), J; sums since the start continue from block to block."""

    kinetic: Array
    strain: Array
    contact: Array
    structural: Array
    law: Array
    friction: Array
    work: Array
    fed: Array
    algorithmic: Array
    residual: Array
    created: Array
    exchanged: Array
    round_off: Array


class SceneAccounts:
    """The accounts of a march, kept from its start on.

    Attributes:
        gates: Gates on the energy.
        ledger: Ledger after the last step.
        impacts: Impacts of each contact.
        depth: Largest penetration of each contact, m; negative: its smallest gap.
        force: Largest normal force of a step, N.
        friction: Largest friction force, N.
        impulse: Normal force over time since the start, N s.
        sliding: Work of sliding since the start, J.
        worn: The same at the ends of blocks of steps.
        time: Time in contact since the start, s.
        closings: Since the start.
        square: Square of the normal force over time since the start, N^2 s.
        approaches: Sum of the approach speeds of all impacts since the start, m/s.
        episodes: Contacts with springs that ended; `short` of them lasted fewer than ten steps.
        rate: Velocities of the contact motions, by the midpoint rule, m/s.
        driven: See `ClampEnergies.state`.
    """

    kept = (
        "depth", "force", "friction", "impulse", "time", "closings", "last_depth", "shut", "begun", "speed",
        "opened_at", "steps", "totals", "sliding", "square", "approaches", "rate", "driven",
    )  # fmt: skip

    def __init__(self, marcher: Marcher, gates: Gates, remedy: str) -> None:
        scene, count = marcher.scene, len(marcher.scene.contacts)
        self.scene, self.balanced = scene, promises_balance(marcher.scheme)
        self.clamps = ClampEnergies(scene, marcher.scheme)
        kinetic, strain = (float(one[0]) for one in marcher.inertia())
        moving, bent = self.clamps.begin(marcher)
        kinetic, strain, self.driven = kinetic + moving, strain + bent, self.clamps.state
        stored = float(marcher.ledger[STORED, 0])
        self.ledger = Ledger(kinetic, strain, stored, kinetic + strain + stored, np.zeros(3), largest_kinetic=kinetic)
        self.gates = EnergyGates(gates, None, remedy=remedy)
        start = contacts_of(scene, marcher.y.T.copy(), marcher.F.T.copy())
        self.last_depth = start.depth[0] if count else np.zeros(0)
        self.depth, self.force, self.friction = self.last_depth.copy(), start.force[0].copy(), start.friction[0].copy()
        self.shut = start.closed[0].astype(float)
        self.impulsive = np.array([one.is_impulsive for one in scene.contacts], dtype=bool)
        self.impulse, self.time, self.closings, self.begun = (np.zeros(count) for _ in range(4))
        self.speed, self.opened_at = np.full(count, UNSEEN), np.zeros(count)
        self.steps, self.sliding, self.square, self.approaches = (np.zeros(count) for _ in range(4))
        self.worn = BlockEnds(count, MOST)
        self.totals = np.zeros(8)  # last energies: work, law, friction; sum of squares of round-off; episodes
        self.impacts = [ImpactList() for _ in range(count)]
        self.rate = marcher.rates()[:, 0].copy()
        for i, shut in enumerate(self.shut):
            self.gates.look(i, bool(shut), 0.0, kinetic + strain, 0.0)

    def rates(self, places: Array, before: Array, h: float) -> Array:
        """Return the velocities of the contacts before each step of a block, (steps, motions), and keep the last.

        Args:
            places: Places after each step, (steps, motions), m.
            before: Places before the first step, (motions,), m.
            h: Step, s.
        """
        signs = (-1.0) ** np.arange(1, len(places) + 1)[:, None]
        found = signs * carried(2.0 / h * signs * np.diff(places, axis=0, prepend=before[None]), self.rate)
        rates = np.vstack([self.rate, found[:-1]])
        if len(places):
            self.rate = found[-1].copy()
        return rates

    @property
    def episodes(self) -> dict[str, Any]:
        """Return the contacts that the step does not resolve, for the summary."""
        count, short, impulse, hidden = self.totals[4:8]
        return {
            "episodes": int(count),
            "short_episodes": int(short),
            "short_means_fewer_steps_than": RESOLVING_STEPS,
            "share_of_impulse_in_short_episodes": float(hidden / impulse) if impulse > 0.0 else 0.0,
        }

    def energies(self, times: Array, kept: StepRecords, force: Array) -> EnergyBlock:
        """Return the energies of a block of steps, and bring the ledger to its end."""
        energies, totals, ledger = kept.energies[:, :, 0], self.totals, self.ledger
        scale = energies[:, KINETIC] + energies[:, STRAIN] + energies[:, STORED] + np.abs(energies[:, LOADED])
        self.clamps.follow(times, kept, energies, self.driven)
        kinetic, strain, stored = energies[:, KINETIC], energies[:, STRAIN], energies[:, STORED]
        fed = kept.works[:, :, 0]
        works = np.column_stack([energies[:, LOADED], fed.sum(axis=1), energies[:, WALLED]])
        work, law, friction = works.sum(axis=1), energies[:, LAW], energies[:, RUBBED]
        gained = [np.diff(one, prepend=before) for one, before in zip((work, law, friction), totals, strict=False)]
        absolute = carried(np.abs(gained[0]), ledger.absolute_work)
        gain = carried(np.maximum(-gained[1], 0.0) + np.maximum(-gained[2], 0.0), ledger.contact_gain)
        total = kinetic + strain + stored
        balance = total - ledger.start + energies[:, DAMPED] + law + friction - work
        places = np.abs(kept.places[:, :, 0]).max(axis=1, initial=0.0)
        hidden = (ROUND_OFF_SAFETY * EPS * (scale + np.abs(work))) ** 2
        hidden += (TOLERANCE * places * np.abs(force).sum(axis=1)) ** 2
        squares = carried(hidden, totals[3])
        none = np.zeros(len(total))
        found = EnergyBlock(
            kinetic, strain, stored, energies[:, DAMPED], law, friction, works, fed,
            none if self.balanced else -balance, balance if self.balanced else none, balance + gain,
            absolute + np.maximum.accumulate(np.maximum(kinetic, ledger.largest_kinetic)), np.sqrt(squares),
        )  # fmt: skip
        if len(total):
            totals[:4] = work[-1], law[-1], friction[-1], squares[-1]
            self.ledger = self._ledger(found, len(total) - 1, float(absolute[-1]), float(gain[-1]))
        return found

    def _ledger(self, energies: EnergyBlock, k: int, absolute: float, gain: float) -> Ledger:
        """Return the ledger after step k of a block."""
        exchanged = float(energies.exchanged[k])
        return Ledger(
            float(energies.kinetic[k]), float(energies.strain[k]), float(energies.contact[k]), self.ledger.start,
            energies.work[k].copy(), float(energies.structural[k]), float(energies.law[k]),
            float(energies.algorithmic[k]), exchanged, exchanged - absolute, absolute, float(energies.round_off[k]),
            gain, float(energies.friction[k]),
        )  # fmt: skip

    def pass_gates(self, times: Array, energies: EnergyBlock) -> None:
        """Pass a block of steps, or raise.

        Raises:
            EnergyCreated: More energy was created than the gates allow.
        """
        hidden = np.abs(energies.created) <= ESTIMATE * energies.round_off
        growth = np.where(hidden, 0.0, energies.created) / np.maximum(energies.exchanged, np.finfo(float).tiny)
        bad = np.flatnonzero(growth > self.gates.limits.total_growth)
        if bad.size and not self.gates.limits.accept_energy_growth:
            k = int(bad[0])
            self.gates.let_pass(
                float(times[k]), True, self._ledger(energies, k, self.ledger.absolute_work, self.ledger.contact_gain)
            )

    def take(self, times: Array, h: float, contacts: ContactBlock, energies: EnergyBlock) -> dict[str, Array]:
        """Take in the contacts of a block of steps; return sums since the start after each step, by variable."""
        closed = contacts.closed
        before = np.vstack([self.shut > 0.0, closed[:-1]])
        impulse = carried(h * contacts.force, self.impulse)
        found = {
            "impulse": impulse,
            "contact_time": carried(h * (closed & (before | ~self.impulsive)).astype(float), self.time),
            "closings": carried((closed & ~before).astype(float), self.closings),
            "sliding_work": carried(contacts.rubbed, self.sliding),
            "force_square": carried(h * contacts.force**2, self.square),
        }
        approached = np.zeros_like(contacts.force)
        energy = energies.kinetic + energies.strain
        for k, i in np.argwhere(closed != before):
            depth = float(contacts.depth[k, i])
            earlier = float(contacts.depth[k - 1, i] if k else self.last_depth[i])
            part = 0.5 if self.impulsive[i] else float(closed_part(earlier, depth))
            if closed[k, i]:
                speed = contacts.approach[k, i] if self.impulsive[i] else approach_speed(earlier, depth, h)
                self.speed[i], self.opened_at[i] = speed, times[k] - part * h
                approached[k, i] = self.speed[i]
                self.begun[i] = impulse[k - 1, i] if k else self.impulse[i]
                self.steps[i] = -float(k)
            else:
                steps = self.steps[i] + float(k)
                lasted = float(times[k]) - (1.0 - part) * h - self.opened_at[i]
                lasted = (steps - 1.0) * h if self.impulsive[i] else lasted
                self._end(i, lasted, float(impulse[k, i]), steps)
            self.gates.look(int(i), bool(closed[k, i]), energies.created[k], energy[k], energies.round_off[k])
        found["approach_speeds"] = carried(approached, self.approaches)
        if len(times):
            self.square, self.approaches = (found[name][-1].copy() for name in ("force_square", "approach_speeds"))
            self.steps += np.where(closed[-1], float(len(times)), 0.0)
            self.last_depth, self.impulse = contacts.depth[-1].copy(), impulse[-1].copy()
            self.shut = closed[-1].astype(float)
            self.time, self.closings = found["contact_time"][-1].copy(), found["closings"][-1].copy()
            self.sliding = found["sliding_work"][-1].copy()
            self.worn.add(found["sliding_work"])
            for name in ("depth", "force", "friction"):
                setattr(self, name, np.maximum(getattr(self, name), getattr(contacts, name).max(axis=0)))
        return found

    def _end(self, i: int, lasted: float, impulse: float, steps: float) -> None:
        """End the contact of a place: an impact, if its beginning was seen."""
        if self.speed[i] != UNSEEN:
            gained = impulse - self.begun[i]
            if not self.impulsive[i]:
                short = steps < RESOLVING_STEPS
                self.totals[4:8] += 1.0, float(short), gained, gained * short
            row = [self.opened_at[i], self.speed[i], gained, lasted]
            self.impacts[i].add(np.array([row]))
        self.speed[i], self.steps[i] = UNSEEN, 0.0


def carried(values: Array, before: Any) -> Array:
    """Return running sums that continue from a value, step by step: the same bits however a march is cut in blocks."""
    return np.cumsum(np.concatenate([np.reshape(before, (1, *values.shape[1:])), values]), axis=0)[1:]


Rows = dict[str, Array]
ABSOLUTE = "acceleration_absolute"
SUMS = ("impulse", "contact_time", "closings", "sliding_work", "force_square", "approach_speeds")


class SceneRecords:
    """Turns blocks of steps into records.

    A point of two motions has the components y and z, in the order of its rows, a point of one motion has y. Where a
    scene has both, each motion of a point is a probe of its own, "tip 1" and "tip 2".

    Attributes:
        labels: Names along the dimensions of the history.
        variables: Names of the variables.
    """

    def __init__(self, marcher: Marcher, every: int) -> None:
        scene = marcher.scene
        self.scene, self.every, self.h = scene, every, marcher.h
        self.width, self.probes = scene.probe_width, scene.probe_names
        self.frame, self.gauges, self.reactions = self._frame(), tuple(gauges_of(scene)), ReactionRows(scene)
        rough = any(one.is_rough for one in scene.contacts)
        named = [(one.name, [some]) for one, some in self._forces() if one.name]
        joints = [some for one, some in self._forces() if not one.name]
        self.fed = named + ([("joints", joints)] if joints else [])
        self.loaded = [self._load_name()] if scene.loads else []
        self.walled = ["moving walls"] if any(one.is_moved for one in scene.contacts) else []
        self.labels: dict[str, tuple[str, ...]] = {
            "probe": self.probes,
            "component": components_of(scene),
            "gauge": self.gauges,
            "joint": self.reactions.names,
            "translation": self.reactions.axes,
            "turn": self.reactions.axes,
            "face": scene.contact_names,
            "tangent": ("across",) if rough else (),
            "worn_face": scene.contact_names if any(one.region.motions > 1 for one in scene.contacts) else (),
            "load": (*self.loaded, *(name for name, _ in self.fed), *self.walled),
            TURNING: turning_places(scene),
            STRUCK: struck_places(scene, self.reactions),
        }
        unknown = {"contact_moment", "contact_area", "iterations"} | ({ABSOLUTE} if self.frame is None else set())
        self.variables = {record.name for record in HISTORY} - unknown
        self.time = marcher.t
        self.seen = scene.watched + TENSOR * len(self.gauges)
        self.held = self.reactions.motion_in(marcher.q[:, 0], marcher.v[:, 0])
        self.speed: Array = marcher.linear.watch[: scene.watched] @ marcher.v[:, 0]

    def _forces(self) -> Iterator[tuple[Feedback, slice]]:
        """Yield the feedback with the places of its forces."""
        return zip(self.scene.feedbacks, outputs_of(self.scene.feedbacks), strict=True)

    def _works(self, energies: EnergyBlock) -> Array:
        """Return the work of loads, of each force that follows the motion, and of walls, (records, load), J."""
        fed = [sum(energies.fed[:, some].sum(axis=1) for some in parts) for _, parts in self.fed]
        columns = [energies.work[:, 0]] * len(self.loaded) + fed + [energies.work[:, 2]] * len(self.walled)
        return np.column_stack(columns) if columns else np.zeros((len(energies.work), 0))

    def statistics(self, own: Sequence[Figure], is_random: bool) -> RecordStatistics:
        """Return the statistics to gather of the records.

        Args:
            own: Figures of one's own; those with intervals are among them.
            is_random: Whether loads are random: then a motion remembers as long as its slowest linear vibration does.
        """
        scene = self.scene
        growth = float(eigenvalues(scene)[0].real) if is_random and not scene.is_large else 0.0
        return RecordStatistics(
            scene.contact_names, scene.probe_names, self.width == 2, self.every * self.h,
            -0.5 / growth if growth < 0.0 else 0.0, any(one.region.motions > 1 for one in scene.contacts),
            tuple(one for one in own if one.is_sampled), self.labels,
        )  # fmt: skip

    def _load_name(self) -> str:
        names = {one.name for one in self.scene.loads}
        stems = {PATTERN.sub("", name) for name in names} if len(self.scene.loads) > 1 else names
        return stems.pop() or "all loads" if len(stems) == 1 else "all loads"

    def _frame(self) -> list[tuple[BaseMotion, Array]] | None:
        """Return the motion of all watched motions with the frame for each base motion; None: not known."""
        found = []
        for load in self.scene.loads:
            if not isinstance(load, BaseMotion):
                continue
            place, parts = self.scene.place_of(load.structure, "base motion"), list[Array]()
            for point in self.scene.point_names.values():
                still = point.structure is not self.scene.structures[place]
                moved = np.zeros(len(point.rows)) if still else load.motion_of(point)
                if moved is None:
                    return None
                parts.append(moved)
            found.append((load, np.concatenate([np.zeros(0), *parts])))
        return found

    def first(self, marcher: Marcher, accounts: SceneAccounts) -> Rows:
        """Return the record at the start."""
        contacts = contacts_of(self.scene, marcher.y.T, marcher.F.T)
        ledger, none = accounts.ledger, np.zeros(1)
        kinetic, strain, contact = (np.array([one]) for one in (ledger.kinetic, ledger.strain, ledger.contact))
        work, fed = np.zeros((1, 3)), np.zeros((1, len(marcher.worked)))
        energies = EnergyBlock(kinetic, strain, contact, none, none, none, work, fed, none, none, none, none, none)
        sums: Rows = {name: np.zeros((1, len(self.scene.contacts))) for name in SUMS}
        seen = (marcher.linear.watch[: self.seen] @ marcher.q).T
        held = self.reactions.at_rest(marcher.t, self.held[:1])
        return self._rows(np.array([marcher.t]), seen, self.speed[None], contacts, energies, sums, held)

    def rows(
        self, count: int, times: Array, kept: StepRecords, contacts: ContactBlock, energies: EnergyBlock,
        sums: dict[str, Array], last: bool,
    ) -> Rows | None:  # fmt: skip
        """Return the records of a block of steps that began after `count` steps; None: there are none.

        Args:
            count: Steps before.
            times: Time after each step, s.
            kept: Records of the march.
            contacts: The contacts.
            energies: The energies.
            sums: As `SceneAccounts.take` returns them.
            last: Whether the last step of the block is recorded whatever its number.
        """
        at = slice(self.seen, self.seen + len(self.reactions.rows))
        held, moved = self.held, np.array([kept.seen[:, at, 0], kept.speeds[:, at, 0]])
        if len(times):
            self.held = moved[:, -1]
        numbers = count + 1 + np.arange(len(times))
        chosen = numbers % self.every == 0
        if last and len(chosen):
            chosen[-1] = True
        if not chosen.any():
            return None

        def some(block: Any) -> Any:
            parts = {name: values[chosen] for name, values in vars(block).items()}
            return type(block)(**parts)

        picked = {name: values[chosen] for name, values in sums.items()}
        seen, speeds = kept.seen[chosen, : self.seen, 0], kept.speeds[chosen, : self.scene.watched, 0]
        forces = self.reactions.over_steps(times, self.h, held, moved[0], moved[1], chosen)
        return self._rows(times[chosen], seen, speeds, some(contacts), some(energies), picked, forces)

    def _rows(
        self, times: Array, seen: Array, speeds: Array, contacts: ContactBlock, energies: EnergyBlock,
        sums: dict[str, Array], held: Array,
    ) -> Rows:  # fmt: skip
        shape = len(times), len(self.probes), self.width
        found: Rows = {
            "time": times, "contact_force": contacts.force, "penetration": contacts.depth,
            "active_points": (contacts.force > 0.0).astype(float), "kinetic_energy": energies.kinetic,
            "strain_energy": energies.strain, "restraint_energy": np.zeros(len(times)),
            "contact_energy": energies.contact, "load_work": self._works(energies),
            "structural_dissipation": energies.structural,
            "contact_dissipation": energies.law, "friction_dissipation": energies.friction,
            "algorithmic_dissipation": energies.algorithmic, "energy_residual": energies.residual, **sums,
        }  # fmt: skip
        if not self.labels["worn_face"]:
            del found["sliding_work"]
        if self.labels["tangent"]:
            found["friction_force"] = contacts.friction[:, :, None]
        if self.probes:
            gained = np.diff(speeds, axis=0, prepend=self.speed[None])
            spans = np.diff(times, prepend=self.time)
            relative = gained / np.where(spans > 0.0, spans, 1.0)[:, None]
            motions = seen[:, : self.scene.watched]
            found |= {"displacement": motions.reshape(shape), "velocity": speeds.reshape(shape)}
            found["acceleration_relative"] = relative.reshape(shape)
            if self.frame is not None:
                found[ABSOLUTE] = (relative + self._of_frame(times, spans)).reshape(shape)
            self.speed = speeds[-1].copy()
        if self.gauges:
            stress = seen[:, self.scene.watched :].reshape(len(times), -1, TENSOR)
            found |= {"axial_stress": stress[:, :, 0], "von_mises_stress": von_mises(stress)}
        if self.reactions.names:
            found |= {"joint_force": held[:, :, :3], "joint_moment": held[:, :, 3:]}
        self.time = float(times[-1])
        return found

    def _of_frame(self, times: Array, spans: Array) -> Array:
        """Return the mean accelerations of the frame at the watched motions in the intervals that end at times."""
        found = np.zeros((len(times), len(self.speed)))
        assert self.frame is not None
        for load, along in self.frame:
            for number, (end, span) in enumerate(zip(times, spans, strict=True)):
                steps = round(span / self.h)
                if steps:
                    ends = end - self.h * np.arange(steps, -1, -1)
                    found[number] += load.over_steps(ends)[:, 0].mean() * along
        return found
