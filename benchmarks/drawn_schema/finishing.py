"""Completion of a drawn case: names, directions, and sizes that follow from other tables.

Segments have another section or material, in the longest part of the beam without supports.
"""

from __future__ import annotations

from itertools import pairwise
from math import pi
from operator import itemgetter
from typing import Any

from pydantic import BaseModel, TypeAdapter

from benchmarks.drawn_schema.rules import LeftOut
from benchmarks.drawn_schema.tables import Draw
from gapbeam.solver.case.beam_profile import Beam, PlacedSegment, Segment
from gapbeam.solver.case.case import Case, Mesh, Probe
from gapbeam.solver.case.solution_tables import BeamModel, ReducedModel
from gapbeam.solver.contact.laws.law_choice import Law
from gapbeam.solver.contact.laws.law_tables import ChosenLaw
from gapbeam.solver.integrators.scheme_choice import Scheme
from gapbeam.solver.integrators.time_scheme import SOFT_CONTACT, TimeScheme
from gapbeam.solver.loads.load_choice import Load
from gapbeam.solver.schema.table import models_in, type_name
from gapbeam.solver.sections.section_choice import SectionChoice
from gapbeam.solver.supports.regions.region import AroundRegion
from gapbeam.solver.supports.regions.region_choice import Hole, RegionChoice
from gapbeam.solver.supports.support import SupportBody

SEGMENTED = 0.15  # share of the cases
MARGIN = 0.1  # of the free part, on either side
SECTIONS = models_in(SectionChoice)


def drawn_segments(draw: Draw) -> list[dict[str, Any]]:
    """Draw the segment of a few cases, without its place."""
    if not _asked(draw) and draw.chance.random() > SEGMENTED:
        return []
    return [draw.table(PlacedSegment)]


def with_segments(draw: Draw, whole: dict[str, Any]) -> dict[str, Any]:
    """Return the tables of a case with its segment where it fits, and a beam and a mesh that its section fits to."""
    if not whole.get("segment"):
        return {key: value for key, value in whole.items() if key != "segment"}
    (segment,) = whole["segment"]
    if _asked(draw) and draw.focus.key == "section" and draw.focus.value in map(type_name, SECTIONS):
        kind = segment["section"]["type"]
        if kind == "polygon":  # drawn as thick as the beam
            segment = {key: value for key, value in segment.items() if key != "thickness"}
        kept = {key: value for key, value in whole["mesh"].items() if key not in ("cell", "plane")}
        section = {"type": "round" if kind in ("round", "tube") else "rectangle"}
        whole = whole | {"beam": whole["beam"] | {"section": section}, "mesh": kept | {"dimension": 3}}
    else:
        segment = {key: value for key, value in segment.items() if key != "section"}
    start, end = _free_part(draw, whole["support"])
    margin = MARGIN * (end - start)
    place = {"name": "part", "from": round(start + margin, 6), "to": round(end - margin, 6)}
    return whole | {"segment": [segment | place]}


def _free_part(draw: Draw, support: Any) -> tuple[float, float]:
    """Return the longest part of the beam without supports, m."""
    if isinstance(support, dict):
        return float(support["length"]), draw.scene.length
    ends = [
        0.0,
        *(end for one in sorted(support, key=itemgetter("from")) for end in (one["from"], one["to"])),
        draw.scene.length,
    ]
    return max(list(pairwise(ends))[::2], key=lambda part: part[1] - part[0])


def _asked(draw: Draw) -> bool:
    """Return whether the choice in focus is one of segments."""
    whole = (draw.focus.table, draw.focus.key) == ("Case", "segment")
    return whole or draw.focus.table in (Segment.__name__, PlacedSegment.__name__)


