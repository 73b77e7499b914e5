"""Scene -> Model: masses, loads, elements, forces and constraints on the coordinates that the placement gave."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shoal.compile import progress
from shoal.errors import InputError
from shoal.mechanics import fitting, functions, terms
from shoal.mechanics.assembly.contacts import Contacts
from shoal.mechanics.assembly.coordinates import Placement
from shoal.mechanics.assembly.loads import Loads
from shoal.mechanics.assembly.masses import Masses
from shoal.mechanics.assembly.measures import naming
from shoal.mechanics.assembly.placement import place
from shoal.mechanics.derived import RowAllocator
from shoal.mechanics.gaps import DRY
from shoal.mechanics.least import principle
from shoal.mechanics.model import Model
from shoal.mechanics.numerics.tile import index, stacked
from shoal.mechanics.reach import span
from shoal.mechanics.rubbing import Rubbing
from shoal.scene import GROUND, Distance, Scene
from shoal.scene.formula import Node
from shoal.scene.ropes import Rope
from shoal.scene.signals import following


def with_start(model: Model, scene: Scene, lanes: int) -> Model:
    """The same model with the initial state of a scene that differs in nothing else."""
    placement = place(scene)
    stated, scene = scene, placement.scene
    contacts = Contacts(scene, placement, RowAllocator(0))
    loads = Loads(scene, placement, RowAllocator(0), 0.0)
    loads.signals.sample()
    return replace(
        model,
        scene=scene,
        stated=stated,
        failed=placement.failed | contacts.beyond,
        lanes=lanes,
        q0=stacked(placement.positions),
        v0=stacked(placement.velocities),
        start_angles=stacked(loads.angles),
        signal_angles=stacked(loads.signals.measures.angles),
        gap_angles=stacked(contacts.angles),
    )


def build(
    scene: Scene, lanes: int = 1, horizon: float = 0.0, placement: Placement | None = None, probes: Sequence[Node] = ()
) -> Model:
    """Assemble the model of a scene whose numbers may be arrays over lanes. Raises InputError.

    horizon [s]: functions of time are fitted up to it, and at least up to the end of the scene's duration. placement:
    that of the scene, if it is known. probes: formulas that are looked at beside those that loads follow.
    """
    progress.begin()
    placement = placement or place(scene)
    stated, scene = scene, placement.scene
    horizon = max(horizon, scene.solver.duration)
    rows = RowAllocator(len(placement.positions))
    masses = Masses(scene, placement, rows)
    loads, contacts = Loads(scene, placement, rows, horizon), Contacts(scene, placement, rows)
    loads.signals.record()
    probed = tuple(loads.signals.strength("outputs", node) for node in probes)
    loads.signals.sample()
    gaps = contacts.gaps(placement.terms.pressed)
    if gaps.size and loads.rubbing:
        raise InputError(
            f"{contacts.fields[0]}: smoothed friction by the force of a joint (joints.{loads.rubbing[0][0]}.mu) knows "
            "no contacts; state stick: exact there as well, or coulomb"
        )
    if np.any(gaps.share) and np.any(gaps.kind != DRY):
        raise InputError(
            f"{contacts.fields[int(np.argmax(gaps.kind != DRY))]}: friction by the force of a joint "
            f"({contacts.fields[int(np.argmax(np.any(gaps.share, axis=1)))]}) knows no impacts, in which that force is "
            "an impulse; state coulomb there"
        )
    force_rows = rows.size
    held = terms.assemble(placement.terms, rows, len(loads.fitted), span(scene))
    for one in terms.drives(placement.terms).values():
        assert one.drive is not None
        drive = one.drive.function
        field = f"joints.{one.name}" if one.name in scene.joints else one.name.replace(GROUND, "ground_points", 1)
        with naming(field):
            fitting.require_no_jump(drive, horizon)
            if one.name in scene.joints and isinstance(scene.joints[one.name], Distance):
                fitting.require_positive(drive, horizon)
            loads.fitted.append(fitting.fit(drive, horizon, drive.knots, steep=False))
    held_rows = rows.size
    marker_rows = [
        rows.of_all([placement.point(scene, marker), placement.direction(scene, marker)])
        for marker in scene.markers.values()
    ]
    return Model(
        scene=scene,
        stated=stated,
        dimensions=scene.dimensions,
        failed=placement.failed | contacts.beyond,
        frames=placement.frames,
        lanes=lanes,
        q0=stacked(placement.positions),
        v0=stacked(placement.velocities),
        force_rows=force_rows,
        held_rows=held_rows,
        derived=rows.derived(),
        mass_entries=masses.mass,
        lent_entries=masses.lent if held.size else {},
        flat=masses.flat and held.size > 0,
        stretching_entries=masses.stretching,
        weight=stacked(masses.weight),
        elements=masses.elements(),
        owners=masses.owners(),
        forces=loads.forces(),
        start_angles=stacked(loads.angles),
        applied=loads.applied(),
        gaps=gaps,
        gap_fields=tuple(contacts.fields),
        gap_angles=stacked(contacts.angles),
        functions=functions.pack(loads.fitted),
        kinks=tuple(one.kinks for one in loads.fitted),
        constraints=held,
        constraint_names=tuple(one.name for one in placement.terms.held),
        tensions=placement.terms.tensions,
        spans=tuple((one.joint, one.unknowns[0]) for one in placement.lifted if one.span),
        rope_places={
            name: tuple(placement.point(scene, at) for at in (rope.first, *rope.over, rope.second))
            for name, rope in scene.joints.items()
            if isinstance(rope, Rope)
        },
        marker_rows=index(marker_rows),
        rubbing=_rubbing(loads, placement.terms.pressed),
        signals=loads.followed(),
        signal_fields=tuple(following(stated)),
        signal_names=tuple(loads.signals.names),
        recorded=tuple(loads.signals.outputs),
        clocks=tuple(loads.signals.clocks.items()),
        sampled=loads.signals.sampled,
        probed=probed,
        signal_angles=stacked(loads.signals.measures.angles),
        method=principle.method(scene.solver.acceleration),
        baumgarte=scene.solver.baumgarte,
    )


def _rubbing(loads: Loads, pressed: dict[str, tuple[int, int]]) -> Rubbing:
    """Friction by the force of joints: of a pin all components, of a slider those across its line."""
    names = [name for name, _, _ in loads.rubbing]
    first, parts = [pressed[name][0] for name in names], [pressed[name][1] for name in names]
    numbers = index([number for _, number, _ in loads.rubbing])
    return Rubbing(len(names), numbers, index(first), index(parts), stacked([share for _, _, share in loads.rubbing]))
