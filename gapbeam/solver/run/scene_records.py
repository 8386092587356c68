"""Records of a scene for `history.h5`, of the same names as those of cases."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from gapbeam.solver.record_table import HISTORY
from gapbeam.solver.run.scene_accounts import ContactBlock, EnergyBlock, SceneAccounts, contacts_of
from gapbeam.solver.scene.condensed_arrays import StepRecords
from gapbeam.solver.scene.feedback import Feedback, outputs_of
from gapbeam.solver.scene.modal_march import Marcher
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.scene_load import BaseMotion
from gapbeam.solver.system.operators import Array

Rows = dict[str, Array]
ABSOLUTE = "acceleration_absolute"
SUMS = ("impulse", "contact_time", "closings", "sliding_work")


def contact_names(scene: Scene) -> tuple[str, ...]:
    """Return a name for each contact: its own, or "contact" with its number."""
    return tuple(one.name or f"contact {number}" for number, one in enumerate(scene.contacts, 1))


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
        counts = [len(point.rows) for point in scene.point_names.values()]
        self.width = 2 if set(counts) == {2} else 1
        self.probes = tuple(
            name if self.width == count else f"{name} {number}"
            for name, count in zip(scene.point_names, counts, strict=True)
            for number in range(1, count // self.width + 1)
        )
        self.frame = self._frame()
        rough = any(one.is_rough for one in scene.contacts)
        named = [(one.name, [some]) for one, some in self._forces() if one.name]
        joints = [some for one, some in self._forces() if not one.name]
        self.fed = named + ([("joints", joints)] if joints else [])
        self.loaded = [self._load_name()] if scene.loads else []
        self.walled = ["moving walls"] if any(one.wall is not None for one in scene.contacts) else []
        self.labels: dict[str, tuple[str, ...]] = {
            "probe": self.probes,
            "component": ("y", "z")[: self.width] if self.probes else (),
            "face": contact_names(scene),
            "tangent": ("across",) if rough else (),
            "worn_face": contact_names(scene) if any(one.motions == 2 for one in scene.contacts) else (),
            "load": (*self.loaded, *(name for name, _ in self.fed), *self.walled),
        }
        unknown = {"contact_moment", "contact_area", "iterations"} | ({ABSOLUTE} if self.frame is None else set())
        self.variables = {record.name for record in HISTORY} - unknown
        self.time = marcher.t
        self.speed: Array = marcher.linear.watch @ marcher.v[:, 0]

    def _forces(self) -> Iterator[tuple[Feedback, slice]]:
        """Yield the feedback with the places of its forces."""
        return zip(self.scene.feedbacks, outputs_of(self.scene.feedbacks), strict=True)

    def _works(self, energies: EnergyBlock) -> Array:
        """Return the work of loads, of each force that follows the motion, and of walls, (records, load), J."""
        fed = [sum(energies.fed[:, some].sum(axis=1) for some in parts) for _, parts in self.fed]
        columns = [energies.work[:, 0]] * len(self.loaded) + fed + [energies.work[:, 2]] * len(self.walled)
        return np.column_stack(columns) if columns else np.zeros((len(energies.work), 0))

    def _load_name(self) -> str:
        names = [one.name for one in self.scene.loads if one.name]
        return names[0] if len(names) == len(self.scene.loads) == 1 else "all loads"

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
        seen = (marcher.linear.watch @ marcher.q).T
        return self._rows(np.array([marcher.t]), seen, self.speed[None], contacts, energies, sums)

    def rows(
        self, count: int, times: Array, kept: StepRecords, contacts: ContactBlock, energies: EnergyBlock,
        sums: dict[str, Array], last: bool,
    ) -> Rows | None:  # fmt: skip
        """Return the records of a block of steps that began after `count` steps; None: there are none.

        Args:
            count: Steps before.
            times: After each step, s.
            kept: Records of the march.
            contacts: The contacts.
            energies: The energies.
            sums: As `SceneAccounts.take` returns them.
            last: Whether the last step of the block is recorded whatever its number.
        """
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
        seen, speeds = kept.seen[chosen, :, 0], kept.speeds[chosen, :, 0]
        return self._rows(times[chosen], seen, speeds, some(contacts), some(energies), picked)

    def _rows(
        self, times: Array, seen: Array, speeds: Array, contacts: ContactBlock, energies: EnergyBlock,
        sums: dict[str, Array],
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
            found |= {"displacement": seen.reshape(shape), "velocity": speeds.reshape(shape)}
            found["acceleration_relative"] = relative.reshape(shape)
            if self.frame is not None:
                found[ABSOLUTE] = (relative + self._of_frame(times, spans)).reshape(shape)
            self.speed = speeds[-1].copy()
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
                    middles = end - self.h * (np.arange(steps)[::-1] + 0.5)
                    found[number] += load.table(middles)[:, 0].mean() * along
        return found
