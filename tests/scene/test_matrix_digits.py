"""Files of matrices whose digits leave frequencies unknown: a warning where the first is off, and nowhere else.

Bernoulli beams of drawn meshes are printed with few digits. Their frequencies with all digits are SciPy's.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
import scipy.linalg as sl
import scipy.sparse as sp

import gapbeam as gb

RIGID = 2
Matrix = np.ndarray
Print = Callable[[float], str]


def drawn_beam(rng: np.random.Generator, elements: int) -> tuple[Matrix, Matrix, Matrix]:
    """Return K and M of a free beam along x, as mm, t and s, and places of its nodes, mm."""
    lengths = 1e3 * rng.dirichlet(np.full(elements, 9.0 if rng.integers(2) else 1e9))  # irregular or even
    stiff, heavy = rng.uniform(1e8, 3e8), rng.uniform(1e-7, 1e-6)  # E I and mass per length
    K, M = np.zeros((2, 2 * elements + 2, 2 * elements + 2))
    for i, a in enumerate(lengths):
        at, turn = slice(2 * i, 2 * i + 4), np.diag([1.0, -a, 1.0, -a])
        bend = [[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]]
        move = [[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]
        K[at, at] += stiff / a**3 * turn @ bend @ turn
        M[at, at] += heavy * a / 420.0 * turn @ move @ turn
    return K, M, np.concatenate([[0.0], np.cumsum(lengths)])


def small_field(value: float) -> str:
    """Return a number in 8 characters, as Nastran prints it: the exponent without its letter."""
    for digits in range(6, -1, -1):
        mantissa, exponent = f"{value:.{digits}E}".split("E")
        if len(text := f"{mantissa}{int(exponent):+d}") <= 8:
            return text
    raise AssertionError(value)


def dmig(path: Path, A: Matrix, printed: Print, width: int) -> None:
    star = "*" if width == 16 else ""
    lines = ["DMIG    AAX     " + "".join(f"{one:>8}" for one in (0, 6, 2, 0))]
    for j in range(len(A)):
        lines.append(f"{'DMIG' + star:<8}{'AAX':<{width}}{j // 2 + 1:>{width}}{3 + 2 * (j % 2):>{width}}")
        lines += [
            f"{star:<8}{i // 2 + 1:>{width}}{3 + 2 * (i % 2):>{width}}{printed(A[i, j]):>{width}}"
            for i in range(j, len(A)) if A[i, j]
        ]  # fmt: skip
    path.write_text("\n".join(lines) + "\n")


def market(path: Path, A: Matrix, printed: Print) -> None:
    i, j = np.nonzero(A)
    rows = [f"{a + 1} {b + 1} {printed(A[a, b])}" for a, b in zip(i, j, strict=True)]
    head = ["%%MatrixMarket matrix coordinate real general", f"{len(A)} {len(A)} {len(i)}"]
    path.write_text("\n".join(head + rows) + "\n")


def matrix_input(path: Path, A: Matrix, printed: Print) -> None:
    i, j = np.nonzero(np.tril(A))
    path.write_text("*MATRIX INPUT, NAME=A\n" + "".join(
        f"{a // 2 + 1},{3 + 2 * (a % 2)},{b // 2 + 1},{3 + 2 * (b % 2)},{printed(A[a, b])}\n"
        for a, b in zip(i, j, strict=True)
    ))  # fmt: skip


def read(
    folder: Path, kind: str, K: Matrix, M: Matrix, x: Matrix | None, printed: Print, held: bool = False,
    points: Mapping[str, str] = MappingProxyType({}),
) -> gb.Structure:  # fmt: skip
    files = []
    for name, A in (("k", K), ("m", M)):
        files.append(folder / f"{name}.{'pch' if kind in ('small', 'large') else 'mtx'}")
        if kind in ("small", "large"):
            dmig(files[-1], A, printed, 16 if kind == "large" else 8)
        elif kind in ("market", "general"):
            market(files[-1], A, printed)
        else:
            matrix_input(files[-1], A, printed)
    nodes, dofs = folder / "nodes.txt", folder / "rows.dof"
    if x is None:
        return gb.read_structure(*files, units="mm-t-s")
    nodes.write_text("".join(f"{i} {at:.17g} 0 0\n" for i, at in enumerate(x, 1)))
    dofs.write_text("".join(f"{i}.3\n{i}.5\n" for i in range(1, len(x) + 1)))
    return gb.read_structure(
        *files,
        units="mm-t-s",
        nodes=nodes,
        dofs=dofs if kind in ("market", "general") else None,
        clamped=[1] if held else [],
        points=points,
    )


def as_read(text: str) -> float:
    """Return the number of a text; of Nastran's exponents without a letter too."""
    return float(
        text
        if "e" in text.lower() or text[1:].isdecimal()
        else text[0] + text[1:].replace("+", "e+").replace("-", "e-")
    )


