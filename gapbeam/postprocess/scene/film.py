"""Films: frames to mp4 by ffmpeg, to GIF where there is no ffmpeg.

How this machine can draw without a window is checked before VTK tries.

Each label goes to the first row where it covers no other one.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path

import numpy as np
from PIL import Image

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
def prepare_offscreen() -> None:
    """Choose the way to draw off-screen and pass it to VTK through its environment variable.

    Every way is tried in a process of its own, since VTK ends the process where OpenGL cannot be started.

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
            return
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
        spans: Start and end of each label.
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


# One thread, as it works beside the one that draws, and motion refined once (subme) take a sixth off the processor time
# of veryfast at the same quality; films are a twentieth to a tenth larger.
_ENCODING = ["-c:v", "libx264", "-preset", "veryfast", "-crf", "18", "-threads", "1", "-x264-params", "subme=1"]
_ENCODING += ["-movflags", "+faststart"]


def write_film(path: Path, frames: Iterable[np.ndarray], frames_per_second: float) -> Path:
    """Write a film.

    Args:
        path: Path without suffix.
        frames: Pictures of one size, (height, width, 3 or 4), 8 bits, each written before the next one is asked for.
        frames_per_second: Speed of the film.

    Returns:
        `path` with suffix .mp4 (H.264, plays everywhere), or .gif without ffmpeg.

    Raises:
        RenderError: ffmpeg refused, or there is no frame.
    """
    program = _ffmpeg()
    if program is None:
        return _gif(path.with_suffix(".gif"), frames, frames_per_second)
    return _mp4(program, path.with_suffix(".mp4"), frames, frames_per_second)


def _mp4(program: str, path: Path, frames: Iterable[np.ndarray], frames_per_second: float) -> Path:
    process: subprocess.Popen[bytes] | None = None
    said = path.with_suffix(".ffmpeg.log")
    with said.open("wb") as log:
        for frame in frames:
            if process is None:
                height, width = frame.shape[:2]
                layout = "rgb24" if frame.shape[2] == 3 else "rgb0"
                command = [program, "-y", "-loglevel", "error", "-f", "rawvideo", "-pix_fmt", layout]
                command += ["-s", f"{width}x{height}", "-r", f"{frames_per_second:g}", "-i", "-"]
                if height % 2 or width % 2:  # H.264 in yuv420p wants even sizes
                    command += ["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2:color=white"]
                command += ["-pix_fmt", "yuv420p", *_ENCODING, str(path)]
                process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=log, stderr=log)
            assert process.stdin is not None
            try:
                process.stdin.write(np.ascontiguousarray(frame).data)
            except BrokenPipeError:
                break
        if process is None:
            raise RenderError("no frames for the film")
        assert process.stdin is not None
        process.stdin.close()
        status = process.wait()
    words = said.read_text(errors="replace").strip()
    said.unlink()
    if status != 0:
        raise RenderError(f"{program} made no film {path} (status {status}): {words[-300:]}")
    return path


def _gif(path: Path, frames: Iterable[np.ndarray], frames_per_second: float) -> Path:
    pictures = [Image.fromarray(frame).convert("RGB").quantize(128) for frame in frames]
    if not pictures:
        raise RenderError("no frames for the film")
    pictures[0].save(
        path,
        save_all=True,
        append_images=pictures[1:],
        duration=max(20, round(1000 / frames_per_second)),
        loop=0,
    )
    return path


def _ffmpeg() -> str | None:
    program = shutil.which("ffmpeg")
    if program is None:
        try:
            import imageio_ffmpeg  # type: ignore[import-not-found,import-untyped,unused-ignore]

            program = str(imageio_ffmpeg.get_ffmpeg_exe())
        except (ImportError, RuntimeError):
            return None
    return program