TILTED = 0.15  # share of the loads with a direction beside the bending direction
SEVERAL = 0.3  # share of the cases with [[support]]
ATTACHED = 0.15  # share of the cases with joints, and of those with masses
WEIGHTLESS = 0.05  # share of the cases without gravity
SLOW_STEPS = 120  # of a mesh, which takes milliseconds for one
AROUND = [type_name(model) for model in models_in(RegionChoice) if issubclass(model, AroundRegion)]
SOFT = 0.5  # of E over the length of the support
STIFF = 8  # one in so many cases of a scheme that creates energy with stiff contact is left stiff
_LAW: TypeAdapter[ChosenLaw] = TypeAdapter(Law)
_SCHEME: TypeAdapter[TimeScheme] = TypeAdapter(Scheme)


def entries_of(draw: Draw, key: str) -> Any:
    """Draw the entries of an array of tables, without what depends on other tables."""
    if key == "support":
        return _supports(draw)
    if key == "probe":
        least = 1 if draw.focus.key == "probe" or draw.focus.table == Probe.__name__ else 0
        return [draw.table(Probe) for _ in range(max(least, draw.chance.choice((0, 1, 1, 1, 1, 2))))]
    if key == "segment":
        return drawn_segments(draw)
    if key in ("joint", "mass", "fluid"):
        return _attached(draw, key)
    models = models_in(Load)
    static = [model for model in models if getattr(model, "static", False)]
    moving = [model for model in models if model not in static and type_name(model) not in _of_walls()]
    wanted = [model for model in models if _in_focus(draw, "load", model) or _leads_to(model, draw.focus.table)]
    chosen = [] if draw.chance.random() < WEIGHTLESS else [*static]
    chosen += wanted or [draw.chance.choice(moving)]
    if draw.chance.random() < 0.25 or all(model in static for model in chosen):
        chosen.append(draw.chance.choice(moving))
    return [draw.table(model) for model in dict.fromkeys(chosen)]


def _supports(draw: Draw) -> Any:
    """Draw the base and gland, or up to three supports that keep apart along the beam."""
    table, entry = models_in(Case.model_fields["support"].annotation)
    asked = draw.focus.value if (draw.focus.table, draw.focus.key) == (Case.__name__, "support") else ""
    several = (
        asked == entry.__name__
        or _wants_rings(draw)
        or _leads_to(entry, draw.focus.table)
        or draw.chance.random() < SEVERAL
    )
    if not several or asked == table.__name__:
        return draw.table(table)
    count = draw.chance.choice((1, 2, 2, 3))
    length, share = draw.scene.length, draw.scene.length / count
    placed = []
    for number in range(count):
        drawn = draw.table(entry)
        start = round((number + draw.chance.uniform(0.0, 0.5)) * share, 4) if number else 0.0
        end = min(length, start + round(min(draw.scene.support, 0.4 * share), 4))
        placed.append(drawn | {"name": f"s{number}", "from": start, "to": end})
    return placed


def _leads_to(model: type[BaseModel], table: str) -> bool:
    """Return whether a table is the named one or holds it."""
    below = [part for field in model.model_fields.values() for part in models_in(field.annotation)]
    return table in {base.__name__ for base in model.__mro__} or any(_leads_to(part, table) for part in below)


def _attached(draw: Draw, key: str) -> list[dict[str, Any]]:
    """Draw joints, masses or fluids of a few cases, those at points at places of their own."""
    models = models_in(Case.model_fields[key].annotation)
    wanted = [model for model in models if _in_focus(draw, key, model) or _leads_to(model, draw.focus.table)]
    if not wanted and draw.chance.random() > ATTACHED:
        return []
    chosen = [draw.chance.choice(wanted or models) for _ in range(draw.chance.choice((1, 1, 2)))]
    places = draw.chance.sample((0.0, 0.25, 0.5, 0.75, 1.0), len(chosen))
    return [
        draw.table(model) | {"name": f"{key}{number}"} | _at(model, round(place * draw.scene.length, 6))
        for number, (model, place) in enumerate(zip(chosen, places, strict=True))
    ]


def _at(model: type[BaseModel], place: float) -> dict[str, float]:
    """Return the place of an entry at a point; nothing for one along the beam."""
    return {"point": place} if "point" in model.model_fields else {}


