"""State: the only thing that changes. Slots for bottles, the lists between them, the belts' speeds."""

import numpy as np

from conveyor_sim.engine.arrays import (
    F8,
    U4,
    Bottles,
    Load,
    Near,
    Neighbourhood,
    Pairs,
    Peaks,
    RailContacts,
    Spin,
    Stage,
    Surface,
    World,
)
from conveyor_sim.engine.integrators import STAGED
from conveyor_sim.engine.neighbours import rebuild
from conveyor_sim.engine.rails import MOST_CONTACTS
from conveyor_sim.model import Model
from conveyor_sim.plant import belt_arrays

FIRST_SLOTS = 16


class State:
    """Bottles in slots (free ones are reused, ids never), as the arrays of one `World`."""

    def __init__(self, model: Model) -> None:
        self.model = model
        self.next_id = 0
        self.world = self._empty_world(FIRST_SLOTS, entries=4 * FIRST_SLOTS)

    def add(self, kind: int, x: float, y: float, theta: float, vx: float, vy: float, omega: float) -> int:
        """Put a bottle of a type at (x, y) m, moving at m/s and rad/s; return its id."""
        free = np.flatnonzero(self.world.bottles.id < 0)
        if free.size == 0:
            self._resize(2 * self.world.bottles.id.size)
            free = np.flatnonzero(self.world.bottles.id < 0)
        slot = free[0]
        bottles, model = self.world.bottles, self.model
        bottles.x[slot], bottles.y[slot] = x, y
        bottles.vx[slot], bottles.vy[slot] = vx, vy
        bottles.radius[slot] = model.type_radius[kind]
        bottles.inverse_mass[slot] = 1.0 / model.type_mass[kind]
        bottles.weight[slot] = model.type_mass[kind] * model.gravity
        bottles.type[slot] = kind
        bottles.id[slot] = self.next_id
        if self.world.spin is not None:
            self.world.spin.theta[slot], self.world.spin.omega[slot] = theta, omega
            self.world.spin.inverse_inertia[slot] = 1.0 / model.type_inertia[kind]
        self.world.neighbourhood.stale[0] = 1
        self.next_id += 1
        return self.next_id - 1

    def remove(self, slot: int) -> None:
        """Take the bottle in a slot away; the slot is free and at rest."""
        bottles, spin = self.world.bottles, self.world.spin
        for column in (*bottles[:-1], self.world.peaks.force, self.world.peaks.impulse):
            column[slot] = 0
        bottles.id[slot] = -1
        if spin is not None:
            for column in spin:
                column[slot] = 0.0
        self.world.neighbourhood.stale[0] = 1

    def make_lists(self) -> None:
        """Rebuild the neighbour lists if they are stale, growing those that are too short."""
        while self.world.neighbourhood.stale[0]:
            needed = max(rebuild(self.world))
            if self.world.neighbourhood.stale[0]:
                self._replace_lists(self.world, 2 * needed)

    def _resize(self, slots: int) -> None:
        old = self.world
        new = self._empty_world(slots, entries=4 * slots)
        used = old.bottles.id.size
        groups = [(old.bottles, new.bottles), (old.peaks, new.peaks), (old.spin, new.spin)]
        for source, target in groups:
            if source is not None and target is not None:
                for before, after in zip(source, target, strict=True):
                    after[:used] = before
        if old.surface is not None and new.surface is not None:
            for name in ("ux", "uy", "turn"):
                if (before := getattr(old.surface, name)) is not None:
                    getattr(new.surface, name)[:] = before
        self.world = new

    def _replace_lists(self, world: World, entries: int) -> None:
        self.world = world._replace(
            pairs=self._pairs(entries),
            near_segments=self._near(world.bottles.id.size, entries) if world.segments is not None else None,
            near_arcs=self._near(world.bottles.id.size, entries) if world.arcs is not None else None,
            belts=world.belts._replace(candidate=np.zeros(entries, np.uint32)) if world.belts is not None else None,
        )

    def _pairs(self, entries: int) -> Pairs | None:
        law = self.model.pair_law
        if law is None:
            return None
        return Pairs(
            i=np.zeros(entries, np.uint32),
            j=np.zeros(entries, np.uint32),
            stiffness=np.zeros(entries),
            friction=_column_like(law.friction, entries),
            damping_paper=_column_like(law.damping_paper, entries),
            damping_normal=_column_like(law.damping_normal, entries),
            used=np.zeros(1, np.int64),
        )

    @staticmethod
    def _near(slots: int, entries: int) -> Near:
        return Near(np.zeros(slots + 1, np.uint32), np.zeros(entries, np.uint32))

    def _empty_world(self, slots: int, entries: int) -> World:
        model = self.model
        buckets = 1 << max(4, (2 * slots - 1).bit_length())

        def reals() -> F8:
            return np.zeros(slots)

        return World(
            settings=model.settings,
            bottles=Bottles(
                x=reals(),
                y=reals(),
                vx=reals(),
                vy=reals(),
                radius=reals(),
                inverse_mass=reals(),
                weight=reals(),
                type=np.zeros(slots, np.uint32),
                id=np.full(slots, -1, dtype=np.int64),
            ),
            spin=Spin(reals(), reals(), reals(), reals()) if model.has("rotation") else None,
            load=Load(reals(), reals(), reals(), reals()),
            peaks=Peaks(reals(), reals()),
            stage=Stage(reals(), reals(), reals()) if model.integrator in STAGED else None,
            neighbourhood=Neighbourhood(
                x=reals(),
                y=reals(),
                stale=np.ones(1, np.int64),
                cell=np.zeros((slots, 2), np.int64),
                bucket=np.zeros(buckets + 1, np.uint32),
                order=np.zeros(slots, np.uint32),
            ),
            pairs=self._pairs(entries),
            pair_law=model.pair_law,
            grid=model.grid,
            segments=model.segments,
            near_segments=self._near(slots, entries) if model.segments is not None else None,
            arcs=model.arcs,
            near_arcs=self._near(slots, entries) if model.arcs is not None else None,
            rail_law=model.rail_law,
            rail_contacts=_rail_contacts() if model.rail_law is not None else None,
            belts=belt_arrays(model.belt_shapes, slots, entries) if model.has("belts") else None,
            surface=self._surface(slots),
        )

    def _surface(self, slots: int) -> Surface | None:
        model, floor = self.model, len(self.model.belts)
        if model.base_friction is None:
            return None
        curved = model.has("curved_belts")
        centres = np.array([shape.centre for shape in model.belt_shapes] + [(0.0, 0.0)])
        return Surface(
            ux=np.zeros(floor + 1),
            uy=np.zeros(floor + 1),
            turn=np.zeros(floor + 1) if curved else None,
            cx=centres[:, 0].copy() if curved else None,
            cy=centres[:, 1].copy() if curved else None,
            friction=model.base_friction,
            carrier=np.full(slots, floor, dtype=np.int32),
        )


def _column_like(table: F8 | None, entries: int) -> F8 | None:
    """A column for an effect that is there, None for one that is not."""
    return None if table is None else np.zeros(entries)


def _rail_contacts() -> RailContacts:
    def reals() -> F8:
        return np.zeros(MOST_CONTACTS)

    def whole() -> U4:
        return np.zeros(MOST_CONTACTS, np.uint32)

    return RailContacts(
        nx=reals(),
        ny=reals(),
        overlap=reals(),
        share=reals(),
        material=whole(),
        rail=whole(),
        surface=whole(),
        solution=reals(),
    )
