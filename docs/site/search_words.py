"""Words of practice by which the search of the site finds a page first, though the page may not say them.

They become entries of the index, which the search ranks above the text of pages.
"""

from __future__ import annotations

SEARCH_WORDS = {
    "explanation/contact-formulations.md": ("bumper", "hertz", "lcp", "pipe whip", "restitution", "unilateral contact"),
    "explanation/friction.md": ("coulomb", "friction", "stick-slip"),
    "how-to/account-for-a-fluid.md": ("added mass", "buoyancy", "water"),
    "how-to/aim-a-barrel-in-sleeves.md": ("barrel", "gun", "recoil"),
    "how-to/bring-your-own-structure.md": ("abaqus", "ansys", "backlash", "craig-bampton", "nastran", "snubber"),
    "how-to/count-impacts-and-cycles.md": ("chatter", "fatigue", "impact", "lift-off", "rainflow"),
    "how-to/find-modes-and-end-springs.md": ("eigenfrequency", "modal analysis", "natural frequency", "resonance"),
    "how-to/find-out-whether-flow-makes-a-tube-unstable.md": (
        "connors", "fluidelastic instability", "flutter", "freeplay", "tube bundle",
    ),
    "how-to/find-periodic-responses.md": ("floquet", "harmonic balance", "limit cycle"),
    "how-to/hold-a-beam-without-play.md": ("bolt", "cantilever", "clamp"),
    "how-to/keep-a-clip-from-rattling.md": ("buzz", "rattle", "squeak"),
    "how-to/place-several-supports.md": ("bumper", "clearance", "freeplay", "gap", "loose support", "stop"),
    "how-to/predict-wear.md": ("archard", "fretting", "wear", "work rate"),
    "how-to/put-a-tube-in-cross-flow.md": ("cross flow", "heat exchanger", "steam generator", "tube bundle"),
    "how-to/put-a-tube-in-holes.md": ("bushing", "fuel rod", "loose support", "orifice", "valve stem"),
    "how-to/stop-a-pipe-in-an-earthquake.md": ("earthquake", "pipe whip", "seismic", "snubber"),
    "tutorials/tube-in-baffles.md": ("baffle", "impact", "tube support plate"),
}  # fmt: skip
"""Page: its words, lower case. A word has at most three pages, so that all of them are among the first results."""


def with_search_words(page: str, words: tuple[str, ...]) -> str:
    """Return a page with entries of the index below its title.

    Args:
        page: Markdown that begins with its title.
        words: Entries, without commas.
    """
    title, _, rest = page.partition("\n")
    return f"{title}\n\n```{{index}} {', '.join(f'! {word}' for word in words)}\n```\n{rest}"
