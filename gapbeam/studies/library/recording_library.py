"""A library of members of a scene: values, features of their motion at a point, and the regression on them."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table
from scipy.stats import norm, qmc, randint, uniform

from gapbeam.postprocess.report.sections.atlas_section import LIBRARY_FILE
from gapbeam.solver.case.figure_table import Figure
from gapbeam.solver.messages.errors import UserError
from gapbeam.solver.messages.wording import LOG, counted
from gapbeam.solver.run.output.results_folder import write_beside
from gapbeam.solver.scene.argument_checks import checked, positive
from gapbeam.solver.scene.ensemble_members import arrays_in, ensemble_key, response_figure_faults
from gapbeam.solver.scene.lane_ensemble import ensemble
from gapbeam.solver.scene.linear_scheme import MIDPOINT, LinearScheme
from gapbeam.solver.scene.recorded_places import units_of_values
from gapbeam.solver.scene.scene import Scene, SceneState
from gapbeam.solver.scene.touch_kernel import WIDTH
from gapbeam.solver.system.operators import Array
from gapbeam.studies.library.calibrated_regression import Regression, regression
from gapbeam.studies.library.recording import QUANTITIES, FeatureKind, Quantity, lines_of
from gapbeam.studies.printed_results import PrintedResult, table_of
from gapbeam.studies.study_folder import study_written
from gapbeam.studies.uncertain.member_responses import START, Answers, KeptAnswers, lanes_of, members_of_block
from gapbeam.studies.uncertain.probability import NEVER_ONE, inputs_of

NOISE, KEPT_WORD, FAILED_WORD, OWN, CHANGE = "noise", "kept", "failed", "figure/", "change"
LANES = 4 * WIDTH
"""Members whose histories are in memory together."""
FEWEST, MOST = 256, 16384
KEPT_SAMPLES = 8
"""Samples of members in a period of the highest harmonic: displacements above 7 times its frequency are aliased."""
SHARED, LEAST = 64, 8
"""Fewest damping factors among the members, and fewest members that share one: with 8 of them, one held out, half of
the intervals held."""
HELD = 8
"""One group of members that share a damping factor in so many is held out, and marched in steps finer by so much."""
ARRAYS = "library.npz"
FEW = 0.05
"""Share of members that may change, such as chaotic ones, without a warning."""


@dataclass(frozen=True, repr=False, eq=False)
class Library(PrintedResult):
    """Members of a scene, and an estimator of their values from features of a recording.

    Attributes:
        paths: Paths of the unknown values, then figures of one's own by name.
        grid: Quantiles of each at probabilities 0, 1/1000, ..., 1, (paths, 1001); of figures among the members.
        point: Point whose motion is recorded.
        quantity: "displacement", "velocity" or "acceleration".
        period: Period of the loads, s.
        kind: Features.
        members: Members that have features; the others failed.
        failed: Members that failed.
        regression: Regression of the positions of values in their ranges, from 0 to 1.
        units: SI units by path, as far as they are known.
        changing: Share of members whose harmonics of the load differ between the halves of their records by more than
            the largest noise does, if white: they have not settled, or never repeat.
    """

    paths: tuple[str, ...]
    grid: Array
    point: str
    quantity: Quantity
    period: float
    kind: FeatureKind
    members: int
    failed: int
    regression: Regression
    units: Mapping[str, str] = field(default_factory=dict)
    changing: float = 0.0

    @property
    def doubt(self) -> str:
        """Words on members that change; "": they are few."""
        if self.changing <= FEW:
            return ""
        return (
            f"{self.changing:.0%} of the members change within their records by more than noise of "
            f"{self.kind.noise:.2g} does: they have not settled, or never repeat; try more settle"
        )

    def values_at(self, u: Array) -> Array:
        """Return values at positions in their ranges, (..., paths), of all paths or the first."""
        p = np.linspace(0.0, 1.0, self.grid.shape[1])
        return np.stack([np.interp(u[..., i], p, self.grid[i]) for i in range(u.shape[-1])], axis=-1)

    def rows(self) -> list[tuple[str, float, float, float, float]]:
        """Return path, range and relative errors of members held out: the median, and the largest of 19 in 20."""
        true, found = map(self.values_at, self.regression.held)
        error = np.abs(found / np.where(true == 0.0, 1.0, true) - 1.0)
        return [
            (path, row[0], row[-1], *map(float, np.quantile(error[:, i], [0.5, 0.95])))
            for i, (path, row) in enumerate(zip(self.paths, self.grid, strict=True))
        ]

    def headline(self) -> str:
        """Return the library in one line."""
        lost = f"; {self.failed} failed" if self.failed else ""
        parts = (f"{path} to {median:.2g}" for path, _, _, median, _ in self.rows())
        found = (
            f"{counted(self.members, 'member')}{lost}; median relative error of members held out: {', '.join(parts)}"
        )
        return f"{found}; {self.doubt}" if self.doubt else found

    def tables(self) -> list[Table]:
        """Return the tables of the errors of members held out."""
        heads = ("value", "unit", "from", "to", "median relative error", "19 of 20 below")
        return [table_of(heads, ((path, self.units.get(path), *numbers) for path, *numbers in self.rows()))]


@dataclass(frozen=True, eq=False)
class _Members:
    """Features of members at values by path, and figures of one's own."""

    scene: Scene
    point: str
    order: int
    period: float
    steps: int
    settle: int
    kind: FeatureKind
    starts: SceneState
    scheme: LinearScheme
    threads: int | None
    figures: tuple[Figure, ...]

    @property
    def block(self) -> int:
        """Members that march together."""
        return members_of_block(self.scene, self.steps * (self.settle + self.kind.periods))

    def __call__(self, values: dict[str, Array]) -> Answers:
        count = len(values[NOISE])
        parts = [self._some({path: one[i : i + LANES] for path, one in values.items()}) for i in range(0, count, LANES)]
        found = np.concatenate(parts)
        lost = ~np.isfinite(found).all(axis=1)
        word = np.where(lost, FAILED_WORD, KEPT_WORD).astype(object)
        names = [CHANGE, *(OWN + one.name for one in self.figures)]
        names += [f"{i:03d}" for i in range(found.shape[1] - len(names))]
        return Answers(word, dict(zip(names, found.T, strict=True)))

    def _some(self, values: dict[str, Array]) -> Array:
        differ = {path: one for path, one in values.items() if path not in (START, NOISE)}
        T, n, kind, t0 = self.period, self.steps, self.kind, self.starts.t
        start, count = self.starts, len(values[NOISE])
        if START in values:
            start = lanes_of(start, values[START].astype(int))
        many = ensemble(
            self.scene, differ, step=T / n, end=t0 + (self.settle + kind.periods) * T, settle=t0 + self.settle * T,
            start=start, members=count, threads=self.threads, scheme=self.scheme,
            every=n // (KEPT_SAMPLES * kind.harmonics), figures=self.figures,
        )  # fmt: skip
        lost = np.asarray(many.untrusted, dtype=bool)
        moved = np.where(lost, 0.0, many.displacement[self.point]).T
        half = kind.periods // 2
        first, second = (lines_of(part, half, kind.harmonics)[:, ::half] for part in np.hsplit(moved, 2))
        size = 0.5 * np.linalg.norm(first + second, axis=1)
        change = np.linalg.norm(second - first, axis=1) / np.where(size > 0.0, size, 1.0)
        c = lines_of(moved, kind.periods, kind.harmonics)
        c = c * (2j * np.pi * np.arange(c.shape[1]) / (kind.periods * T)) ** self.order
        digest = hashlib.sha256(b"".join(np.ascontiguousarray(one).tobytes() for one in values.values())).digest()
        draw = np.random.default_rng(np.frombuffer(digest, dtype=np.uint32))
        own = [many.figures[one.name] for one in self.figures]
        return np.where(
            lost[:, None], np.nan, np.column_stack([change, *own, kind.of(kind.noisy(c, values[NOISE], draw))])
        )


