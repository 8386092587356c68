"""Figure: bending modes of a body in its three states of contact, beside those of the theory."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from gapbeam.postprocess.figures.figure_style import BLACK, BLUE, GRAY, VERMILION, journal_style, letter, panels

STYLES = {"seated": (BLACK, "-"), "closed": (VERMILION, "--"), "free": (BLUE, ":")}
COLUMNS = 2


def draw_mode_shapes(modes: Mapping[str, Any], path: Path) -> Path:
    """Draw the motion of the axis in the first bending modes, the largest 1 and upward at the tip.

    Args:
        modes: What `modes.json` holds.
        path: Of the picture, PNG.

    Returns:
        The path.
    """
    count = int(modes.get("count") or len(modes["free"]))  # studies of earlier releases do not say
    rows = -(-count // COLUMNS)
    with journal_style():
        figure, axes = panels(rows, COLUMNS, height=1.6, sharex=True)
        for number, panel in enumerate(axes.flat):
            if number >= count:
                panel.set_visible(False)
                continue
            panel.axhline(0.0, color=GRAY, linewidth=0.5)
            words = []
            for state in modes["states"]:
                bending = [mode for mode in state["modes"] if mode["kind"] == "bending"]
                if number >= len(bending):
                    continue
                shape = np.array(bending[number]["motion"])
                color, line = STYLES[state["name"]]
                panel.plot(
                    1e3 * np.array(state["x"]), shape * np.sign(shape[-1]), color=color, linestyle=line,
                    label=state["name"],
                )  # fmt: skip
                words.append(f"{bending[number]['frequency']:.4g}")
            panel.set_title(f"mode {number + 1}: {', '.join(words)} Hz", fontsize=8.0)
            panel.set_ylim(-1.15, 1.15)
        for panel in axes[-1]:
            panel.set_xlabel("x (mm)")
        letter([panel for panel in axes.flat if panel.get_visible()])
        figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=3)
        figure.savefig(path)
    return path
