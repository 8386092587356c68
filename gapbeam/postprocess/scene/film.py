"""Films: frames to mp4 by ffmpeg, to GIF where there is no ffmpeg."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from PIL import Image

from gapbeam.postprocess.scene.offscreen import RenderError

# One thread, as it works beside the one that draws, and motion refined once (subme) take a sixth off the processor time
# of veryfast at the same quality; films are a twentieth to a tenth larger.
_ENCODING = ["-c:v", "libx264", "-preset", "veryfast", "-crf", "18", "-threads", "1", "-x264-params", "subme=1"]
_ENCODING += ["-movflags", "+faststart"]


def write_film(path: Path, frames: Iterable[np.ndarray], frames_per_second: float) -> Path:
    """Write a film.

    Args:
        path: Without suffix.
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
