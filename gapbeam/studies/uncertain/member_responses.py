"""Members with values of their own: the response that each comes to, and its figures.

Answers are kept on disk: a study that was killed continues where it was, to the same bits.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from math import log2
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.scene.argument_checks import finite, period_at, reals
from gapbeam.solver.scene.ensemble_members import EnsembleFolder, Members
from gapbeam.solver.scene.linear_scheme import LinearScheme
from gapbeam.solver.scene.recorded_places import turning_places
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.schema.record_table import TURNING, faces_of, unit_where
from gapbeam.solver.system.operators import Array
from gapbeam.studies.atlas.response_search import CHAOTIC, FAILED, UNSETTLED, FoundOrbit, ResponseSearch, repeating

START = "start"
"""Input that draws one of several starts."""
WORDS = {CHAOTIC: "chaotic", UNSETTLED: "unsettled", FAILED: "failed"}
UNKNOWN = ("unsettled", "failed")
Period = float | Callable[[dict[str, float]], float]


@dataclass(frozen=True, eq=False)
class Answers:
    """Responses and figures of members.

    Attributes:
        response: The name of the response of each member, (members,).
        figures: Figures by name, (members,); NaN where a member failed or did not settle.
    """

    response: Any
    figures: dict[str, Array]

    def figure(self, name: str) -> Array:
        """Return a figure, (members,); NaN where no member settled, so that none has it."""
        return self.figures.get(name, np.full(len(self.response), np.nan))


@dataclass(frozen=True, eq=False)
class SceneModel:
    """A scene under loads that repeat, as a function from values to responses and figures.

    Attributes:
        scene: Scene that all members share.
        period: Period of the loads, s; or a function of the values by path.
        starts: One state, or lanes of which the input "start" takes one.
        steps: Steps in a period.
        settle: Periods before responses are looked for.
        rounds: Marches of so many periods at most.
        orders: Highest number of periods after which a response may repeat.
        measure: Periods over which figures are taken, or the next multiple of the order.
        exponents: Periods over which exponents are taken.
        scheme: Scheme of the time integration.
        threads: As of `ensemble`.
        figures: Figures of one's own.
    """

    scene: Scene
    period: Period
    starts: SceneState
    steps: int
    settle: int
    rounds: int
    orders: int
    measure: int
    exponents: int
    scheme: LinearScheme
    threads: int | None
    figures: tuple[Figure, ...] = ()

    @property
    def block(self) -> int:
        """Members that march together."""
        return members_of_block(self.scene, self.steps * (self.settle + self.measure + self.exponents))

    def __call__(self, values: dict[str, Array]) -> Answers:
        """March members, distinguish their responses by shooting, and take their figures.

        Raises:
            UserError: The scene does not take a value that was drawn, or loads do not repeat after the period.
        """
        count = len(next(iter(values.values())))
        own = {path: value for path, value in values.items() if path != START}
        try:
            self.scene.with_(own)
            self._check_signs(own)
        except UserError as fault:
            raise UserError(
                f"{fault}\nuncertain: a drawn value is out of range, or a path is unknown; end a distribution where "
                "the scene does, such as scipy.stats.truncnorm"
            ) from fault
        which = values[START].astype(int) if START in values else np.zeros(count, dtype=int)
        lanes = lanes_of(self.starts, which)
        every = [{path: float(value[i]) for path, value in own.items()} for i in range(count)]
        T = finite([period_at(self.period, one, "uncertain") for one in every], "uncertain: period")
        strobe = repeating(self.scene, own, T, lanes, self.steps, self.scheme, self.threads)
        search = ResponseSearch(strobe, 1, lanes.x, self.settle, self.rounds, self.orders, self.exponents)
        search.run()
        return self._measured(search)

    def _check_signs(self, own: dict[str, Array]) -> None:
        """Refuse parameters of a law that change their sign: a stiffness below 0 pulls."""
        for path, value in own.items():
            name, _, key = path.partition(".")
            for one in self.scene.contacts:
                if one.name and fnmatchcase(one.name, name) and key in one.law.kind.names:
                    before = float(np.ravel(one.law.values[one.law.kind.names.index(key)])[0])
                    if before > 0.0 and value.min() < 0.0:
                        raise UserError(
                            f"{path!r}: found {value.min():.6g}, {before:.6g} in the scene; expected its sign"
                        )

    def _measured(self, search: ResponseSearch) -> Answers:
        """March each kind of members over whole orbits, periodic ones from their orbit."""
        count = len(search.which)
        names, order, X = np.empty(count, dtype=object), np.zeros(count, dtype=int), search.X.copy()
        for i, which in enumerate(search.which):
            if which >= 0:
                one = search.found[which]
                names[i], order[i] = name_of(one), max(one.order, 1)
                X[:, i] = X[:, i] if one.frequencies else one.orbit.x
            else:
                names[i], order[i] = WORDS[which], 1 if which == CHAOTIC else 0
        figures: dict[str, Array] = {}
        for n in np.unique(order[order > 0]):
            mine = np.flatnonzero(order == n)
            many = search.strobe.march(mine, X[:, mine], int(n) * -(-self.measure // int(n)), figures=self.figures)
            names[mine[many.failed]] = WORDS[FAILED]
            for name, value in figures_of(many).items():
                figures.setdefault(name, np.full(count, np.nan))[mine] = value
        return Answers(names, figures)


class CalledModel:
    """A function of values as a model: its members have one response, "all", or "failed" where a figure is missing.

    Args:
        function: Returns figures by name, (members,), at values by path, (members,).
    """

    def __init__(self, function: Callable[[dict[str, Array]], Mapping[str, Any]]) -> None:
        self.function = function

    def __call__(self, values: dict[str, Array]) -> Answers:
        """Return figures.

        Raises:
            UserError: The function returns something else.
        """
        count = len(next(iter(values.values())))
        try:
            figures = self.function(values)
        except UserError:
            raise
        except Exception as error:
            raise UserError(f"uncertain: the function failed ({type(error).__name__}: {error})") from error
        if not isinstance(figures, Mapping) or not figures:
            raise UserError(f"uncertain: the function returned {type(figures).__name__}, expected figures by name")
        found = {}
        for name, value in figures.items():
            found[name] = reals(value, f"uncertain: the function returned figure {name!r}")
            if found[name].shape != (count,):
                raise UserError(
                    f"uncertain: the function returned figure {name!r} of shape {found[name].shape} for {count} "
                    "members; expected one number for each"
                )
        whole = np.all([np.isfinite(value) for value in found.values()], axis=0)
        return Answers(np.where(whole, "all", WORDS[FAILED]).astype(object), found)


def name_of(one: FoundOrbit) -> str:
    """Return the name of a response: its order, and its impacts at each contact over the orbit.

    Of a face with several contact points, only whether it is touched: their impacts depend on the mesh.
    """
    if one.frequencies:
        return "two frequencies"
    parts = []
    for face, contacts in faces_of(one.impacts).items():
        hits = round(one.impacts[contacts[0]] * one.order)
        if len(contacts) == 1 and hits:
            parts.append(f"{face} {hits}")
        elif any(one.peak_force[contact] > 0.0 for contact in contacts):
            parts.append(f"{face} touched" if len(contacts) > 1 else f"{face} closed")
    return f"order {one.order}: {', '.join(parts) or 'no contact'}"


def figures_of(many: Members) -> dict[str, Array]:
    """Return figures of members by name.

    "peak/tip" and "rms/tip", m, by point; by contact "peak_force/stop" and "mean_force/stop", N, "impact_rate/stop",
    1/s, "work_rate/stop", W, and "closed/stop", the share of time in contact. A face with several contact points has
    those of all its points together. Figures of one's own by their name.
    """
    found: dict[str, Array] = dict(many.figures)
    for kind, table in (("peak", many.peak), ("rms", many.rms)):
        for point, value in table.items():
            rows = value[None] if value.ndim == 1 else value
            names = [f"{kind}/{point}"] if len(rows) == 1 else [f"{kind}/{point}.{i + 1}" for i in range(len(rows))]
            found |= dict(zip(names, rows, strict=True))
    for kind, each, per in (
        ("peak_force", many.peak_force, 1.0), ("mean_force", many.impulse, many.span),
        ("impact_rate", many.impacts, many.span), ("work_rate", many.work, many.span),
        ("closed", many.closed, many.span),
    ):  # fmt: skip
        for face, contacts in faces_of(each).items():
            whole = each[face] if face in each else np.sum([each[contact] for contact in contacts], axis=0)
            found[f"{kind}/{face}"] = np.asarray(whole / per, dtype=float)
    return found


OF_CONTACTS = {"peak_force": "N", "mean_force": "N", "impact_rate": "1/s", "work_rate": "W", "closed": ""}


def figure_units(scene: Scene, figures: Iterable[Figure]) -> dict[str, str]:
    """Return the SI units of all figures of members of a scene by name, as `figures_of` names them.

    Args:
        scene: Scene of all members.
        figures: Figures of one's own.
    """
    turning = turning_places(scene)
    found = {one.name: one.unit_in({TURNING: turning}).removeprefix("1") for one in figures}
    for kind in ("peak", "rms"):
        for point, one in scene.point_names.items():
            count = len(one.rows)
            unit = unit_where("m", point in turning)
            found |= {f"{kind}/{point}" + (f".{i + 1}" if count > 1 else ""): unit for i in range(count)}
    faces = faces_of(dict.fromkeys(one.name or i for i, one in enumerate(scene.contacts)))
    for kind, unit in OF_CONTACTS.items():
        found |= {f"{kind}/{face}": unit_where(unit, face in turning) for face in faces}
    return found


BLOCK = 1024
"""Members that march together at most: memory stays bounded, and so does what an interruption loses."""
LEAST_BLOCK = 64
WORK = 1.0e10
"""Products of a block, some 20 s of one core: progress is seen, and an interruption loses no more."""
OTHER_WORK = 30
"""Work of a step beside the products of modes and contact motions."""


def lanes_of(starts: SceneState, which: Array) -> SceneState:
    """Return the starts with these numbers, one a lane."""
    whole = starts.spread(starts.q.shape[1])
    return SceneState(starts.t, *(one[:, which] for one in (whole.q, whole.v, whole.z, whole.F)))


def members_of_block(scene: Scene, steps: int) -> int:
    """Return the number of members that march together, a power of two: fewer where steps of one take long.

    Args:
        scene: Scene of all members.
        steps: Steps of a member.
    """
    most = WORK / (max(steps, 1) * (OTHER_WORK + scene.contact_rows.size))
    return min(max(LEAST_BLOCK, 1 << int(log2(max(most, 1.0)))), BLOCK)


KEPT = "kept"


class KeptAnswers:
    """A model whose answers are computed in blocks, and kept in a folder if there is one.

    Args:
        model: Returns answers at values by path.
        folder: Folder of the study; None keeps nothing.
        key: Hash of the model.
        progress: Called with the number of members that are done.

    Raises:
        UserError: The folder has another study.
        NotWritten: The folder takes no file.
    """

    def __init__(
        self, model: Callable[[dict[str, Array]], Answers], folder: Path | None, key: str | None,
        progress: Callable[[int], None] | None = None,
    ) -> None:  # fmt: skip
        self.model, self.progress, self.done = model, progress, 0
        self.size = int(getattr(model, "block", BLOCK))
        self.folder = None if folder is None else EnsembleFolder(folder / KEPT, str(key))

    def __call__(self, values: dict[str, Array]) -> Answers:
        """Return the answers at values, (members,) by path."""
        count = len(next(iter(values.values())))
        parts = []
        if self.progress is not None and not self.done:
            self.progress(0)
        for first in range(0, count, self.size):
            parts.append(self.block({path: value[first : first + self.size] for path, value in values.items()}))
            self.done += len(parts[-1].response)
            if self.progress is not None:
                self.progress(self.done)
        names = list(dict.fromkeys(name for part in parts for name in part.figures))
        missing = [np.full(len(part.response), np.nan) for part in parts]
        figures = {
            name: np.concatenate([part.figures.get(name, none) for part, none in zip(parts, missing, strict=True)])
            for name in names
        }
        return Answers(np.concatenate([part.response for part in parts]), figures)

    def block(self, values: dict[str, Array]) -> Answers:
        """Return the answers of a block, from disk where they are there."""
        if self.folder is None:
            return self.model(values)
        digest = hashlib.sha256(repr(list(values)).encode())
        for value in values.values():
            digest.update(np.ascontiguousarray(value).tobytes())
        name = f"{digest.hexdigest()[:24]}.npz"
        kept = self.folder.read(name)
        if kept is not None:
            figures = {key[2:]: value for key, value in kept.items() if key.startswith("f/")}
            return Answers(kept["response"].astype(object), figures)
        found = self.model(values)
        arrays_: dict[str, Any] = {f"f/{key}": value for key, value in found.figures.items()}
        self.folder.write(name, lambda file: np.savez(file, response=found.response.astype(str), **arrays_))
        return found