def read_or_words(reading: Callable[[], gb.Structure]) -> gb.Structure | str:
    """Return the structure, or the words of its refusal."""
    try:
        return reading()
    except gb.UserError as error:
        return str(error)


def drawn(kind: str, count: int) -> Iterator[tuple[Matrix, Matrix, Matrix, Print, bool]]:
    rng = np.random.default_rng(sum(map(ord, kind)))
    for _ in range(count):
        digits = int(rng.integers(3, 11))
        printed: Print = small_field if kind == "small" else lambda value, n=digits - 1: f"{value:.{n}e}"  # type: ignore[misc]
        if kind == "general":
            printed = lambda value, n=digits: f"{value:#.{n}g}"  # type: ignore[misc]  # noqa: E731
        yield *drawn_beam(rng, int(rng.integers(3, 40))), printed, bool(rng.integers(2))


@pytest.mark.parametrize("kind", ["small", "large", "market", "general"])
def test_a_first_frequency_that_is_off_is_said(tmp_path: Path, kind: str, caplog: pytest.LogCaptureFixture) -> None:
    """Off by 1 %: a warning or a refusal; nothing is said where it is not, but for lucky draws."""
    errors: dict[bool, list[float]] = {False: [], True: []}
    for K, M, x, printed, held in drawn(kind, 40):
        caplog.clear()
        made = read_or_words(partial(read, tmp_path, kind, K, M, x, printed, held))
        said = "digits" in (made if isinstance(made, str) else caplog.text)
        kept = 0 if isinstance(made, str) or made.rigid is None else made.rigid.shape[1]
        free, still = slice(RIGID if held else 0, None), 0 if held else RIGID
        cut = [np.vectorize(lambda a, p=printed: as_read(p(a)) if a else 0.0)(A)[free, free] for A in (K, M)]
        true = sl.eigh(K[free, free], M[free, free], eigvals_only=True)[still]
        found = sl.eigh(*cut, eigvals_only=True)[: still + 1]
        off = abs(np.sqrt(abs(found[still]) / true) - 1.0)
        stray = np.sqrt(
            np.abs(found[: still - kept]).max(initial=0.0) / true
        )  # rigid motions that are not seen as such
        errors[said].append(max(off, stray))
    assert np.median(errors[True]) > 0.01
    assert max(errors[False], default=0.0) < 0.01
    assert kind == "small" or len(errors[False]) > 5


