"""Accounts and recorder of a march as text that numbers survive to the last bit."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite
from typing import Any

import numpy as np

from gapbeam.solver.diagnostics.history_rows import Recorder
from gapbeam.solver.diagnostics.march_diagnostics import Accounts
from gapbeam.solver.diagnostics.point_contact import KEPT

LEDGER = "ledger"
PARTS = ("gates", "episodes", "peaks", "times", "tally", "sliding")
NOT_KEPT = {"limits", "contact", "dt", "by_depth", "remedy"}
RECORDED = ("largest_restraint_energy", "largest_energy", "_last_time")
WATCHED = ("closest", "due", "highest", "at_start", "looks")
PROBES = ("_last_place", "_last_velocity")
PAIR = 2  # numbers that are kept of a face
MALFORMED = (KeyError, TypeError, ValueError, AttributeError, OverflowError)


def as_json(accounts: Accounts, recorder: Recorder) -> dict[str, Any]:
    """Return everything that accounts and recorder keep, for JSON."""
    kept = {
        name: {key: _plain(value) for key, value in vars(getattr(accounts, name)).items() if key not in NOT_KEPT}
        for name in PARTS
    }
    watch = recorder.watch
    return kept | {
        "impacts": accounts.impacts.as_json(),
        "statistics": None if recorder.statistics is None else recorder.statistics.as_json(),
        "points": None if recorder.points is None else recorder.points.as_json(),
        "watch": None if watch is None else {key: _plain(getattr(watch, key)) for key in WATCHED},
        LEDGER: {key: _plain(value) for key, value in vars(accounts.ledger).items()},
        "time": accounts.time,
        "recorder": {key: _plain(getattr(recorder, key)) for key in (*RECORDED, *PROBES)},
    }


def restore(accounts: Accounts, recorder: Recorder, data: dict[str, Any]) -> None:
    """Restore new accounts and a new recorder from a checkpoint.

    Raises:
        KeyError: Something is missing; likewise the others of `MALFORMED` where it is not of the right form.
    """
    ledger = {key: _like(value, data[LEDGER][key]) for key, value in vars(accounts.ledger).items()}
    accounts.ledger = replace(accounts.ledger, **ledger)
    for name in PARTS:
        part = getattr(accounts, name)
        for key, value in vars(part).items():
            if key not in NOT_KEPT:
                setattr(part, key, _like(value, data[name][key]))
    accounts.impacts.restore(data["impacts"])
    accounts.time = float(data["time"])
    seen = data["recorder"]
    for key in RECORDED:
        setattr(recorder, key, None if seen[key] is None else _like(0.0, seen[key]))
    if recorder.watch is not None:
        for key in WATCHED:
            setattr(recorder.watch, key, _like(getattr(recorder.watch, key), data["watch"][key]))
    if recorder.statistics is not None:
        recorder.statistics.restore(data["statistics"])
    if recorder.points is not None:
        for key in KEPT:
            setattr(recorder.points, key, _like(getattr(recorder.points, key), data["points"][key]))
    form = np.zeros((1, len(recorder.labels["probe"]), len(recorder.labels["component"])))
    for key in PROBES:
        setattr(recorder, key, None if seen[key] is None else _like(form, seen[key]))


def _plain(value: Any) -> Any:
    if isinstance(value, dict):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, tuple):
        return [_plain(entry) for entry in value]
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return value


def _like(value: Any, stored: Any) -> Any:
    """Return a stored value in the form of its value at a start; infinite only as there."""
    if isinstance(value, np.ndarray):
        array = np.array(stored, dtype=float)
        if array.shape != value.shape or not np.all(np.isfinite(array) | (array == value)):
            raise ValueError(f"an array of shape {array.shape}, expected finite numbers of shape {value.shape}")
        return array
    if isinstance(value, dict):
        return {int(key): _entry(entry) for key, entry in stored.items()}
    if isinstance(stored, bool) or not isinstance(stored, int | float) or not (isfinite(stored) or stored == value):
        raise TypeError(f"{stored!r}, expected a number")
    if isinstance(value, int) and not (isinstance(stored, int) and stored >= 0):
        raise TypeError(f"{stored!r}, expected a count")
    return type(value)(stored)


def _entry(stored: Any) -> Any:
    """Return the stored entry of a face: a switch, or a pair of finite numbers."""
    if isinstance(stored, bool):
        return stored
    if len(stored) != PAIR or not all(isinstance(number, int | float) and isfinite(number) for number in stored):
        raise TypeError(f"{stored!r}, expected two numbers")
    return tuple(stored)
