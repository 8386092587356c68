"""Draw the frame of a beam in its support: axes, base, gland, clearance and probe, as docs/pictures/frame.svg.

environment/run python3 docs/pictures/frame_drawing.py
"""

from __future__ import annotations

from pathlib import Path

FILE = Path(__file__).with_name("frame.svg")
BEAM, PAD, DARK, LINE = "#7aa6c2", "#c9c2b2", "#33393d", "#b3541e"
WIDTH, HEIGHT = 760, 270


def box(x: float, y: float, width: float, height: float, color: str) -> str:
    """Return a filled rectangle with an outline."""
    return f'<rect x="{x}" y="{y}" width="{width}" height="{height}" fill="{color}" stroke="{DARK}"/>'


def label(x: float, y: float, text: str, anchor: str = "start", color: str = DARK) -> str:
    """Return a text."""
    return f'<text x="{x}" y="{y}" text-anchor="{anchor}" fill="{color}">{text}</text>'


def arrow(x0: float, y0: float, x1: float, y1: float, color: str = DARK, *, both: bool = False) -> str:
    """Return an arrow from one point to another, with two heads where it measures."""
    start = ' marker-start="url(#head)"' if both else ""
    return f'<path d="M{x0} {y0}L{x1} {y1}" stroke="{color}" fill="none" marker-end="url(#head)"{start}/>'


def drawing() -> str:
    """Return the drawing as SVG."""
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
        'font-family="sans-serif" font-size="15">',
        "<title>A beam on the base of its support; the clearance is open below the gland</title>",
        '<defs><marker id="head" viewBox="0 0 10 10" refX="9" refY="5" markerWidth="8" markerHeight="8" '
        f'orient="auto-start-reverse"><path d="M0 0L10 5L0 10z" fill="{DARK}"/></marker></defs>',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="white"/>',
        box(60, 36, 150, 44, PAD),
        box(60, 150, 150, 44, PAD),
        box(60, 104, 560, 46, BEAM),
        f'<path d="M60 127H640" stroke="{DARK}" stroke-dasharray="12 4 2 4"/>',
        label(135, 63, "gland", "middle"),
        label(135, 177, "base", "middle"),
        label(420, 122, "beam", "middle"),
        arrow(240, 80, 240, 104, LINE, both=True),
        f'<path d="M210 80H252" stroke="{LINE}" stroke-dasharray="3 3"/>',
        label(250, 97, "clearance", color=LINE),
        arrow(60, 218, 210, 218, both=True),
        label(135, 236, "support.length", "middle"),
        arrow(60, 252, 620, 252, both=True),
        label(420, 246, "beam.length", "middle"),
        arrow(600, 150, 600, 104, both=True),
        label(592, 143, "thickness", "end"),
        arrow(640, 127, 700, 127),
        label(708, 132, "x"),
        arrow(60, 127, 60, 20),
        label(68, 26, "y (2D), z (3D)"),
        label(52, 132, "x = 0", "end"),
        arrow(350, 30, 350, 102),
        label(358, 44, "load"),
        f'<circle cx="620" cy="127" r="5" fill="{LINE}"/>',
        label(628, 98, "probe", color=LINE),
        "</svg>",
    ]
    return "\n".join(parts) + "\n"


if __name__ == "__main__":
    FILE.write_text(drawing(), encoding="utf-8")
