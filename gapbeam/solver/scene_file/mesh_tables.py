"""Models of mesh files: the file, the unit of its coordinates, and the materials of its groups of cells."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field

from gapbeam.solver.case.beam_profile import Material
from gapbeam.solver.messages.errors import Fault, Key, UserError
from gapbeam.solver.scene.argument_checks import ArgumentError
from gapbeam.solver.scene.mesh_structure import mesh_model
from gapbeam.solver.scene.solid_material import OrthotropicMaterial, orthotropic
from gapbeam.solver.scene.structure_files import ImportedModel
from gapbeam.solver.scene.structure_geometry import Pose
from gapbeam.solver.schema.table import Number, Positive, Table

Direction = tuple[Number, Number, Number]
FileName = Annotated[str, Field(min_length=1, max_length=1000)]


class MeshMaterial(Table):
    """A material of a mesh: isotropic, or orthotropic with own axes."""

    group: str | None = Field(
        default=None, min_length=1, max_length=80, description="group of cells; default all cells of no other group",
        examples=["RUBBER"],
    )  # fmt: skip
    density: Positive = Field(description="mass density, kg/m^3", examples=[7850.0])
    young_modulus: Positive | None = Field(default=None, description="of an isotropic material, Pa", examples=[2.1e11])
    poisson_ratio: Annotated[Number, Field(gt=-1.0, lt=0.5)] | None = Field(
        default=None, description="of an isotropic material, no unit", examples=[0.3]
    )
    young_moduli: Direction | None = Field(
        default=None, description="E1, E2, E3 of an orthotropic material, Pa", examples=[[1.35e11, 9e9, 9e9]]
    )
    poisson_ratios: Direction | None = Field(
        default=None,
        description="nu12, nu13, nu23, no unit; nu12 is the contraction along 2 under tension along 1",
        examples=[[0.3, 0.3, 0.4]],
    )
    shear_moduli: Direction | None = Field(default=None, description="G12, G13, G23, Pa", examples=[[5e9, 5e9, 3.2e9]])
    axis: Direction = Field(default=(1.0, 0.0, 0.0), description="direction 1 of an orthotropic material, no unit")
    across: Direction | None = Field(
        default=None, description="direction 3, at right angles to axis, no unit; default z, made to be at right angles"
    )

    def made(self) -> Material | OrthotropicMaterial:
        """Return the material."""
        if self.young_moduli is not None and self.poisson_ratios is not None and self.shear_moduli is not None:
            moduli = self.young_moduli, self.poisson_ratios, self.shear_moduli
            return orthotropic(*moduli, self.density, self.axis, self.across)
        return Material.model_validate(
            {"young_modulus": self.young_modulus, "poisson_ratio": self.poisson_ratio, "density": self.density}
        )


class MeshFile(Table):
    """Solids of a mesh file, relative to the case file."""

    type: Literal["mesh"] = Field(description="kind of model")
    file: FileName = Field(
        description="mesh: .inp (Abaqus, CalculiX), .bdf (Nastran), .msh (gmsh), .vtk, .vtu, .med, ...; cells of one "
        "kind, order 1 or 2",
        examples=["bracket.inp"],
    )
    units: Literal["m", "cm", "mm", "inch"] = Field(description="unit of its coordinates", examples=["mm"])
    materials: tuple[MeshMaterial, ...] = Field(
        min_length=1,
        max_length=100,
        description="materials of groups of cells",
        examples=[[{"young_modulus": 2.1e11, "poisson_ratio": 0.3, "density": 7850.0}]],
    )
    plane: Literal["stress", "strain"] | None = Field(
        default=None,
        description="assumption for triangles or quadrilaterals in a plane z = constant",
        examples=["stress"],
    )
    thickness: Positive | None = Field(default=None, description="of cells in a plane, m", examples=[0.01])

    def read(self, place: Pose | None, name: str) -> ImportedModel:
        """Return the matrices of the file, before anything is clamped.

        Raises:
            UserError: The file cannot be read, or materials do not fit.
        """
        try:
            materials = {one.group or "": one.made() for one in self.materials}
        except UserError as error:
            raise ArgumentError(str(error), "materials") from None
        return mesh_model(
            self.file, materials, units=self.units, plane=self.plane, thickness=self.thickness, place=place, name=name
        )


def material_faults(key: Key, model: MeshFile) -> Iterator[Fault]:
    """A material is isotropic or orthotropic, and every group has one."""
    for number, one in enumerate(model.materials):
        given = {
            kind: [name for name in kind if getattr(one, name) is not None]
            for kind in (("young_modulus", "poisson_ratio"), ("young_moduli", "poisson_ratios", "shear_moduli"))
        }
        whole = [kind for kind, names in given.items() if len(names) == len(kind)]
        if len(whole) != 1 or sum(map(len, given.values())) != len(whole[0]):
            found = ", ".join(name for names in given.values() for name in names) or "no elastic constants"
            yield Fault((*key, number), found, "young_modulus and poisson_ratio, or young_moduli, poisson_ratios and "
                        "shear_moduli")  # fmt: skip
        if one.group in [other.group for other in model.materials[:number]]:
            yield Fault((*key, number, "group"), f"{one.group or 'none'}, a second time", "a group for each material")