@checked
def library(
    scene: Scene, distributions: Mapping[str, Any], *, point: str, quantity: Quantity, period: Any,
    members: int = 8192, noise: float = 0.02, periods: int = 100, harmonics: int = 16, settle: int = 100,
    steps: int = 400, starts: SceneState | None = None, seed: int = 0, scheme: LinearScheme = MIDPOINT,
    threads: int | None = None, output: str | Path | None = None, progress: Callable[[int], None] | None = None,
    figures: Sequence[Figure] = (),
) -> Library:  # fmt: skip
    """March members over the unknowns, and learn to estimate these from the motion of a point.

    Members are Sobol points of the distributions. A `damping_factor`, and values of a feedback, are shared by 8 to 64
    members each, which then march in lock-step: of 64 values at least from 512 members on. Where there are several
    starts, each member takes one of them. Features are those of `FeatureKind` in gapbeam.studies.library.recording,
    with noise drawn for each member from none to `noise`. One member in eight is held out and marched in an eighth of
    the step: these remove the error of the step from estimates, and calibrate intervals and the test of membership.

    Args:
        scene: Scene with loads that repeat, and known amplitudes.
        distributions: Frozen distributions of scipy.stats, by path as of `scene.with_`; estimates stay between their
            ends, or quantiles 1e-3 and 0.999 where they have none.
        point: Point whose motion is recorded: a point of one motion, by name, or as "structure.name".
        quantity: Recorded quantity: "displacement", "velocity" or "acceleration", relative to the frame of the scene.
        period: Period of the loads, s.
        members: A power of two from 256 to 16384.
        noise: Largest noise of a recording, over the root mean square of its values.
        periods: Periods of a recording that features are taken from; an even number.
        harmonics: Harmonics of the period, up to which features go.
        settle: Periods before that.
        steps: Steps in a period, rounded up to a multiple of eight times the harmonics.
        starts: Starts of the members; default at rest, undeformed.
        seed: Seed of all draws.
        scheme: Scheme of the time integration.
        threads: As of `ensemble`.
        output: A folder for the library and finished members: a call with the same arguments continues there.
        progress: Called with the number of members that are done.
        figures: Figures of one's own, by `gapbeam.figure`, over the periods of a recording: estimated, too, such as a
            force that nobody records.

    Raises:
        UserError: A distribution, path, point, figure or number cannot be, or the folder has another library.
        NotWritten: The folder takes no file.

    Source: see `Regression` in gapbeam.studies.library.calibrated_regression.
    """
    T = float(positive(period, "library: period"))
    point = scene.short_name(point)
    _check(scene, point, quantity, members, noise, periods, harmonics, settle, steps, scheme)
    samples = KEPT_SAMPLES * harmonics
    begin, each = starts or scene.state(), -(-steps // samples) * samples
    kind = FeatureKind(periods, harmonics, float(noise))
    order, wanted = QUANTITIES.index(quantity), tuple(figures)
    for figure, words in response_figure_faults(scene, wanted):
        raise UserError(f"library: figure {figure.name}: {words}")
    model = _Members(scene, point, order, T, each, settle, kind, begin, scheme, threads, wanted)
    group = min(max(members // SHARED, LEAST), WIDTH)
    values, grid = _points(scene, distributions, members, group, begin.q.shape[1], float(noise), seed)
    own = {path: one for path, one in values.items() if path not in (START, NOISE)}
    try:
        for end in (np.min, np.max):
            scene.with_({path: float(end(one)) for path, one in own.items()})
    except UserError as fault:
        raise UserError(f"{fault}\nlibrary: a path is unknown, or its range leaves what the scene takes") from fault
    key = None
    if output is not None:
        times = begin.t + T * np.linspace(0.0, 1.0, 50)
        key = ensemble_key(
            scene, {}, 1, begin, times, T, point, quantity, each, HELD, settle, kind, scheme, seed, CHANGE, *wanted
        )
    folder, groups = None if output is None else Path(output), members // group
    out = np.repeat(np.random.default_rng([seed, 2]).permutation(groups) < max(groups // HELD, WIDTH // group), group)
    p: Any = np.linspace(0.0, 1.0, grid.shape[1])
    pairs = zip(own.values(), grid, strict=True)
    u = np.column_stack([np.interp(x, row, p) for x, row in pairs])
    parts, changes, lost, done = list[Array](), list[Array](), 0, 0
    by_noise = noise * np.sqrt(8.0 / (KEPT_SAMPLES * periods))  # of 2 rms^2: 4 s^2 / (N / 2) for each line and half

    def show(count: int) -> None:
        if progress is not None:
            progress(done + count)

    fine = replace(model, steps=HELD * each)
    for which, one, place in ((~out, model, folder), (out, fine, folder and folder / "held")):
        found = KeptAnswers(one, place, key, show)({path: value[which] for path, value in values.items()})
        done += int(which.sum())
        whole = found.response == KEPT_WORD
        changes.append(found.figures.pop(CHANGE)[whole] > by_noise)
        mine = [found.figures.pop(OWN + one.name)[whole] for one in wanted]
        if not parts:
            grid = np.vstack([grid, *(_quantiles(one, x, p) for one, x in zip(wanted, mine, strict=True))])
        places = [np.interp(x, row, p) for x, row in zip(mine, grid[len(own) :], strict=True)]
        parts += [np.column_stack(list(found.figures.values()))[whole], np.column_stack([u[which][whole], *places])]
        lost += int(np.sum(~whole))
    paths = (*own, *(one.name for one in wanted))
    units = units_of_values(scene, own) | {one.name: one.unit for one in wanted if one.unit != "1"}
    result = Library(
        paths, grid, point, quantity, T, kind, members - lost, lost, regression(*parts), units,
        float(np.concatenate(changes).mean()),
    )  # fmt: skip
    if folder is not None:
        _write(result, folder)
    return result


def _quantiles(figure: Figure, values: Array, p: Array) -> Array:
    """Return the quantiles of a figure among members at probabilities."""
    if (distinct := len(np.unique(values))) < 2:
        raise UserError(
            f"library: figure {figure.name}: {distinct} distinct among {len(values)} members; expected one that "
            "changes with the values: leave it out"
        )
    return np.asarray(np.quantile(values, p), dtype=float)


def _points(
    scene: Scene, distributions: Mapping[str, Any], members: int, group: int, starts: int, noise: float, seed: int
) -> tuple[dict[str, Array], Array]:  # fmt: skip
    """Return values by path, with start and noise, and the quantiles of each path."""
    inputs = inputs_of(distributions)
    given = inputs.distributions | ({START: randint(0, starts)} if starts > 1 else {}) | {NOISE: uniform(0.0, noise)}
    shared = [path for path in inputs.distributions if scene.is_condensed(path)]
    free = [path for path in given if path not in shared]
    y = dict(zip(free, qmc.Sobol(len(free), seed=np.random.default_rng([seed, 0])).random(members).T, strict=True))
    if shared:
        few = qmc.Sobol(len(shared), seed=np.random.default_rng([seed, 1])).random(members // group)
        y |= {path: np.repeat(one, group) for path, one in zip(shared, few.T, strict=True)}
    normal = norm.ppf(np.clip(np.column_stack([y[path] for path in given]), NEVER_ONE, 1.0 - NEVER_ONE))
    grid = []
    for path, one in inputs.distributions.items():
        p = np.linspace(0.0, 1.0, 1001)
        ends = one.ppf([0.0, 1.0])
        p[0], p[-1] = (0.0 if np.isfinite(ends[0]) else 1e-3), (1.0 if np.isfinite(ends[1]) else 1.0 - 1e-3)
        row = np.asarray(one.ppf(p), dtype=float)
        if not np.all(np.diff(row) >= 0.0) or not row[-1] > row[0]:
            raise UserError(f"library: {path}: expected a range of values, found {row[0]:g} to {row[-1]:g}")
        grid.append(row)
    found = inputs_of(given).values(normal)
    found |= {path: np.clip(found[path], row[0], row[-1]) for path, row in zip(inputs.distributions, grid, strict=True)}
    return found, np.array(grid)


def _check(
    scene: Scene, point: str, quantity: str, members: int, noise: float, periods: int, harmonics: int, settle: int,
    steps: int, scheme: LinearScheme,
) -> None:  # fmt: skip
    if scene.is_large:
        raise UserError("library: a structure has too many DOFs; reduce it: structure.reduced(modes)")
    if scheme.is_accelerated:
        raise UserError("library: the scheme has accelerations as states; take the midpoint rule or theta")
    known = [name for name, one in scene.point_names.items() if len(one.rows) == 1]
    if point not in known:
        raise UserError(
            f"library: point: found {point!r}, expected a point of one motion: {', '.join(known) or 'there is none'}"
        )
    if quantity not in QUANTITIES:
        raise UserError(f"library: quantity: found {quantity!r}, expected {', '.join(QUANTITIES)}")
    if not FEWEST <= members <= MOST or members & (members - 1):
        raise UserError(f"library: members: found {members}, expected a power of two from {FEWEST} to {MOST}")
    if not 0.0 < noise < 1.0:
        raise UserError(f"library: noise: found {noise:g}, expected a share of the root mean square, above 0, below 1")
    if periods < 8 or periods % 2 or harmonics < 3 or min(settle, steps) < 1:
        raise UserError(
            f"library: found {counted(periods, 'period')}, {harmonics} harmonics, {settle} periods to settle, "
            f"{counted(steps, 'step')}; "
            "expected an even number of periods from 8, harmonics from 3, and the others from 1"
        )


def _write(found: Library, folder: Path) -> None:
    note = {
        "paths": found.paths, "point": found.point, "quantity": found.quantity, "period": found.period,
        "periods": found.kind.periods, "harmonics": found.kind.harmonics, "noise": found.kind.noise,
        "members": found.members, "failed": found.failed, "headline": found.headline(), "rows": found.rows(),
        "units": dict(found.units), "changing": found.changing, "doubt": found.doubt,
    }  # fmt: skip
    arrays: dict[str, Any] = {"grid": found.grid, **found.regression.flat()}
    path, part = folder / ARRAYS, folder / (ARRAYS + ".part")
    with study_written(path):
        with part.open("wb") as file:
            np.savez(file, **arrays)
        part.replace(path)
        write_beside(folder / LIBRARY_FILE, json.dumps(note, indent=1) + "\n")


@checked
def read_library(folder: str | Path) -> Library:
    """Read a library from its folder.

    Raises:
        UserError: The folder holds no library, or a damaged one.
    """
    path = Path(folder)
    if not (path / LIBRARY_FILE).is_file():
        hint = "; it was not finished: call gapbeam library again" if (path / "kept").is_dir() else ""
        raise UserError(f"{path}: expected the folder of a library, with {LIBRARY_FILE}{hint}")
    try:
        note = json.loads((path / LIBRARY_FILE).read_text())
        parts = arrays_in(path / ARRAYS)
        grid = parts.pop("grid")
        kind = FeatureKind(note["periods"], note["harmonics"], note["noise"])
        found = Library(
            tuple(note["paths"]), grid, note["point"], note["quantity"], note["period"], kind, note["members"],
            note["failed"], Regression(**parts), note.get("units", {}), note.get("changing", 0.0),
        )  # fmt: skip
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise UserError(f"{path}: the library is damaged ({error}); march it again: gapbeam library") from error
    if found.doubt:
        LOG.warning("%s: %s", path, found.doubt)
    return found