def _in_focus(draw: Draw, key: str, model: type[BaseModel]) -> bool:
    if draw.focus.table == Case.__name__ and draw.focus.key == key:
        return draw.focus.value in (type_name(model), model.__name__)
    return draw.focus.table in {base.__name__ for base in model.__mro__}


def finished(draw: Draw, tables: dict[str, Any]) -> dict[str, Any]:
    """Return the tables of a whole case: those that are given, with names, directions, sizes."""
    whole = {key: value for key, value in tables.items() if not isinstance(value, LeftOut)}
    whole = {key: dict(value) if isinstance(value, dict) else value for key, value in whole.items()}
    if (draw.focus.value in AROUND and draw.focus.key != "section") or _wants_rings(draw) or _wants_hole(draw):
        whole["beam"] = whole["beam"] | {"section": {"type": "tube", "wall": 0.1 * draw.scene.thickness}}
        whole["mesh"] = whole["mesh"] | {"dimension": 3}
    whole = with_segments(draw, whole)
    whole["beam"], whole["mesh"] = _beam(draw, whole["beam"], whole["mesh"])
    if isinstance(whole["support"], list):
        whole["support"] = [_region(one, whole["beam"]) for one in whole["support"]]
        whole = _holes(draw, whole)
    if "model" in whole:
        whole = _rings(draw, whole)
    dimension = whole["mesh"].get("dimension", 2)
    whole["load"] = [_load(draw, load, number, dimension) for number, load in enumerate(whole["load"])]
    whole["load"] += [partner for load in whole["load"] if (partner := _partner(load))]
    if isinstance(whole["support"], list):
        last = {"support": whole["support"][-1]["name"]}
        whole["load"] = [load | last if load["type"] in _of_walls() else load for load in whole["load"]]
    whole["probe"] = [probe | {"name": f"p{number}"} for number, probe in enumerate(whole["probe"])]
    whole["damping"] = _damping(draw, whole.get("damping", {}))
    law = whole["contact"].get("law", {}).get("type")
    if (
        whole.get("analysis", {}).get("type") == "periodic" and law == "elastic-plastic"
    ):  # nothing that yields is periodic
        if draw.focus.value == law:
            del whole["analysis"]
        else:
            whole["contact"] = {key: value for key, value in whole["contact"].items() if key != "law"}
    whole["contact"] = _contact(draw, whole["contact"], whole["time"].get("scheme"))
    if isinstance(whole["support"], list):
        whole["support"] = [_own_contact(draw, one, whole["contact"]) for one in whole["support"]]
        whole["support"] = _bodies(draw, whole)
    whole["mesh"] = _mesh(draw, whole["mesh"], whole["contact"].get("mass") == "redistributed")
    whole["time"] = _time(draw, whole)
    if "state" in whole.get("analysis", {}):  # it replaces a pose
        left = "state" if (draw.focus.table, draw.focus.key) == ("Transient", "start") else "start"
        whole["analysis"] = {key: value for key, value in whole["analysis"].items() if key != left}
    if "mode" in whole.get("analysis", {}):
        whole["analysis"] = _start(draw, whole["analysis"], whole["probe"])
    if "continuation" in whole.get("analysis", {}):
        curve = _around(whole["analysis"]["continuation"], whole)
        whole["analysis"] = whole["analysis"] | {"continuation": curve}
    return whole


def _start(draw: Draw, analysis: dict[str, Any], probes: list[Any]) -> dict[str, Any]:
    """Start in a mode where there is room for it, in the middle of the play, and a probe with its amplitude."""
    if draw.focus.key == "mode":
        return analysis | {"start": "centered"}
    if analysis.get("start") == "centered" and probes:
        return analysis
    return {key: value for key, value in analysis.items() if key != "mode"}


