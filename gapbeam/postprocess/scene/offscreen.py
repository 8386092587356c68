"""Off-screen drawing: a check of how this machine can draw without a window, before VTK tries, and placement of labels.

Each label goes to the first row where it covers no other one.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from functools import cache

CHOICE = "VTK_DEFAULT_OPENGL_WINDOW"
# EGL draws on a graphics card or by Mesa's software renderer; OSMesa by software only.
WITHOUT_SCREEN = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")

_SECONDS = 120
_TRIAL = """
import pyvista
plotter = pyvista.Plotter(off_screen=True, window_size=(32, 32))
plotter.add_mesh(pyvista.Sphere(), color="red")
picture = plotter.screenshot(return_img=True)
raise SystemExit(0 if picture.std() > 0 else 3)
"""


class RenderError(RuntimeError):
    """Pictures cannot be drawn here, or there is nothing to draw."""

    exit_status = 1


@cache
def prepare_offscreen() -> str:
    """Choose the way to draw off-screen and pass it to VTK through its environment variable.

    Every way is tried in a process of its own, since VTK ends the process where OpenGL cannot be started.

    Returns:
        Name of the VTK window class; "" for VTK's own choice.

    Raises:
        RenderError: No way works; holds what each of them said.
    """
    failures = []
    for name in _candidates():
        environment = {key: value for key, value in os.environ.items() if key != CHOICE}
        if name:
            environment[CHOICE] = name
        try:
            trial = subprocess.run(
                [sys.executable, "-c", _TRIAL],
                env=environment,
                capture_output=True,
                text=True,
                timeout=_SECONDS,
                check=False,
            )
        except subprocess.TimeoutExpired:
            failures.append(f"{name or 'default'}: no picture within {_SECONDS} s")
            continue
        if trial.returncode == 0:
            os.environ.pop(CHOICE, None)
            if name:
                os.environ[CHOICE] = name
            return name
        said = [line.strip() for line in (trial.stderr or trial.stdout).splitlines() if line.strip()]
        failures.append(f"{name or 'default'}: {said[-1] if said else f'ended with status {trial.returncode}'}")
    raise RenderError(
        "nothing can be drawn off-screen here: " + "; ".join(failures) + ". To try: install libegl1 with "
        "libgl1-mesa-dri (Debian), or libosmesa6, or run in `environment/run`, where they are"
    )


def _candidates() -> list[str]:
    chosen = os.environ.get(CHOICE, "")
    own = [""] if sys.platform != "linux" or os.environ.get("DISPLAY") else []
    return list(dict.fromkeys([*([chosen] if chosen else []), *WITHOUT_SCREEN, *own]))


def rows_of(spans: Sequence[tuple[float, float]], most: int, apart: float) -> list[int | None]:
    """Return the row of each label, 0 being nearest; None: no row has room for it.

    Args:
        spans: Where labels begin and end.
        most: Rows.
        apart: Room between two labels of a row.
    """
    rows: list[list[tuple[float, float]]] = [[] for _ in range(most)]
    found = list[int | None]()
    for first, last in spans:
        free = (
            number
            for number, row in enumerate(rows)
            if all(last + apart <= begin or first >= end + apart for begin, end in row)
        )
        found.append(next(free, None))
        if found[-1] is not None:
            rows[found[-1]].append((first, last))
    return found
