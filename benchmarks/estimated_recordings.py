"""Errors and coverage of estimates from synthetic recordings, which an independent march makes, for three scenes.

    environment/run python3 -m benchmarks.estimated_recordings [members] [recordings of each scene]

An oscillator above a stop, a cantilever above a stop at its tip, and a tube in three supports with play, of which the
middle one is worn; each with clearance, stiffness and damping of the contact unknown. Recordings are velocities with
2 % noise, marched by a textbook Runge-Kutta scheme of order 4 from closed modes, begun at any time.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy import stats
from scipy.optimize import brentq

import gapbeam as gb

NOISE, PERIODS, SETTLE, STEPS, SAMPLES = 0.02, 100, 60, 512, 256


class ModalScene(NamedTuple):
    """Mass-normalized modes, their shapes at contacts, load and sensor, and ranges of what is unknown."""

    frequencies: np.ndarray
    ratio: float
    touch: np.ndarray  # (contacts, modes)
    push: np.ndarray
    seen: np.ndarray
    clearance: float  # of all supports but the worn one
    both: bool  # stops on either side
    worn: int
    frequency: float
    ranges: dict[str, tuple[float, float]]


def modal_scenes() -> dict[str, ModalScene]:
    """Return the three scenes; lengths over the static deflection of the first mode, times over its radian."""
    one = np.ones(1)
    ranges = {"worn.clearance": (0.5, 2.0), "s*.stiffness": (5.0, 80.0), "s*.damping": (0.05, 1.0)}
    found = {"oscillator": ModalScene(one, 0.01, one[None], one, one, 0.0, False, 0, 0.8, ranges)}
    roots = np.array([brentq(lambda b: np.cos(b) * np.cosh(b) + 1.0, a, a + 1.5) for a in (1.2, 4.0, 7.1, 10.3)])

    def clamped(x: float) -> np.ndarray:
        s = (np.cosh(roots) + np.cos(roots)) / (np.sinh(roots) + np.sin(roots))
        shape: np.ndarray = np.cosh(roots * x) - np.cos(roots * x) - s * (np.sinh(roots * x) - np.sin(roots * x))
        return shape

    found["cantilever"] = ModalScene(
        (roots / roots[0]) ** 2, 0.01, clamped(1.0)[None], clamped(0.5), clamped(1.0), 0.0, False, 0, 0.8,
        ranges | {"worn.clearance": (0.5, 2.0)},
    )  # fmt: skip
    numbers = np.arange(1, 9)

    def pinned(x: float) -> np.ndarray:
        shape: np.ndarray = np.sqrt(2.0) * np.sin(np.pi * numbers * x)
        return shape

    found["tube"] = ModalScene(
        numbers.astype(float) ** 2, 0.01, np.array([pinned(x) for x in (0.23, 0.52, 0.77)]), pinned(0.4), pinned(0.63),
        1.0, True, 1, 0.9, {"worn.clearance": (1.0, 4.0), "s*.stiffness": (20.0, 200.0), "s*.damping": (0.05, 1.0)},
    )  # fmt: skip
    return found


def scene_of(one: ModalScene) -> gb.Scene:
    """Return the scene for the library."""
    points = {f"s{i}": row for i, row in enumerate(one.touch)} | {"push": one.push, "sensor": one.seen}
    body = gb.from_modes(one.frequencies, one.ratio, points, name="body")
    law = gb.KelvinVoigt(stiffness=20.0, damping=0.1)
    contacts = [
        gb.Contact(body[f"s{i}"], (gb.Slot if one.both else gb.HalfPlane)(one.clearance + 1.0), law, name=name)
        for i, name in enumerate(_names(one))
    ]
    return gb.Scene(body, contacts=contacts, loads=[gb.Force(body["push"], lambda t: np.cos(one.frequency * t))])


def _names(one: ModalScene) -> list[str]:
    return [f"s{i} worn" if i == one.worn else f"s{i}" for i in range(len(one.touch))]


def recorded(one: ModalScene, values: np.ndarray, draw: np.random.Generator) -> list[gb.Recording]:
    """Return recordings of members with these values, (members, 3)."""
    g, K, C = (column[:, None] for column in values.T)
    play = np.full((len(values), len(one.touch)), one.clearance + 1.0)
    play[:, one.worn] = g[:, 0]
    T, n = 2.0 * np.pi / one.frequency, 2 * STEPS
    h, first, skip = T / n, int(draw.integers(n)), n // SAMPLES
    w2, c = one.frequencies**2, 2.0 * one.ratio * one.frequencies

    def rate(t: float, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        r, s = q @ one.touch.T, v @ one.touch.T
        side = np.where(r < 0.0, -1.0, 1.0) if one.both else 1.0
        depth = side * r - (0.5 * play if one.both else play)
        force = side * np.where(depth > 0.0, np.maximum(K * depth + C * side * s, 0.0), 0.0)
        pushed: np.ndarray = one.push * np.cos(one.frequency * t) - c * v - w2 * q - force @ one.touch
        return pushed

    q, v, kept = np.zeros((len(values), len(w2))), np.zeros((len(values), len(w2))), []
    for i in range((SETTLE + 1 + PERIODS) * n + n):
        t = i * h
        a1 = rate(t, q, v)
        a2 = rate(t + h / 2, q + h / 2 * v, v + h / 2 * a1)
        a3 = rate(t + h / 2, q + h / 2 * v + h * h / 4 * a1, v + h / 2 * a2)
        a4 = rate(t + h, q + h * v + h * h / 2 * a2, v + h * a3)
        q = q + h * v + h * h / 6 * (a1 + a2 + a3)
        v = v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        if i >= SETTLE * n + first and (i - first) % skip == 0:
            kept.append(v @ one.seen)
    y = np.array(kept).T
    y = y + NOISE * np.sqrt((y**2).mean(axis=1, keepdims=True)) * draw.standard_normal(y.shape)
    return [gb.Recording(T / SAMPLES * np.arange(y.shape[1]), row, "velocity") for row in y]


def main(arguments: Sequence[str]) -> None:
    """Print a line for each scene and value, and one for all."""
    members, count = (int(arguments[i]) if len(arguments) > i else default for i, default in enumerate((4096, 100)))
    print(f"{members} members, {count} recordings of each scene")
    errors, covered, outside, seconds = [], [], [], []
    for number, (name, one) in enumerate(modal_scenes().items()):
        ranges = {path.replace("worn", f"s{one.worn} worn"): ends for path, ends in one.ranges.items()}
        found = gb.library(
            scene_of(one), {path: stats.loguniform(*ends) for path, ends in ranges.items()}, point="sensor",
            quantity="velocity", period=2.0 * np.pi / one.frequency, members=members, noise=NOISE, periods=PERIODS,
            settle=SETTLE, steps=STEPS,
        )  # fmt: skip
        draw = np.random.default_rng([11, number])
        ends = np.log(np.array(list(ranges.values())))
        true = np.exp(draw.uniform(ends[:, 0], ends[:, 1], (count, 3)))
        recordings = recorded(one, true, draw)
        begun = time.process_time()
        estimates = [gb.estimate(found, each) for each in recordings]
        seconds.append((time.process_time() - begun) / count)
        table = np.array([[(x.value, x.low, x.high) for x in each.values.values()] for each in estimates])
        error = np.abs(table[..., 0] / true - 1.0)
        inside = (table[..., 1] <= true) & (true <= table[..., 2])
        out = np.array([each.is_outside for each in estimates])
        print(f"{name}: {found.headline()}")
        for i, path in enumerate(ranges):
            middle, far = np.quantile(error[:, i], [0.5, 0.9])
            print(f"  {path}: median error {middle:.2%}, 9 of 10 below {far:.2%}, covered {inside[:, i].mean():.1%}")
        print(f"  outside {out.mean():.1%}, {1e3 * seconds[-1]:.1f} ms a recording", flush=True)
        errors.append(error)
        covered.append(inside)
        outside.append(out)
    error, inside = np.concatenate(errors), np.concatenate(covered)
    print(f"all: median error of the clearance {np.median(error[:, 0]):.2%}, covered {inside[:, 0].mean():.1%}")
    print(f"all values: covered {inside.mean():.1%}; outside {np.concatenate(outside).mean():.1%}")


if __name__ == "__main__":
    main(sys.argv[1:])
