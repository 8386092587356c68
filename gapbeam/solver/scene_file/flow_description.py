"""Rows of `gapbeam check` on a flow: forces, critical velocity, Connors' margin, supports that may be idle."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf, pi

import numpy as np

from gapbeam.solver.errors import UserError
from gapbeam.solver.scene.flow_force import Flow
from gapbeam.solver.scene.flow_margin import FlowMargin, connors_of_modes, flow_margin, flows_of
from gapbeam.solver.scene.linear_stability import idle_supports
from gapbeam.solver.scene.scene import Scene
from gapbeam.solver.scene.shipped_laws import KelvinVoigt
from gapbeam.solver.scene_file.feedback_tables import ConnorsCheck
from gapbeam.solver.scene_file.scene_reader import ReadScene

Row = tuple[str, str, str]


def flow_rows(read: ReadScene) -> tuple[Row, ...]:
    """Return name, value and explanation of all that is known of the flow before a run; none without [[feedback]]."""
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
    words = [f"{len(one.A)} states"]
    words += [f"delay {one.delay:.4g} s, error {one.error:.1g}"] if one.delay else []
    words += [f"misfit {one.law.misfit:.2g} of the largest coefficient"] if one.law.misfit else []
    return one.name, f"{one.velocity:g} m/s", ", ".join(words)


def _margins(scene: Scene, supports: Sequence[str]) -> Iterator[Row]:
    """Yield critical velocities with all supports closed and with all idle, and how many may be idle."""
    flows = flows_of(scene)
    if not flows:
        return
    sets = [("critical velocity", supports, "all closed"), ("critical velocity", (), "all idle")]
    for name, closed, words in sets[: 1 + bool(supports)]:
        words = words if supports else "no supports with play"
        try:
            yield name, *_margin_words(flow_margin(scene, closed), flows[0], words)
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


def _margin_words(found: FlowMargin, flow: Flow, words: str) -> tuple[str, str]:
    """Return the critical velocity, and its margin."""
    if found.factor == inf:
        highest = found.highest * flow.velocity
        return f"above {highest:.4g} m/s", f"{words}; stable: more than {found.highest:.3g} times the flow"
    if found.factor == 0.0:
        return f"below {found.lowest * flow.velocity:.4g} m/s", f"{words}; unstable, as far down as the laws hold"
    how = f"{found.frequency / (2.0 * pi):.4g} Hz" if found.frequency else "divergence"
    state = "stable" if found.factor > 1.0 else "unstable"
    return (
        f"{found.factor * flow.velocity:.4g} m/s, {how}", f"{words}; {state}: {found.factor:.3g} times the flow"
    )  # fmt: skip


def _connors(read: ReadScene, one: ConnorsCheck, supports: Sequence[str]) -> Iterator[Row]:
    figures = {"K": one.constant, **{key: getattr(one, key) for key in ("mass", "decrement", "diameter", "density")}}
    for closed, words in [(supports, "all closed"), ((), "all idle")][: 1 + bool(supports)]:
        found, w = connors_of_modes(read.scene, read.spans[one.name], closed, one.velocity, **figures)
        state = "stable" if found.ratio < 1.0 else "unstable"
        velocity = one.velocity / found.ratio if np.isfinite(found.ratio) else inf
        yield (
            f"{one.name}: Connors", f"{velocity:.4g} m/s, {w / (2.0 * pi):.4g} Hz",
            f"{words if supports else 'no supports with play'}; {state}: {1.0 / found.ratio:.3g} times the flow",
        )  # fmt: skip
