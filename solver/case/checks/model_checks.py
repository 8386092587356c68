"""Contradictions between the model and what is asked of it."""

from __future__ import annotations

from collections.abc import Iterator

from gapbeam.solver.case.case import Damping, Mesh
from gapbeam.solver.case.checks.place_checks import Loads
from gapbeam.solver.case.contact_table import Contact
from gapbeam.solver.case.model_table import BeamModel, FullModel, ModelTable, ReducedModel
from gapbeam.solver.case.time_table import Time
from gapbeam.solver.faults import Fault

TYPE = ("model", "type")


def contact_fits_the_model(model: ModelTable, contact: Contact) -> Iterator[Fault]:
    """A basis of few DOFs has no stress at the contact points, and few motions that constraints could hold."""
    if isinstance(model, FullModel):
        return
    formulation = contact.formulation
    keeps_all = isinstance(model, ReducedModel) and model.contact == "all"
    if formulation.stress_terms is not None:
        expected = (
            f"full: the formulation {formulation.type} takes the stress at the contact points, which only the mesh has"
        )
        yield Fault(TYPE, model.type, expected, 'formulation = "penalty"', (("contact", "formulation"),))
    elif not formulation.follows_the_law and not keeps_all:
        yield Fault(
            TYPE,
            f"{model.type}, with the formulation {formulation.type}",
            'full, or reduced with contact = "all": more points than motions of the faces cannot all be held exactly',
            'contact = "all" in [model], or formulation = "penalty"',
            (("contact", "formulation"),),
        )
    if contact.mass == "redistributed":
        expected = "consistent: the contact nodes of any model but the full one have no mass of their own"
        yield Fault(("contact", "mass"), "redistributed", expected, "leave mass out", (TYPE,))
    if contact.rubs is not None and not keeps_all:
        yield Fault(
            ("contact", "friction"),
            f"a coefficient of {contact.rubs.coefficient:g}, with the model {model.type}",
            'the model full, or reduced with contact = "all": the other bases do not give way along the faces',
            'contact = "all" in [model], or leave friction out',
            (TYPE,),
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


def implicit_schemes_march_the_model(model: ModelTable, time: Time) -> Iterator[Fault]:
    """Explicit steps march the lumped masses of a mesh."""
    if not isinstance(model, FullModel) and time.scheme.explicit:
        yield Fault(
            ("time", "scheme"),
            f"{time.scheme.type}, with the model {model.type}",
            "an implicit scheme: explicit steps are for the lumped masses of a mesh",
            'scheme = "discrete-gradient"',
            (TYPE,),
        )


def loads_bend_the_beam(model: ModelTable, load: Loads) -> Iterator[Fault]:
    """Beam elements bend, and do nothing else."""
    if not isinstance(model, BeamModel):
        return
    for number, entry in load.items():
        if entry.direction is not None and entry.direction[0] != 0.0:
            yield Fault(
                ("load", number, "direction"),
                f"{list(entry.direction)}, with the model beam",
                "a direction across the beam: beam elements know bending alone",
                "leave direction out, or take another model",
                (TYPE,),
            )


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
