"""Assumptions of the equations: their limits, and how close a run came to them, in its poses and its frequencies.

The pose of the beam is its rotation, strain, stress, travel along the support and motion across it:

    W = (H - H^T)/2,  E = (H + H^T)/2,  H = du/dx;    rotation |W|/sqrt 2,  strain |E|,  stress sqrt(3/2) |2 mu dev E|

at points of the surface, |.| the Frobenius norm. A record is looked at where its strain energy exceeds all that was
looked at before by a tenth, and 200 times over the span of the run. Looks follow from the records alone, so that a
resumed run looks at the same ones.

Frequencies come from recorded velocities. The power spectra of all signals, v v by Hann windows over segments that
overlap by half, are added up. A hundred frequencies, each of which stands for a hundredth of the energy, represent the
sum. Motion along the beam and across it are waves of different lengths: each kind has the frequency above which it
carries less than half a hundredth of all.

A slow load leaves little kinetic energy T beside E = T + V + Psi - (work of static loads), which follows it. Then
sqrt(max T / range of E) is the share of the motion that vibrates, over the second half of the records.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import isfinite
from typing import Any, Protocol

import numpy as np

from gapbeam.solver.case.solution_tables import Gates
from gapbeam.solver.messages.errors import AssumptionBroken
from gapbeam.solver.messages.wording import apart
from gapbeam.solver.system.operators import Array

LOOKS = 200  # over the span of a run
TOGETHER = 2**16  # points of all poses that are looked at together
HIGHER = 1.1  # times the largest strain energy looked at so far
SHORT = 3  # digits of values and limits, unless more tell them apart
ROTATION, STRAIN, STRESS, TRAVEL, ASIDE = range(5)


class PoseRows(Protocol):
    """Rows of displacement and gradient at points of the surface."""

    @property
    def places(self) -> Array:
        """The points, (k, 3), m."""

    @property
    def on_faces(self) -> int:
        """Number of points on base and gland; they come first."""

    def poses(self, u: Array) -> tuple[Array, Array]:
        """Return displacement (times, k, d) and gradient (times, k, d, d) of marched DOFs u, (times, n). Collective."""


@dataclass(frozen=True)
class PoseScales:
    """Scales that a pose is compared with.

    Attributes:
        shear_modulus: mu, Pa, of a beam of one material; of several ones that at each point, (k,).
        poisson_ratio: nu, likewise.
        thin: Rule that completes the strain across plane or beam: by -nu/(1-nu) of the sum (plane stress: "plane"),
            by -nu of that along the beam (beam models: "beam"), or not ("").
        support_length: m.
        width: Width, which motion across the beam leaves; infinite where supports are around the beam, m.
        radius: Radius of the beam at each point of supports that are met along its radii, else infinity, (k,), m.
        span: Span of the run, s.
        strength: Divisor of the watched stress: 1, or the yield stress at each point, (k,), Pa.
    """

    shear_modulus: float | Array
    poisson_ratio: float | Array
    thin: str
    support_length: float
    width: float
    radius: Array
    span: float
    strength: float | Array = 1.0


def still(_time: float, _u: Array) -> float:
    """Return the motion of supports that do not move, 0."""
    return 0.0


@dataclass
class PoseWatch:
    """Keeps the largest rotation, strain, stress, travel and motion across the beam of a run.

    Attributes:
        rows: Rows of a pose.
        scales: Its scales.
        moved: Function that returns the displacement of the supports of the points on faces at a time, with marched
            DOFs (n,), (on_faces, d) or 0, m: travel and motion across are those in them.
        closest: Row by row of ROTATION, STRAIN, STRESS, TRAVEL, ASIDE: value, time and place, (5, 5).
        due: Time of the next look, s.
        highest: Largest strain energy looked at, J.
        at_start: Rotation at the first look, rad.
        looks: Number of looks.
    """

    rows: PoseRows
    scales: PoseScales
    moved: Callable[[float, Array], Array | float] = still
    closest: Array = field(default_factory=lambda: np.zeros((5, 5)))
    due: float = -1.0
    highest: float = 0.0
    at_start: float = 0.0
    looks: int = 0

    def see(self, times: Array, u: Array, strain_energy: Array) -> None:
        """See records.

        Args:
            times: (times,), s.
            u: Marched DOFs, (times, n).
            strain_energy: (times,), J.

        Collective.
        """
        chosen = []
        for place in np.flatnonzero((times >= self.due) | ~(strain_energy <= HIGHER * self.highest)):
            time, energy = float(times[place]), float(strain_energy[place])
            if time < self.due and energy <= HIGHER * self.highest:
                continue
            chosen.append(place)
            self.highest = max(self.highest, energy)
            if time >= self.due:
                self.due = time + self.scales.span / LOOKS
        together = max(1, TOGETHER // max(1, len(self.rows.places)))
        for first in range(0, len(chosen), together):
            some = chosen[first : first + together]
            self._look(times[some], u[some])
            self.looks += len(some)

    def end(self) -> None:
        """Look no more."""
        self.due = self.highest = np.inf

    def _look(self, times: Array, u: Array) -> None:
        displacement, gradient = self.rows.poses(u)
        rotation, strain, stress = deformation(gradient, self.scales)
        places, faces = self.rows.places, self.rows.on_faces
        self._keep(ROTATION, rotation, times, places)
        self._keep(STRAIN, strain, times, places)
        self._keep(STRESS, np.asarray(stress / self.scales.strength), times, places)
        if faces:
            inside = displacement[:, :faces].copy()
            for one, time, marched in zip(inside, times, u, strict=True):
                one -= self.moved(time, marched)
            moved = np.abs(np.mean(inside, axis=1))
            share = moved[:, 0] / self.scales.support_length
            if moved.shape[1] > 2:
                share = np.maximum(share, moved[:, 1] / self.scales.width)
            self._keep(TRAVEL, share[:, None], times, np.mean(places[:faces], axis=0, keepdims=True))
            if np.isfinite(self.scales.radius).any():
                aside = np.linalg.norm(inside[..., 1:] - rolled(places[:faces], gradient[:, :faces]), axis=-1)
                self._keep(ASIDE, aside / self.scales.radius[:faces], times, places[:faces])
        if not self.looks:
            self.at_start = float(np.max(rotation[0]))

    def _keep(self, row: int, found: Array, times: Array, places: Array) -> None:
        """Keep the largest of values at times and places, (times, places), if it exceeds the one kept."""
        time, place = np.unravel_index(np.argmax(found), found.shape)
        if not found[time, place] <= self.closest[row, 0]:
            self.closest[row] = found[time, place], times[time], *places[place]


def rolled(places: Array, gradient: Array) -> Array:
    """Return the motion across the beam of surface points by its rotation about its axis, (..., k, 2), m.

    A round beam that rolls keeps its radii.

    Args:
        places: The points, (k, 3), m.
        gradient: du/dx there, (..., k, 3, 3).
    """
    turned = 0.5 * (gradient[..., 2, 1] - gradient[..., 1, 2])
    return np.stack([-turned * places[:, 2], turned * places[:, 1]], axis=-1)


def deformation(gradient: Array, scales: PoseScales) -> tuple[Array, Array, Array]:
    """Return rotation (rad), size of the strain and von Mises stress (Pa), (..., k), of gradients (..., k, d, d)."""
    turned = 0.5 * (gradient - np.swapaxes(gradient, -1, -2))
    strain = strain_of(gradient, scales)
    mean = np.trace(strain, axis1=-2, axis2=-1) / 3.0
    deviator = strain - mean[..., None, None] * np.identity(3)
    stress = 2.0 * scales.shear_modulus * np.sqrt(1.5 * np.sum(deviator**2, axis=(-2, -1)))
    return np.sqrt(0.5 * np.sum(turned**2, axis=(-2, -1))), np.sqrt(np.sum(strain**2, axis=(-2, -1))), stress


def axial_stress(gradient: Array, scales: PoseScales) -> Array:
    """Return sigma_xx = 2 mu (e_xx + nu / (1 - 2 nu) tr e) of gradients (..., k, d, d), (..., k), Pa."""
    strain, nu = strain_of(gradient, scales), scales.poisson_ratio
    if scales.thin == "beam":  # exact for nu = 1/2, too
        return np.asarray(2.0 * scales.shear_modulus * (1.0 + nu) * strain[..., 0, 0])
    total = np.trace(strain, axis1=-2, axis2=-1)
    return np.asarray(2.0 * scales.shear_modulus * (strain[..., 0, 0] + nu / (1.0 - 2.0 * nu) * total))


def strain_of(gradient: Array, scales: PoseScales) -> Array:
    """Return the strain of gradients (..., k, d, d) in space, (..., k, 3, 3)."""
    dimension, nu = gradient.shape[-1], scales.poisson_ratio
    strain = np.zeros((*gradient.shape[:-2], 3, 3))
    strain[..., :dimension, :dimension] = 0.5 * (gradient + np.swapaxes(gradient, -1, -2))
    if scales.thin == "plane":
        strain[..., 2, 2] = -nu / (1.0 - nu) * (strain[..., 0, 0] + strain[..., 1, 1])
    elif scales.thin == "beam":
        strain[..., 1, 1] = strain[..., 2, 2] = -nu * strain[..., 0, 0]
    return strain


HOLDS, WARNING, FAILURE = "holds", "warning", "failure"


@dataclass(frozen=True)
class Assumption:
    """Assumption of the equations, with its limits.

    Attributes:
        name: Name in a few words.
        quantity: The watched quantity.
        unit: Its SI unit, "1" where there is none.
        limit: Beyond it, the run warns.
        failure: Beyond it, the run ends with status 4; None: it only warns.
        meaning: Consequence where the limit is passed, and advice.
    """

    name: str
    quantity: str
    unit: str
    limit: float
    failure: float | None
    meaning: str

    def limited_by(self, gates: Gates) -> Assumption:
        """Return the assumption with the limits that a case gives it; a failure is never below a warning."""
        warning, failure = gates.warnings.of(self.name), gates.failures.of(self.name)
        limit = self.limit if warning is None else warning
        if failure is None:
            failure = None if self.failure is None else max(self.failure, limit)
        else:
            limit = min(limit, failure)
        return replace(self, limit=limit, failure=failure if failure is None or isfinite(failure) else None)


@dataclass(frozen=True)
class Finding:
    """Distance of a run from the limit of an assumption.

    Attributes:
        assumption: The assumption.
        closest: The largest value of its quantity.
        time: Time, s; None: the value is not of one instant.
        place: Place, (3,), m; None: the value is not of one point.
        estimate: Relative error of figures by it; None: not known.
        detail: Details of the value, in words.
        of: The figure that the estimate belongs to.
    """

    assumption: Assumption
    closest: float
    time: float | None = None
    place: Array | None = None
    estimate: float | None = None
    detail: str = ""
    of: str = "figures"

    @property
    def verdict(self) -> str:
        """Verdict: the assumption holds, or one of its limits is passed; a value that is not a number fails."""
        worst = self.assumption.failure
        if worst is not None and not self.closest <= worst:
            return FAILURE
        return HOLDS if self.closest <= self.assumption.limit else WARNING

    @property
    def words(self) -> str:
        """Distance from the limit, in one sentence."""
        one = self.assumption
        unit = "" if one.unit == "1" else f" {one.unit}"
        where = "" if self.time is None else f" at t = {self.time:.6g} s"
        if self.place is not None:
            where += f", point ({', '.join(f'{x:.4g}' for x in self.place)}) m"
        limit = one.limit if one.failure is None or self.verdict != FAILURE else one.failure
        error = "" if self.estimate is None else f"; {self.of} are off by about {100.0 * self.estimate:.2g} %"
        detail = f" ({self.detail})" if self.detail else ""
        found, allowed = apart(self.closest, limit, least=SHORT)
        return f"{one.name}: {one.quantity} {found}{unit}{where}{detail}, limit {allowed}{unit}{error}"

    @property
    def share(self) -> float:
        """Largest value over the limit: 1 at the limit."""
        return self.closest / self.assumption.limit  # 0 where there is none

    @property
    def remark(self) -> str:
        """Warning for the user where the limit is passed."""
        return f"{self.words}: {self.assumption.meaning}"

    def as_data(self) -> dict[str, Any]:
        """Return the finding for summary.json."""
        one = self.assumption
        return {
            "name": one.name,
            "quantity": one.quantity,
            "unit": one.unit,
            "closest": self.closest,
            "limit": one.limit,
            "failure_limit": one.failure,
            "share_of_limit": self.share,
            "time": self.time,
            "place": None if self.place is None else [float(x) for x in self.place],
            "error_estimate": self.estimate,
            "detail": self.detail,
            "verdict": self.verdict,
            "meaning": one.meaning,
        }


def limited(findings: Iterable[Finding], gates: Gates) -> list[Finding]:
    """Return findings with the limits that a case gives their assumptions."""
    return [replace(finding, assumption=finding.assumption.limited_by(gates)) for finding in findings]


def in_one_line(findings: Sequence[Finding]) -> str:
    """Return the number of assumptions that hold, and the one closest to its limit."""
    holding = [finding for finding in findings if finding.verdict == HOLDS]
    nearest = max(holding, key=lambda finding: finding.share, default=None)
    closest = "" if nearest is None else f"; closest to its limit: {nearest.words}"
    return f"{len(holding)} of {len(findings)} assumptions hold{closest}"


def let_pass(findings: Sequence[Finding]) -> None:
    """Pass findings none of which has failed, or raise.

    Raises:
        AssumptionBroken: A limit beyond which the figures mean nothing is passed.
    """
    failed = [finding for finding in findings if finding.verdict == FAILURE]
    if failed:
        raise AssumptionBroken(
            "an assumption behind the figures does not hold, the results are not to be trusted: "
            + "; ".join(finding.remark for finding in failed)
            + f". gates.failures.{failed[0].assumption.name.replace(' ', '_')} sets another limit"
        )


SEGMENT = 8192  # records
PARTS = 100
FEWEST = 16  # records; fewer show no frequency
DEPTH = 1e-6  # of the interval, by which records may be unevenly spaced


@dataclass(frozen=True)
class FrequencyContent:
    """Distribution of the energy over frequencies.

    Attributes:
        frequencies: Each stands for a hundredth of the energy, rising, (100,), Hz.
        along: Highest frequency of motion along the beam, Hz; 0: it carries next to nothing.
        across: The same of motion across the beam; None: that of all motion.
        share: Share of the motion, which vibrates.
    """

    frequencies: Array
    along: float = 0.0
    across: float | None = None
    share: float = 1.0

    @property
    def middle(self) -> float:
        """Half of the energy lies below, Hz."""
        return float(self.frequencies[PARTS // 2])

    @property
    def highest(self) -> float:
        """All but a hundredth of the energy lies below, Hz."""
        return float(self.frequencies[-1])

    @property
    def bending(self) -> float:
        """Highest frequency of motion across the beam, Hz; 0: it carries next to nothing."""
        return self.highest if self.across is None else self.across


class Recorded(Protocol):
    """Records in memory or in a file, (records, ...), read a part at a time."""

    def __getitem__(self, part: slice, /) -> Array:
        """Return part of the records."""


def content_of_history(history: Mapping[str, Recorded], static: Sequence[bool]) -> FrequencyContent | None:
    """Return the energy content of records; None without probes, where nothing moves, or with too few records.

    Args:
        history: Records by name.
        static: True for each load that never changes.
    """
    if "velocity" not in history:
        return None
    content = content_of_motion(history["time"][:], history["velocity"])
    return None if content is None else replace(content, share=vibrating_share(history, static))


def vibrating_share(history: Mapping[str, Recorded], static: Sequence[bool]) -> float:
    """Return the share of the motion that vibrates, at most 1."""
    half = slice(len(history["time"][:]) // 2, None)
    kinetic, strain, contact = (history[f"{name}_energy"][half] for name in ("kinetic", "strain", "contact"))
    still = np.asarray(static, dtype=bool)
    fixed = np.asarray(history["load_work"][half])[:, still].sum(axis=1) if still.any() else 0.0
    changed, largest = float(np.ptp(kinetic + strain + contact - fixed)), float(np.max(kinetic))
    return float(np.sqrt(largest / changed)) if changed > largest else 1.0


def content_of_motion(times: Array, velocity: Recorded) -> FrequencyContent | None:
    """Return the energy content of recorded velocities; None where nothing moves, or with too few records.

    Args:
        times: Times of the records, s; what comes after the first uneven interval is left out.
        velocity: (records, ..., components), m/s, the component along the beam first.
    """
    intervals = np.diff(times)
    if len(times) < FEWEST:
        return None
    interval = float(np.median(intervals))
    even = np.flatnonzero(np.abs(intervals - interval) > DEPTH * interval)
    count = int(even[0]) + 1 if len(even) else len(times)  # the last record may come early
    if count < FEWEST:
        return None
    power: Array = np.zeros((2, 1))
    for taken in segments(count):
        part = np.asarray(velocity[taken])
        kinds = part[..., :1], part[..., 1:]
        power = power + [power_of(kind.reshape(len(part), -1)) for kind in kinds]
    return content_of(power, interval, 2 * (power.shape[1] - 1) + (min(count, taken.stop - taken.start) % 2))


def segments(count: int) -> Iterator[slice]:
    """Yield the segments of so many records, the last one up to the last record."""
    if count <= SEGMENT:
        yield slice(0, count)
        return
    half = SEGMENT // 2
    for first in range(0, count - SEGMENT, half):
        yield slice(first, first + SEGMENT)
    yield slice(count - SEGMENT, count)


def power_of(velocities: Array) -> Array:
    """Return the power of a segment without its mean, (records / 2 + 1,), of velocities (records, signals)."""
    window = np.hanning(len(velocities) + 2)[1:-1, None]
    moved = velocities - np.mean(velocities, axis=0)
    return np.asarray(np.sum(np.abs(np.fft.rfft(window * moved, axis=0)) ** 2, axis=1))


def content_of(power: Array, interval: float, records: int) -> FrequencyContent | None:
    """Return the content of a spectrum; None where nothing moves.

    Args:
        power: Sums of `power_of` over segments, of motion along the beam and across it, (2, lines).
        interval: Time between records, s.
        records: Records of a segment.
    """
    lines = np.arange(1, power.shape[1]) / (records * interval)
    sums = np.cumsum(power.sum(axis=0)[1:])
    if not len(sums) or not np.isfinite(sums[-1]) or sums[-1] <= 0.0:
        return None
    wanted = (np.arange(PARTS) + 0.5) / PARTS * sums[-1]
    tails = power[:, :0:-1].cumsum(axis=1)[:, ::-1]  # of the energy at a line and above it
    carrying = [lines[kind >= 0.5 / PARTS * sums[-1]] for kind in tails]
    along, across = (float(kind[-1]) if len(kind) else 0.0 for kind in carrying)
    return FrequencyContent(lines[np.searchsorted(sums, wanted)], along, across)
