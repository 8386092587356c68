"""Contradictions between the model and what is asked of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from gapbeam.solver.attachments.attachment_tables import Joint, PointMass
from gapbeam.solver.case.advised_scheme import advised_scheme
from gapbeam.solver.case.analysis_table import Analysis
from gapbeam.solver.case.beam_motions import motions_of_tables
from gapbeam.solver.case.case import Damping, Mesh
from gapbeam.solver.case.checks.place_checks import Loads
from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.case.model_table import BeamModel, FullModel, ModelTable, ReducedModel
from gapbeam.solver.case.time_table import Time
from gapbeam.solver.faults import Fault
from gapbeam.solver.supports.layout import keyed
from gapbeam.solver.supports.support_tables import AnySupports

TYPE = ("model", "type")
SECTIONS = ("model", "sections")


def contact_fits_the_model(model: ModelTable, contact: Contact) -> Iterator[Fault]:
    """A basis of few DOFs has no stress at the contact points, and few motions that constraints could hold."""
    if isinstance(model, FullModel):
        return
    formulation = contact.formulation
    keeps_all = isinstance(model, ReducedModel) and model.contact == "all"
    everything = 'contact = "all"' + (' and sections = "deformable"' if model.rings else "")
    either = f"{everything} in [model], or " if isinstance(model, ReducedModel) else ""
    if formulation.stress_terms is not None:
        expected = (
            f"full: the formulation {formulation.type} takes the stress at the contact points, which only the mesh has"
        )
        yield Fault(TYPE, model.type, expected, 'formulation = "penalty" in [contact]', (("contact", "formulation"),))
    elif not formulation.follows_the_law and not keeps_all:
        yield Fault(
            TYPE,
            f"{model.type}, with the formulation {formulation.type}",
            'full, or reduced with contact = "all": more points than motions of the faces cannot all be held exactly',
            either + 'formulation = "penalty" in [contact]',
            (("contact", "formulation"),),
        )
    if contact.mass == "redistributed":
        expected = "consistent: the contact nodes of any model but the full one have no mass of their own"
        yield Fault(("contact", "mass"), "redistributed", expected, "leave mass out", (TYPE,))
    if contact.rubs is not None and not keeps_all and not isinstance(model, BeamModel):
        yield Fault(
            ("contact", "friction"),
            f"a coefficient of {contact.rubs.coefficient:g}, with the model {model.type}",
            'full, beam, or reduced with contact = "all": the other bases have no flexibility along the faces',
            (either or 'type = "beam" in [model], or ') + "leave friction out",
            (TYPE,),
        )


def stations_are_of_rigid_sections(model: ModelTable) -> Iterator[Fault]:
    """The number of stations says nothing where sections deform."""
    if isinstance(model, ReducedModel) and model.rings is None and model.stations is not None:
        yield Fault(
            ("model", "stations"),
            f"{model.stations}, with sections that deform",
            'stations together with sections = "rigid"',
            'sections = "rigid", or leave stations out',
        )


def touching_sections_are_in_holes(model: ModelTable, support: AnySupports, contact: Contact) -> Iterator[Fault]:
    """Sections of beam elements that touch at stations are met all around."""
    if not isinstance(model, BeamModel) or model.stations is None:
        return
    key, found = ("model", "stations"), f"{model.stations}"
    for at, one in keyed(support):
        if not one.around:
            expected = "supports around the beam alone: stations are sections that are met all around"
            yield Fault(key, f"{found}, with the {one.region.type} {one.name}", expected, "leave stations out", (at,))
            break
    if contact.points is not None:
        related = (("contact", "points"),)
        yield Fault(key, f"{found}, with contact.points", "one of both", "leave one of both out", related)


def rigid_sections_are_in_holes(model: ModelTable, support: AnySupports) -> Iterator[Fault]:
    """Sections that keep their shape are met all around, and take the place of shapes of pressure on a surface."""
    if not isinstance(model, ReducedModel) or model.rings is None:
        return
    for key, one in keyed(support):
        if not one.around:
            yield Fault(
                SECTIONS,
                f"rigid, with the {one.region.type} {one.name}",
                "supports around the beam alone: the surface on planes deforms",
                'region = "hole", or for a slot { type = "polygon", walls = [0.0, 180.0] } with half its clearance, '
                "around a round section; or leave sections out",
                (key,),
            )
            break
    if model.contact == "all":
        expected = 'contact = "shapes": all motions of the surface are those of sections that deform'
        yield Fault(SECTIONS, 'rigid, with contact = "all"', expected, "leave one of both out", (("model", "contact"),))
    if model.interface == "fixed":
        expected = 'interface = "free": the modes of a body whose sections are not held'
        yield Fault(
            SECTIONS, 'rigid, with interface = "fixed"', expected, "leave interface out", (("model", "interface"),)
        )


def elements_are_above_round_off(model: ModelTable) -> Iterator[Fault]:
    """The stiffness of n elements in a row is conditioned as n^4: what is left beyond 1 / eps is round-off."""
    most = int(float(np.finfo(float).eps) ** -0.25)
    if isinstance(model, BeamModel) and model.elements > most:
        yield Fault(
            ("model", "elements"),
            f"{model.elements}",
            f"at most {most}: the bending of shorter elements is lost in the round-off of their stiffness",
            f"elements = {min(most, 500)}",
        )


def modal_damping_has_modes(model: ModelTable, damping: Damping) -> Iterator[Fault]:
    """Modal damping belongs to the modes of small models."""
    if isinstance(model, FullModel) and damping.ratio:
        yield Fault(
            ("damping", "ratio"),
            f"{damping.ratio:g}, with the model full, whose modes are not computed",
            "a reduced, beam or rigid model, or Rayleigh damping",
            'type = "reduced" in [model], or frequencies and ratios',
            (TYPE,),
        )


def implicit_schemes_march_the_model(model: ModelTable, time: Time, contact: Contact) -> Iterator[Fault]:
    """Explicit steps march the lumped masses of a mesh."""
    if not isinstance(model, FullModel) and time.scheme.explicit:
        yield Fault(
            ("time", "scheme"),
            f"{time.scheme.type}, with the model {model.type}",
            "an implicit scheme: explicit steps are for the lumped masses of a mesh",
            f'scheme = "{advised_scheme(contact)}"',
            (TYPE,),
        )


def beams_move_as_asked(
    model: ModelTable,
    mesh: Mesh,
    support: AnySupports,
    load: Loads,
    joint: Mapping[int, Joint],
    mass: Mapping[int, PointMass],
    contact: Contact,
    analysis: Analysis,
) -> Iterator[Fault]:
    """A beam model has the motions that its case calls for, and a slice neither leaves its plane nor twists."""
    if not isinstance(model, BeamModel) or model.motions == "auto":
        return
    key, related = ("model", "motions"), (("mesh", "dimension"),)
    beyond = [name for name in ("lateral", "torsion") if name in model.motions and mesh.dimension == 2]
    if beyond:
        yield Fault(
            key, f'"{beyond[0]}", of a slice (dimension = 2)', '"bending" and "axial"', "dimension = 3", related
        )
        return
    for name, why in motions_of_tables(mesh, support, load, joint, mass, contact, analysis).items():
        if name not in model.motions:
            given = ", ".join(f'"{one}"' for one in (*model.motions, name))
            yield Fault(key, f"{list(model.motions)}", f'"{name}" among them: {why}', f"motions = [{given}], or auto")


def beam_is_prismatic(model: ModelTable, mesh: Mesh) -> Iterator[Fault]:
    """The section of beam elements is that of [beam]."""
    if isinstance(model, BeamModel) and mesh.file is not None:
        yield Fault(
            TYPE,
            "beam, with a mesh file",
            "full or reduced: the section of a mesh file is not known",
            'type = "reduced"',
            (("mesh", "file"),),
        )
