"""Tangents of drawn periodic responses against differences of responses that converge anew.

    environment/run python3 -m benchmarks.drawn_tangents [cases] [first]

Cases are an oscillator, a tube of 3 to 9 modes on two supports, or a disc that slides with friction in a hole, with
linear, cubic and damped laws, under a load of two harmonics. Figures are peak, rms, harmonic, peak force, impulse and
work, by clearance, stiffness, damping, offset, friction, amplitude and frequency of the load, and damping of the
structure: each case has 5 or 6 figures and 6 or more parameters.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from math import pi
from typing import Any, NamedTuple

import numpy as np

import gapbeam as gb
from gapbeam.solver.scene.scene import SceneState

STEPS, RIGHT = 400, 1e-7
"""Steps in a period, and the largest difference, relative to the larger of slope and figure over parameter."""


class Compared(NamedTuple):
    """Slopes of a case: why there are none, their number, the largest difference, and how many have no oracle.

    Attributes:
        reason: "" where there are slopes.
        settled: A march from rest came to a periodic response.
        kind: Kind of structure and law.
        slopes: Number of slopes that were compared.
        worst: Relative difference.
        place: Figure and parameter of the worst.
        unsure: Slopes whose differences of responses differ by more than `RIGHT` themselves.
    """

    reason: str
    settled: bool
    kind: str
    slopes: int = 0
    worst: float = 0.0
    place: str = ""
    unsure: int = 0


def wave(t: Any, amplitude: float, frequency: float) -> Any:
    """Return a load of two harmonics."""
    return amplitude * (np.cos(frequency * t + 0.7) + 0.3 * np.cos(2.0 * frequency * t))


def settled(scene: gb.Scene, period: float, periods: int = 80) -> SceneState:
    """Return the state of the response that a march from rest comes to."""
    near = gb.history(scene, period / STEPS, periods * period).last.state
    near.t = 0.0
    return gb.periodic(scene, period, STEPS, near, passes=12).state


def drawn(seed: int) -> tuple[gb.Scene, dict[str, float], list[str], str]:
    """Return a scene of an oscillator, a tube or a disc in contact, six parameters or more, figures, and its kind."""
    r = np.random.default_rng(seed)
    kind, law_kind = r.choice(["oscillator", "tube", "round"]), r.choice(["kelvin", "elastic", "hunt", "gap", "cubic"])
    w, g, ratio = 2.0 * pi * 10.0 ** r.uniform(0, 2), 10.0 ** r.uniform(-5, -3), 10.0 ** r.uniform(-2, -0.9)
    at = "tip" if kind == "tube" else "at"
    if kind == "oscillator":
        body = gb.mass(1.0, stiffness=w * w, damping=2.0 * ratio * w, name="body")
    elif kind == "round":
        body = gb.from_modes([w, 1.13 * w], ratio, {"at": np.eye(2)}, name="body")
    else:
        modes = np.arange(int(r.integers(3, 10))) + 0.5
        shapes = np.sqrt(2.0) * np.sin(np.outer([0.37, 0.81, 1.0], modes) * pi)
        points = dict(zip(("low", "high", "tip"), shapes, strict=True))
        body = gb.from_modes(w * (2.0 * modes) ** r.uniform(1, 2), ratio, points, name="body")
    K = float(w * w * 10.0 ** r.uniform(0.5, 2.5))
    law = {
        "kelvin": gb.KelvinVoigt(stiffness=K, damping=0.1 * np.sqrt(K)), "elastic": gb.KelvinVoigt(stiffness=K),
        "hunt": gb.HuntCrossley(stiffness=K / np.sqrt(g), chi=0.3 / (w * g)),
        "gap": gb.ElastoGap(stiffness=K, damping=0.1 * np.sqrt(K)), "cubic": gb.Cubic(stiffness=K, scale=g),
    }[law_kind]  # fmt: skip
    over = {f"c0.{name}": value for name, value in zip(law.kind.names, law.values, strict=True) if value}
    contacts = []
    for i, name in enumerate(("low", "high") if kind == "tube" else ("at",)):
        region = gb.Disc(g) if kind == "round" else gb.Slot(2.0 * g) if r.random() < 0.5 else gb.HalfPlane(g)
        rough: dict[str, Any] = {"friction": 0.2, "sliding": 0.05 * w * g} if kind == "round" else {}
        offset = g * r.uniform(-0.3, 0.3, 2 if kind == "round" else None)
        contacts.append(gb.Contact(body[name], region, law, name=f"c{i}", offset=offset, **rough))
        if i == 0:
            over |= {
                "c0.clearance": region.values[region.kind.names.index("clearance")],
                **({"c0.friction": 0.2} if rough else {"c0.offset": offset}),
            }
    amplitude, frequency = w * w * g * 10.0 ** r.uniform(0, 0.7), w * r.uniform(0.4, 1.6)
    along = {"direction": [1.0, 0.4]} if kind == "round" else {}
    load = gb.Force(body[at], wave, name="load", amplitude=amplitude, frequency=frequency, **along)
    over |= {"load.amplitude": amplitude, "load.frequency": frequency, "body.damping_factor": 1.0}
    figures = [f"{at}.peak", f"{at}.rms", f"{at}.harmonic_1", "c0.peak_force", "c0.impulse"]
    if kind != "tube" and (kind == "round" or law_kind not in ("elastic", "cubic")):
        figures.append("c0.work")
    return gb.Scene(body, contacts=contacts, loads=[load]), over, figures, f"{kind}, {law_kind}"


def figures_of(scene: gb.Scene, x: Any, period: float, figures: list[str]) -> tuple[Any, Any]:
    """Return figures of a period from x, and its change, by the march alone."""
    n = scene.size
    start = SceneState(0.0, x[:n, None].copy(), x[n:, None].copy(), np.zeros((0, 1)), np.zeros((scene.motions, 1)))
    found = gb.history(scene, period / STEPS, period, start)
    values = []
    for name in figures:
        owner, _, kind = name.partition(".")
        if kind == "work":
            values.append(found.last.energy["law"] + found.last.energy["friction"])
            continue
        series = (found.force if kind in ("peak_force", "impulse") else found.displacement)[owner].reshape(STEPS, -1)
        size = np.linalg.norm(series, axis=1)
        if kind == "harmonic_1":
            turns = np.exp(-2j * pi * np.arange(1, STEPS + 1) / STEPS)
            values.append(2.0 / STEPS * np.linalg.norm(turns @ series))
        else:
            mean = np.sqrt(np.mean(size**2)) if kind == "rms" else period * size.mean()
            values.append(size.max() if "peak" in kind else mean)
    end = found.last.state
    return np.array(values), np.concatenate([end.q, end.v])[:, 0] - x


def converged(scene: gb.Scene, x: Any, period: float, figures: list[str], inverse: Any) -> Any:
    """Return figures of the orbit near x, by chords down to round-off: until two of them come no nearer."""
    best, kept, idle = np.inf, np.zeros(0), 0
    for _ in range(14):
        values, miss = figures_of(scene, x, period, figures)
        off = np.abs(inverse @ miss).max()
        idle = 0 if off < 0.5 * best else idle + 1
        if off < best:
            best, kept = off, values
        if idle == 2:
            break
        x = x + inverse @ miss
    return kept


def compare(seed: int, levels: range = range(2, 6)) -> Compared:
    """Compare all slopes of a drawn orbit with Richardson differences of orbits that converge anew.

    The work is what is left of elastic work to and fro: it is measured by force times displacement.
    """
    scene, over, figures, kind = drawn(seed)
    frequency = over["load.frequency"]
    period = 2.0 * pi / frequency
    try:
        start = settled(scene, period)
    except (gb.UserError, gb.NotConverged) as error:
        return Compared(str(error), False, kind)
    try:
        found = gb.tangents(scene, figures, over, period=period, steps=STEPS, start=start)
    except (gb.UserError, gb.NotConverged) as error:
        return Compared(str(error), True, kind)
    x, n = np.concatenate([found.state.q, found.state.v])[:, 0], 2 * scene.size
    e = 1e-7 * np.repeat([np.abs(found.state.q).max(), np.abs(found.state.v).max()], scene.size)
    sides = [[figures_of(scene, x + s * e[i] * np.eye(n)[i], period, figures)[1] for i in range(n)] for s in (1, -1)]
    inverse = -np.linalg.inv((np.array(sides[0]) - np.array(sides[1])).T / (2.0 * e))
    count, worst, place, unsure = 0, 0.0, "", 0
    for path, value in over.items():
        table = []
        for level in levels:
            h, at = 1e-3 * 4.0**-level * abs(value), dict[int, Any]()
            for k in (-2, -1, 1, 2):
                T = 2.0 * pi / (value + k * h) if path == "load.frequency" else period
                at[k] = converged(scene.with_({path: value + k * h}), x, T, figures, inverse)
            table.append((8.0 * (at[1] - at[-1]) - at[2] + at[-2]) / (12.0 * h))
        apart = np.abs(np.diff(table, axis=0))
        best = apart.argmin(axis=0)
        for i, name in enumerate(figures):
            most = found.values[figures[0]] * found.values["c0.peak_force"] if name == "c0.work" else found.values[name]
            size = max(abs(table[best[i] + 1][i]), most / abs(value)) or 1.0  # 1: no contact at all
            off = abs(found.slopes[name][path] - table[best[i] + 1][i]) / size
            count += 1
            if off > RIGHT and apart[best[i], i] > RIGHT * size:
                unsure += 1
            elif off > worst:
                worst, place = off, f"{name} by {path}"
    return Compared("", True, kind, count, worst, place, unsure)


def main(words: Sequence[str]) -> int:
    """Compare drawn cases, print a line for each that is refused or off, and the table; return 1 where one is wrong."""
    cases, first = [*map(int, words[:2]), *(400, 0)[len(words) :]]
    found = [print_case(seed, compare(seed)) for seed in range(first, first + cases)]
    print(table(found))
    return int(any(not one.worst <= RIGHT for one in found))


def table(found: Sequence[Compared]) -> str:
    """Return the table of all cases, in Markdown."""
    compared = [one for one in found if not one.reason]
    off = np.array([one.worst for one in compared] or [np.nan])
    rows = {
        "drawn": len(found), "with a periodic response": sum(one.settled for one in found),
        "refused of these": sum(one.settled and bool(one.reason) for one in found), "compared": len(compared),
        "slopes compared": sum(one.slopes for one in compared),
        "whose differences are unsure": sum(one.unsure for one in compared),
        "cases with a slope off by more than 1e-7": int((off > RIGHT).sum()),
        "largest difference": f"{off.max():.1e}", "median of the largest of each case": f"{np.median(off):.1e}",
    }  # fmt: skip
    return "\n| | |\n|---|---|\n" + "\n".join(f"| {name} | {value} |" for name, value in rows.items())


def print_case(seed: int, one: Compared) -> Compared:
    """Print a case that is refused, unsure or off by a tenth of what is right, and return it."""
    if one.settled and (one.reason or one.unsure or one.worst > 0.1 * RIGHT):
        print(
            f"{seed} ({one.kind}): {one.reason or f'{one.worst:.1e} at {one.place}, {one.unsure} unsure'}", flush=True
        )
    elif seed % 20 == 0:
        print(f"{seed}: {one.worst:.1e}", flush=True)
    return one


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