def _beam(draw: Draw, beam: dict[str, Any], mesh: dict[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Keep other sections than the rectangle to solids of hexahedra, and round ones as wide as they are thick."""
    kind = beam.get("section", {"type": "rectangle"})["type"]
    if kind == "rectangle":
        return beam, mesh
    sections = {model.__name__ for model in models_in(Beam.model_fields["section"].annotation)}
    asked = draw.focus.table in sections or (draw.focus.table, draw.focus.key) == (Beam.__name__, "section")
    segmented = (draw.focus.table, draw.focus.key) == ("PlacedSegment", "section")
    if not asked and not segmented and (mesh.get("dimension", 2) == 2 or draw.focus.table == Mesh.__name__):
        return {key: value for key, value in beam.items() if key != "section"}, mesh
    if kind in ("round", "tube"):
        beam = beam | {"width": beam["thickness"]}
    kept = {key: value for key, value in mesh.items() if key not in ("cell", "plane")}
    return beam, kept | {"dimension": 3}


def _region(support: dict[str, Any], beam: dict[str, Any]) -> dict[str, Any]:
    """Limit regions around the beam to round sections, with play and offset small compared with the radius."""
    if support.get("region", {}).get("type") not in AROUND:
        return {key: value for key, value in support.items() if key != "lateral"}
    if beam.get("section", {"type": "rectangle"})["type"] not in ("round", "tube"):
        return {key: value for key, value in support.items() if key not in ("region", "lateral")}
    play = max(min(support["clearance"], 0.02 * beam["thickness"]), -0.001 * beam["thickness"])
    most = 0.7 * max(play, 0.0)
    moved = {key: min(max(support[key], -most), most) for key in ("offset", "lateral") if key in support}
    return support | {"clearance": play} | moved


def _wants_hole(draw: Draw) -> bool:
    """Return whether the case is drawn for how a hole is met."""
    return draw.focus.table == Hole.__name__


def _holes(draw: Draw, whole: dict[str, Any]) -> dict[str, Any]:
    """Meet holes as circles where the case is drawn for that alone, by a body that keeps its sections."""
    if not _wants_hole(draw):
        support = [_met_at_points(one) for one in whole["support"]]
        return whole | {"support": support}
    hole = {"type": "hole", "contact": draw.focus.value}
    if draw.focus.value == "points":
        return whole | {"support": [_region(one | {"region": hole}, whole["beam"]) for one in whole["support"]]}
    play = 0.005 * whole["beam"]["thickness"]
    kept = ("name", "from", "to", "stiffness", "tilt")
    support = [{key: one[key] for key in kept if key in one} for one in whole["support"]]
    walls = _of_walls()
    return whole | {
        "support": [one | {"clearance": play, "region": hole} for one in support],
        "model": {"type": "rigid"},
        "load": [load for load in whole["load"] if load["type"] not in walls],
        "contact": {},
        "time": {key: value for key, value in whole["time"].items() if key != "scheme"},
    }


def _met_at_points(support: dict[str, Any]) -> dict[str, Any]:
    """Return a support whose hole, if it is one, is met at points."""
    region = support.get("region", {})
    if region.get("type") != type_name(Hole):
        return support
    return support | {"region": {key: value for key, value in region.items() if key != "contact"}}


def _wants_rings(draw: Draw) -> bool:
    """Return whether the case is drawn for rigid sections."""
    return (draw.focus.table, draw.focus.key, draw.focus.value) == (ReducedModel.__name__, "sections", "rigid")


def _rings(draw: Draw, whole: dict[str, Any]) -> dict[str, Any]:
    """Keep rigid sections, and how many touch, to beams that are in holes alone; those of elements to no points."""
    model, support = whole["model"], whole["support"]
    if _wants_rings(draw) and isinstance(support, list):
        support = [_region(one | {"region": {"type": "hole"}}, whole["beam"]) for one in support]
    holes = isinstance(support, list) and all(one.get("region", {}).get("type") in AROUND for one in support)
    if model.get("sections") == "rigid" and not holes:
        model = {key: value for key, value in model.items() if key != "sections"}
    elements = model["type"] == type_name(BeamModel) and holes and "points" not in whole["contact"]
    if model.get("sections") != "rigid" and not elements:
        model = {key: value for key, value in model.items() if key != "stations"}
    return whole | {"model": model, "support": support}


def _load(draw: Draw, load: dict[str, Any], number: int, dimension: int) -> dict[str, Any]:
    """Name a load, give motion its unit, and tilt it in or beside the bending plane, by the seed and its number."""
    named = load | {"name": f"l{number}"}
    speed = 2.0 * pi * draw.scene.frequency
    size = {"velocity": 1.0 / speed, "displacement": 1.0 / speed**2}.get(load.get("quantity", ""), 1.0)
    named |= {key: size * load[key] for key in ("amplitude", "scale") if key in load}
    if load.get("quantity") == "acceleration":
        named.pop("point", None)
    tilt = (draw.scene.seed * 7919 + number * 104729) % 1000 / 1000.0
    if tilt < TILTED and load["type"] not in _of_walls():
        sense = -1.0 if load["type"] in _downward() else 1.0
        share = round(4.0 * tilt, 3)
        named["direction"] = [share, sense] if dimension == 2 else [0.0, share, sense]
    return named


def _partner(load: dict[str, Any]) -> dict[str, Any] | None:
    """Return the load that a load has a cross-spectrum with: its twin under the name that the cross-spectrum takes."""
    if (cross := load.get("cross_spectrum")) is None:
        return None
    cross["load"] = f"{load['name']}-partner"
    return {key: value for key, value in load.items() if key != "cross_spectrum"} | {"name": cross["load"]}


def _downward() -> set[str]:
    return {type_name(model) for model in models_in(Load) if getattr(model, "static", False)}


def _of_walls() -> set[str]:
    """Return the types of the loads that move a support; each is drawn in its turn only."""
    return {type_name(model) for model in models_in(Load) if "support" in model.model_fields}


def _damping(draw: Draw, damping: dict[str, Any]) -> dict[str, Any]:
    """Keep one of the two ways in which damping is given, or none, by what the seed says."""
    pairs = (("frequencies", "ratios"), ("mass", "stiffness"), ("frequencies", "ratios"), ())
    kept = (*pairs[draw.scene.seed % len(pairs)], "ratio")
    return {key: damping[key] for key in kept if key in damping}


def _contact(draw: Draw, contact: dict[str, Any], scheme: dict[str, Any] | None) -> dict[str, Any]:
    """Turn the stiffness per area of a linear law into the stiffness of the drawn law and of each drawn point.

    Most contacts of schemes that create energy with stiff contact are soft: others are refused.
    """
    scene, points = draw.scene, contact.get("points")
    creator = scheme is not None and _SCHEME.validate_python(scheme).contact_range == SOFT_CONTACT
    if creator and draw.scene.seed % STIFF and isinstance(contact.get("stiffness"), float):
        contact = contact | {"stiffness": min(contact["stiffness"], SOFT * scene.modulus / scene.support)}
    law = _LAW.validate_python(contact.get("law", {"type": "kelvin-voigt"}))
    if law.keeps_set and scheme is not None and not _SCHEME.validate_python(scheme).marches_sets:
        return _contact(draw, {key: value for key, value in contact.items() if key != "law"}, scheme)
    exponent = float(law.spring_exponent)
    usual = (SOFT * scene.modulus / scene.support) if creator else 0.1 * scene.stiffness
    share = scene.width * scene.support / len(points) if points else 1.0
    numbers = {key: share * contact[key] for key in ("stiffness", "damping") if isinstance(contact.get(key), float)}
    if exponent > 1.0 and contact.get("stiffness") != "auto":
        linear = numbers.get("stiffness", share * usual)
        numbers["stiffness"] = linear / scene.shallow ** (exponent - 1.0)
    return contact | numbers


def _own_contact(draw: Draw, support: dict[str, Any], contact: dict[str, Any]) -> dict[str, Any]:
    """Limit the contact of a support to keys that fit a drawn [contact], in the units of its law."""
    law = _LAW.validate_python(contact.get("law", {"type": "kelvin-voigt"}))
    penalty = contact.get("formulation", {"type": "penalty"})["type"] == "penalty"
    given = isinstance(contact.get("stiffness"), float)
    share = contact["stiffness"] / draw.scene.stiffness if given else 1.0
    kept = {
        "stiffness": penalty and given,
        "damping": penalty and law.takes_damping and not law.dissipates,
        "friction": contact.get("friction", {}).get("coefficient", 0.0) > 0.0,
    }
    support = {key: value for key, value in support.items() if kept.get(key, True)}
    numbers = {key: min(share, 1.0) * support[key] for key in ("stiffness", "damping") if key in support}
    return support | numbers


def _bodies(draw: Draw, whole: dict[str, Any]) -> list[dict[str, Any]]:
    """Take bodies from supports of a mesh and from those that loads may move, but for a case that is drawn for one."""
    mesh = whole.get("model", {"type": "full"})["type"] == "full"
    stands = mesh or any("support" in load for load in whole["load"])
    wanted = draw.focus.key == "body" or draw.focus.table == SupportBody.__name__
    taken = "body" if stands and not wanted else ""
    return [{key: value for key, value in one.items() if key != taken} for one in whole["support"]]


def _mesh(draw: Draw, mesh: dict[str, Any], layers: bool) -> dict[str, Any]:
    """Keep solids small, and give bodies the layers of nodes that the mass of contact nodes is moved to."""
    linear = mesh.get("degree", 2) == 1
    if layers:
        square = {"support_size": min(0.5 * draw.scene.thickness, draw.scene.support)}
        mesh = mesh | square | {"cells_through_thickness": 4 if linear else 2}
    if mesh.get("dimension", 2) == 2:
        return {key: value for key, value in mesh.items() if key != "cells_across_width"}
    small = {
        "cells_across_width": 2 if linear else 1,
        "cells_through_thickness": mesh["cells_through_thickness"] if layers else 2 if linear else 1,
        "size": max(3.0 * draw.scene.thickness, 0.12 * draw.scene.length),
        "support_size": mesh["support_size"] if layers else 0.4 * draw.scene.support,
    }
    return mesh | small


def _time(draw: Draw, whole: dict[str, Any]) -> dict[str, Any]:
    """Shorten the run of a mesh, whose steps take longest, to some hundred steps; more of them where they are explicit.

    A step of the explicit scheme is computed.
    """
    time: dict[str, Any] = whole["time"]
    scene = draw.scene
    scheme = time.get("scheme", {}).get("type")
    if scheme == "central-difference":
        return time | {"step": "auto", "end": 15.0 * scene.step}
    slow = whole.get("model", {"type": "full"})["type"] == "full" or "friction" in whole["contact"]
    most = SLOW_STEPS if slow else 4 * SLOW_STEPS
    steps = round(time["end"] / scene.step)
    if steps > most:
        return time | {"end": most * scene.step}
    return time


def _around(curve: dict[str, Any], whole: dict[str, Any]) -> dict[str, Any]:
    """Put the range of a curve around the value of the case."""
    table, *name, key = curve["key"].split(".")
    entries = whole.get(table, {})
    if not name and isinstance(entries, list):
        curve, name = curve | {"key": f"{table}.{entries[0]['name']}.{key}"}, [entries[0]["name"]]
    if name:
        named = [entry for entry in entries if entry["name"] == name[0]]
        value = named[0].get(key, 1.0) if named else 1.0
    else:
        value = whole.get(table, {}).get(key, 1.0)
    if not isinstance(value, float | int):  # "auto"
        value = 1.0
    low, high = sorted((0.8 * value, 1.25 * value))
    return curve | {"low": low, "high": high}