@pytest.mark.parametrize("kind", ["large", "market", "input"])
def test_all_digits_say_nothing(tmp_path: Path, kind: str, caplog: pytest.LogCaptureFixture) -> None:
    """Coarse beams with ten digits, fine ones with 16; and a chain of springs of round numbers, which is exact."""
    rng = np.random.default_rng(3)
    for elements, digits in ((4, 9), (40, 15)):
        if kind != "large" or digits == 9:
            read(tmp_path, kind, *drawn_beam(rng, elements), lambda value, n=digits: f"{value:.{n}e}", held=True)  # type: ignore[misc]
    n = 60
    K = 1250.0 * (2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    read(tmp_path, kind, K, 0.5 * np.eye(n), None, lambda value: f"{value:.6e}")
    assert "digits" not in caplog.text


@pytest.mark.parametrize("size", [200, 700])
def test_matrices_of_single_precision(tmp_path: Path, size: int, caplog: pytest.LogCaptureFixture) -> None:
    """Single precision is seen in binary files: of few and of many DOFs."""
    rng = np.random.default_rng(size)
    K, M, _ = drawn_beam(rng, size // 2)
    with caplog.at_level(logging.WARNING, "gapbeam"):
        for kind, said in ((float, False), (np.float32, True)):
            for name, A in (("k", K), ("m", M)):
                sp.save_npz(tmp_path / f"{name}.npz", sp.csr_matrix(A[2:, 2:].astype(kind).astype(float)))
            made = read_or_words(lambda: gb.read_structure(tmp_path / "k.npz", tmp_path / "m.npz", units="mm-t-s"))
            assert ("digits" in (made if isinstance(made, str) else caplog.text)) == said


@pytest.mark.parametrize("digits", [3, 4, 6])
def test_modes_keep_what_their_digits_hold(tmp_path: Path, digits: int) -> None:
    """Modes do not cancel: frequencies and the static flexibility of a cantilever's tip are off by the digits only."""
    K, M, _ = drawn_beam(np.random.default_rng(digits), 12)
    squares, X = sl.eigh(K[2:, 2:], M[2:, 2:])
    table = np.column_stack([np.sqrt(squares) / (2 * np.pi), X[-2]])
    np.savetxt(
        tmp_path / "modes.csv", table, delimiter=",", header="frequency,tip", comments="", fmt=f"%.{digits - 1}e"
    )
    arm = gb.read_modes(tmp_path / "modes.csv")
    unit = 0.5 * 10.0 ** (1 - digits)
    assert np.sqrt(np.diag(arm.K)) == pytest.approx(np.sqrt(squares), rel=1.01 * unit)
    b = arm["tip"].rows[0]
    assert b @ (b / np.diag(arm.K)) == pytest.approx(float(X[-2] @ (X[-2] / squares)), rel=4.1 * unit)


DERIVED: list[Callable[[gb.Structure], gb.Structure]] = [
    lambda one: one,
    lambda one: one.reduced(4),
    lambda one: gb.reduced_at_points(one, 3),
    lambda one: gb.reduced_at_points(one.with_masses({one["tip"]: 1e-6}), 3),
    lambda one: gb.in_fluid(one, {"mid": 0.1, "tip": 0.2}, 1e-6),
]


@pytest.mark.parametrize("kind", ["small", "market", "general"])
def test_runs_carry_the_doubt(tmp_path: Path, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the first frequency is off by a fifth the run ends with status 4; less widens the errors of its figures."""
    monkeypatch.setenv("GAPBEAM_ERRORS", "companions")
    ended: set[int] = set()
    for number, (K, M, x, printed, _) in enumerate(drawn(kind, 25)):
        ends = {"mid": f"{len(x) // 2 + 1}.3", "tip": f"{len(x)}.3"}
        made = read_or_words(partial(read, tmp_path, kind, K, M, x, printed, True, ends))
        if isinstance(made, str):
            continue
        true = np.sqrt(sl.eigh(K[RIGID:, RIGID:], M[RIGID:, RIGID:], eigvals_only=True)[0])
        off = abs(np.sqrt(abs(made.modes[0][0])) / true - 1.0)
        arm = DERIVED[number % len(DERIVED)](made)
        push = gb.Force(arm["tip"], lambda t, w=true: np.sin(0.3 * w * t), name="push")  # type: ignore[misc]
        step = np.pi / true / 100.0  # an array's number
        given: dict[str, Any] = {"step": step, "end": 200 * step, "overwrite": True}
        run = gb.run(gb.Scene(arm, loads=[push]), output=tmp_path / "run", **given)
        part = 0.0 if made.doubt is None else made.doubt.part
        ended.add(run.exit_status)
        assert run.exit_status == (4 if part > 0.1 else 0)
        assert off < 0.2 or run.exit_status == 4
        gates = {"failures": {"digits_of_matrices": "never"}}
        accepted = gb.run(gb.Scene(arm, loads=[push]), output=tmp_path / "run", gates=gates, **given)
        assert ("digits" in "".join(accepted.summary["warnings"])) == (part > 0.0)
        figures = [one for one in accepted.summary["errors"]["figures"] if one["error"] is not None]
        assert figures
        assert all(one["error"] >= 0.999 * part * abs(one["value"]) for one in figures)
        exact = {"warnings": {"digits_of_matrices": "never"}}  # the entries are exact, as the user says
        known = gb.run(gb.Scene(arm, loads=[push]), output=tmp_path / "run", gates=exact, **given)
        assert known.exit_status == 0
        assert not any("digits of matrices" in one["differences"] for one in known.summary["errors"]["figures"])
    assert ended == ({4} if kind == "small" else {0, 4})
