"""Messages and wall time of the parts of a program, each without the parts within it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import wraps
from typing import Any

from benchmarks.messages import Sent, so_far

Watched = Mapping[str, Sequence[tuple[Any, str]]]
"""Owners of functions, classes or modules with the names of the functions, by part."""


@dataclass
class Account:
    """Messages and wall time of each part so far, by its name.

    Attributes:
        sent: What it sent.
        seconds: Wall time, s.
        calls: How often it was entered.
    """

    sent: dict[str, Sent] = field(default_factory=dict)
    seconds: dict[str, float] = field(default_factory=dict)
    calls: dict[str, int] = field(default_factory=dict)
    _open: list[str] = field(default_factory=list)
    _mark: tuple[Sent, float] = field(default_factory=lambda: (Sent(), 0.0))

    @contextmanager
    def part(self, name: str) -> Iterator[None]:
        """Enter to a part what is sent and taken within, but for the parts within."""
        self._turn()
        self._open.append(name)
        self.calls[name] = self.calls.get(name, 0) + 1
        try:
            yield
        finally:
            self._turn()
            self._open.pop()

    @contextmanager
    def watching(self, watched: Watched) -> Iterator[None]:
        """Enter every call of some functions to their parts."""
        kept = [(owner, name, getattr(owner, name)) for functions in watched.values() for owner, name in functions]
        for part, functions in watched.items():
            for owner, name in functions:
                setattr(owner, name, self._watched(part, getattr(owner, name)))
        try:
            yield
        finally:
            for owner, name, function in kept:
                setattr(owner, name, function)

    def figures(self) -> dict[str, dict[str, float]]:
        """Return calls, messages, collective operations, their bytes and times by part."""
        return {
            name: {
                "calls": float(self.calls[name]),
                "messages": sent.calls["send"],
                "message_bytes": sent.bytes["send"],
                "collectives": sent.collective("calls"),
                "collective_bytes": sent.collective("bytes"),
                "seconds": self.seconds[name],
                "in_mpi": sum(sent.seconds.values()),
            }
            for name, sent in self.sent.items()
        }

    def _watched(self, part: str, function: Callable[..., Any]) -> Callable[..., Any]:
        @wraps(function)
        def entered(*arguments: Any, **named: Any) -> Any:
            with self.part(part):
                return function(*arguments, **named)

        return entered

    def _turn(self) -> None:
        """Enter what came since the last turn to the part that is open."""
        now = so_far(), time.perf_counter()
        if self._open:
            name = self._open[-1]
            self.sent[name] = self.sent.get(name, Sent()).plus(now[0].minus(self._mark[0]))
            self.seconds[name] = self.seconds.get(name, 0.0) + now[1] - self._mark[1]
        self._mark = now
