"""The thread of the output: order, errors, and how much waits."""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial

import pytest

from gapbeam.solver.run.output import output_thread
from gapbeam.solver.run.output.output_thread import WAITING, OutputThread, StuckOutput


def failing(text: str) -> Callable[[], None]:
    def fail() -> None:
        raise ValueError(text)

    return fail


@pytest.mark.parametrize("beside", [False, True])
def test_work_is_done_in_order(beside: bool) -> None:
    """All of it, in the thread or here; `wait` returns after the last."""
    done: list[tuple[int, bool]] = []

    def note(number: int) -> None:
        done.append((number, threading.current_thread() is threading.main_thread()))

    with OutputThread(beside) as output:
        for number in range(20):
            output.do(partial(note, number))
        output.wait()
        assert done == [(number, not beside) for number in range(20)]


def test_only_so_much_waits() -> None:
    """Who asks for more is held up until the first work is done."""
    go, asked = threading.Event(), threading.Event()

    def wait() -> None:
        go.wait()

    with OutputThread(beside=True) as output:

        def ask() -> None:
            for _ in range(WAITING + 1):
                output.do(wait)
            asked.set()

        asker = threading.Thread(target=ask)
        asker.start()
        assert not asked.wait(0.2)
        go.set()
        assert asked.wait(10.0)
        asker.join()


def test_all_that_is_asked_for_is_done_whatever_failed_before() -> None:
    """So that files and figures end at the same step: the error comes when the work at hand has been taken."""
    asked: list[int] = []
    done: list[int] = []

    def march() -> None:
        with OutputThread(beside=True) as output:
            output.do(failing("first"))
            for number in range(WAITING + 5):
                asked.append(number)
                output.do(partial(done.append, number))

    with pytest.raises(ValueError, match="first"):
        march()
    assert len(asked) <= WAITING + 1
    assert done == asked


def test_an_error_at_the_end_is_heard() -> None:
    """By whoever leaves without having waited."""
    with pytest.raises(ValueError, match="last"), OutputThread(beside=True) as output:
        output.do(failing("last"))


def test_an_error_of_the_march_is_not_replaced() -> None:
    """The fault of the output is not heard then."""

    def march() -> None:
        with OutputThread(beside=True) as output:
            output.do(failing("output"))
            raise KeyError

    with pytest.raises(KeyError):
        march()


def test_without_a_thread_errors_come_at_once() -> None:
    with OutputThread(beside=False) as output, pytest.raises(ValueError, match="now"):
        output.do(failing("now"))


def test_where_no_thread_can_be_started_work_is_done_in_turn(monkeypatch: pytest.MonkeyPatch) -> None:
    """As limits on processes or on memory have it."""
    done: list[bool] = []

    def start(_thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    monkeypatch.setattr(threading.Thread, "start", start)
    with OutputThread(beside=True) as output:
        output.do(lambda: done.append(threading.current_thread() is threading.main_thread()))
    assert done == [True]


@pytest.mark.parametrize("before", range(WAITING + 1))
def test_work_that_never_ends_is_given_up_once_the_run_is_to_end(
    before: int, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Wherever it is waited for, with a warning meanwhile; the thread does not keep the process."""
    monkeypatch.setattr(output_thread, "LOOK", 0.01)
    monkeypatch.setattr(output_thread, "SILENT", 0.05)
    monkeypatch.setattr(output_thread, "PATIENCE", 0.05)
    never, ends = threading.Event(), threading.Timer(0.2, lambda: asked.append(True))
    asked: list[bool] = []
    ends.start()

    def march() -> None:
        with OutputThread(True, lambda: bool(asked)) as output:
            output.do(lambda: never.wait() and None)
            for _ in range(before):
                output.do(lambda: None)

    with pytest.raises(StuckOutput, match="resume=True"):
        march()
    assert asked
    assert "waiting for the disk" in caplog.text
    assert all(thread.daemon for thread in threading.enumerate() if thread.name == "output")
    never.set()
