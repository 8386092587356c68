"""A file of several structures in tables: bodies, points, frequencies, contacts, the seat, and margins in a flow."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import inf, pi

import numpy as np
from rich.table import Table
from rich.text import Text

from gapbeam.solver.messages.errors import NotConverged, UserError
from gapbeam.solver.messages.wording import counted
from gapbeam.solver.scene.feedback import Joint
from gapbeam.solver.scene.flow_force import Flow
from gapbeam.solver.scene.flow_margin import (
    UNDECIDED,
    FlowMargin,
    connors_of_modes,
    flow_margin,
    flows_of,
    idle_supports,
    leading,
)
from gapbeam.solver.scene.lagged_force import CoefficientFit
from gapbeam.solver.scene.recorded_places import turning_places
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.shipped_laws import KelvinVoigt
from gapbeam.solver.scene.structure import FIRST_GUESS, Structure, StructurePoint
from gapbeam.solver.scene_file.feedback_tables import ConnorsCheck, Controller
from gapbeam.solver.scene_file.scene_reader import ReadScene
from gapbeam.solver.schema.record_table import unit_where
from gapbeam.solver.system.dense_operators import SparseOperators


def flow_rows(read: ReadScene) -> tuple[Row, ...]:
    """Return name, value and explanation of each result of [[feedback]] before a run."""
    if not read.case.feedback:
        return ()
    scene = read.scene
    rows = [_force(one) for one in scene.feedbacks if isinstance(one, Flow)]
    if scene.is_large:
        return (*rows, ("critical velocity", "not computed", "too many DOFs; reduce = { modes = 40 }"))
    linear = [one.name for one in scene.contacts if one.law.kind is KelvinVoigt]
    left = [one.name for one in scene.contacts if one.law.kind is not KelvinVoigt]
    rows += list(_margins(scene, linear))
    rows += [row for one in read.case.feedback if isinstance(one, ConnorsCheck) for row in _connors(read, one, linear)]
    if left:
        rows.append(("idle in all of this", ", ".join(left), "their laws are not linear"))
    return tuple(rows)


def _force(one: Flow) -> Row:
    words = [f"{counted(len(one.A), 'state')}"]
    words += [f"delay {one.delay:.4g} s, error {one.error:.1g}"] if one.delay else []
    if one.law.fit is not None:
        words.append(f"misfit {100.0 * one.law.fit.misfit:.2g} % of the largest coefficient")
    return one.name, f"{one.velocity:g} m/s", ", ".join(words)


def _drawn(fit: CoefficientFit) -> tuple[Row, ...]:
    """Return measured coefficients and their fit, drawn over the reduced velocity: o measured, + fit, * both."""
    places = np.unique(np.linspace(0, len(fit.reduced) - 1, LINES).round().astype(int))
    fitted, rows = fit.fitted(fit.reduced), list[Row]()
    for name, data, line in zip(fit.names, fit.measured.T, fitted.T, strict=True):
        for words, a, b in ((f"Re {name}", data.real, line.real), (f"Im {name}", data.imag, line.imag)):
            low, high = min(a.min(), b.min()), max(a.max(), b.max())
            span = high - low or 1.0
            rows.append((words, f"{low:.3g} to {high:.3g}", "o measured, + fit, * both"))
            for i in places:
                strip = [" "] * WIDTH
                o, plus = (round((WIDTH - 1) * float((one[i] - low) / span)) for one in (a, b))
                strip[o], strip[plus] = "o", "*" if o == plus else "+"
                rows.append((f"U/(f D) {fit.reduced[i]:.4g}", f"{a[i]:.4g}, fit {b[i]:.4g}", f"|{''.join(strip)}|"))
    return (*rows, ("warning", fit.doubt, "")) if fit.doubt else tuple(rows)


def _margins(scene: Scene, supports: Sequence[str]) -> Iterator[Row]:
    """Yield critical velocities, or growth without a flow, all supports closed or idle, and how many may be idle."""
    flows = flows_of(scene)
    if all(isinstance(one, Joint) for one in scene.feedbacks):
        return
    name = "critical velocity" if flows else "growth, linear"
    for closed, words in _held(supports):
        try:
            if flows:
                yield name, *_margin_words(flow_margin(scene, closed), flows[0], words)
            else:
                growth = leading(scene, closed)
                state = "unstable" if growth.real > UNDECIDED * abs(growth) else "stable"
                frequency = abs(growth.imag) / (2.0 * pi)
                yield name, f"{growth.real:.4g} 1/s, {frequency:.4g} Hz", f"{words}; {state}"
        except UserError as error:
            yield name, "not known", f"{words}: {error}"
    if not supports:
        return
    try:
        found = idle_supports(scene, supports)
    except UserError as error:
        yield "supports that may be idle", "not known", str(error)
        return
    worst = f"unstable without {' and '.join(sorted(found.unstable[0]))}" if found.unstable else "whichever"
    if found.tolerated < 0:
        yield "supports that may be idle", "none", "unstable with all closed"
    else:
        yield "supports that may be idle", f"{found.tolerated} of {len(supports)}", worst


def _held(supports: Sequence[str]) -> list[tuple[Sequence[str], str]]:
    """Return supports that are closed, and words for them: all, and none."""
    return [(supports, "all closed"), ((), "all idle")] if supports else [((), "no supports with play")]


def _margin_words(found: FlowMargin, flow: Flow, words: str) -> tuple[str, str]:
    """Return the critical velocity, and its margin."""
    if found.factor == inf:
        highest = found.highest * flow.velocity
        return f"above {highest:.4g} m/s", f"{words}; stable: more than {found.highest:.3g} times the flow"
    if found.factor == 0.0:
        return f"below {found.lowest * flow.velocity:.4g} m/s", f"{words}; unstable, as far down as the laws hold"
    how = f"{found.frequency / (2.0 * pi):.4g} Hz" if found.frequency else "divergence"
    state = "stable" if found.factor > 1.0 else "unstable"
    return f"{found.factor * flow.velocity:.4g} m/s, {how}", f"{words}; {state}: {found.factor:.3g} times the flow"


def _connors(read: ReadScene, one: ConnorsCheck, supports: Sequence[str]) -> Iterator[Row]:
    tube = next(body for body in read.case.structure if body.name == read.spans[one.name].structure.name)
    figures = {"K": one.constant, **{key: getattr(one, key) for key in ("mass", "diameter", "density")}}
    figures["decrement"] = 2.0 * pi * tube.damping if one.decrement is None else one.decrement
    for closed, words in _held(supports):
        found, w = connors_of_modes(read.scene, read.spans[one.name], closed, one.velocity, **figures)
        state = "stable" if found.ratio < 1.0 else "unstable"
        velocity = one.velocity / found.ratio if np.isfinite(found.ratio) else inf
        margin = f"{words}; {state}: {1.0 / found.ratio:.3g} times the flow"
        yield f"{one.name}: Connors", f"{velocity:.4g} m/s, {w / (2.0 * pi):.4g} Hz", margin


LINES, WIDTH = 12, 33  # of drawn coefficients
MOST = 6
STILL = 1e-13  # of the largest: squares below belong to rigid motions
Row = tuple[str, str, str]


@dataclass(frozen=True)
class SceneDescription:
    """Description of the run of a scene before it starts.

    Attributes:
        title: Title of the file.
        sections: Rows of name, value and explanation under each heading.
        seated: Whether there is a static equilibrium under the loads at t = 0.
    """

    title: str
    sections: dict[str, tuple[Row, ...]]
    seated: bool

    def __str__(self) -> str:
        lines = [self.title]
        for heading, rows in self.sections.items():
            lines += [heading, *(f"  {name}: {value}{f' ({why})' if why else ''}" for name, value, why in rows)]
        return "\n".join(lines)

    __repr__ = __str__

    def tables(self) -> list[Table | Text]:
        """Return the description for the terminal."""
        found: list[Table | Text] = [Text(self.title, style="bold")]
        for heading, rows in self.sections.items():
            table = Table(title=heading, title_justify="left", show_header=False)
            for row in rows:
                table.add_row(*(Text(cell) for cell in row))
            found.append(table)
        return found


def describe_scene(read: ReadScene) -> SceneDescription:
    """Describe the run of a file: structures, points, frequencies, contacts, march and seat."""
    scene, time = read.scene, read.case.time
    seated, rest = _rest(read)
    steps = round(time.end / read.step)
    how = "sparse matrices, factored once" if scene.is_large else "all modes of the structures"
    flow, controlled = flow_rows(read), all(isinstance(one, Controller) for one in read.case.feedback)
    drawn = {f"coefficients of {one.name}": _drawn(one.law.fit) for one in flows_of(scene) if one.law.fit is not None}
    return SceneDescription(
        read.case.title or read.name,
        {
            "structures": tuple(_body(one) for one in scene.structures)
            + tuple((name, what, f"source: {source}") for name, what, source in read.sources),
            "points": tuple(
                (f"{one.name}.{name}", counted(len(point.rows), "motion"), _of_point(point))
                for one in scene.structures
                for name, point in one.points.items()
            ),
            "contacts": tuple(
                (
                    one.name,
                    one.region.kind.name,
                    f"{one.law.kind.name}, at {' and '.join(f'{at.structure.name}.{at.name}' for at in one.points)}",
                )
                for one in scene.contacts
            ),
            "march": (
                ("steps", f"{steps} of {read.step:.4g} s", f"scheme {time.scheme.type}"),
                *([("step", "computed", read.reason)] if read.reason else []),
                ("with", how, counted(scene.size, "DOF")),
            ),
            "seat at t = 0": rest,
            **({"feedback" if controlled else "flow": flow} if flow else {}),
            **drawn,
        },
        seated,
    )


def _of_point(point: StructurePoint) -> str:
    """Return the directions of the motions of a point in space, and whether its stress is recorded."""
    ways = point.directions
    along = [] if ways is None or not np.all(np.any(ways, axis=1)) else [
        f"{number} along ({', '.join(f'{x:.3g}' for x in way + 0.0)})" for number, way in enumerate(ways, 1)
    ]  # fmt: skip
    return ", ".join(along + ["stress"] * (point.name in point.structure.gauges))


def _body(structure: Structure) -> Row:
    squares = lowest_squares(structure)
    shown = ", ".join(f"{np.sqrt(one) / (2.0 * pi):.5g}" for one in squares)
    return structure.name, counted(structure.size, "DOF"), f"first frequencies {shown} Hz"


def lowest_squares(structure: Structure) -> list[float]:
    """Return the `MOST` lowest squares of angular frequencies, 1/s^2, at most, those of rigid motions as 0.

    Raises:
        RunError: The modes of a large structure did not converge.
    """
    if not structure.is_large:
        squares = structure.modes[0]
        return [max(float(one), 0.0) for one in squares[:MOST]]
    operators = SparseOperators(structure.M, structure.K)
    ratios = operators.stiffness.diagonal() / operators.mass.diagonal()
    near = FIRST_GUESS * float(ratios.mean())
    squares, _ = operators.lowest_modes(near, MOST, operators.factor(near, 1.0))
    return [float(one) if one > STILL * ratios.max() else 0.0 for one in squares]


def _rest(read: ReadScene) -> tuple[bool, tuple[Row, ...]]:
    """Return whether there is a seat, and its contact forces, or why there is none."""
    try:
        state = read.seat()
    except (UserError, NotConverged) as error:
        return False, (("none", str(error), ""),)
    return True, tuple(_forces(read.scene, state.F[:, 0])) or (("displacements", "no contacts", ""),)


def _forces(scene: Scene, forces: np.ndarray) -> Iterator[Row]:
    turning = turning_places(scene)
    for one, at in zip(scene.contacts, scene.first, strict=False):
        force = forces[at : at + one.motions]
        yield (
            one.name,
            f"{np.linalg.norm(force):.6g} {unit_where('N', one.name in turning)}",
            "closed" if np.any(force) else "open",
        )
