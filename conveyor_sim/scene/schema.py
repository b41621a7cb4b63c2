# SPDX-License-Identifier: Apache-2.0
"""The scene: a user's description of a line, typed. SI units, angles in rad.

A scene is read with `load_scene`; tables in `docs/scene.md` and `docs/parts/` are generated from the fields below.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, Literal, get_args

from annotated_types import Len
from pydantic import Discriminator, PrivateAttr, Tag

from conveyor_sim.scene.accuracy import Accuracy, Preset
from conveyor_sim.scene.belts import Belt
from conveyor_sim.scene.contacts import Base, Contact
from conveyor_sim.scene.drives import NamedDrive
from conveyor_sim.scene.effect_names import EffectName, Forced
from conveyor_sim.scene.layout.plan import LayoutPlan
from conveyor_sim.scene.limits import Limits as DamageLimits
from conveyor_sim.scene.part import Part, one_of
from conveyor_sim.scene.parts.alarm import MeasuredAlarm
from conveyor_sim.scene.parts.axis import Axis
from conveyor_sim.scene.parts.carousel import Carousel
from conveyor_sim.scene.parts.counter import Counter
from conveyor_sim.scene.parts.device_part import DevicePart, Entry, Exit, Giver
from conveyor_sim.scene.parts.indicator import Indicator
from conveyor_sim.scene.parts.infeed import Infeed
from conveyor_sim.scene.parts.inspection import Inspection
from conveyor_sim.scene.parts.movers import AdjustableGuide, Clamp, Diverter, Divider, Gate, Pusher
from conveyor_sim.scene.parts.outfeed import Outfeed
from conveyor_sim.scene.parts.panel import Button, EmergencyStop, Horn, Lamp, NumberField, Selector, StackLight
from conveyor_sim.scene.parts.photo_eye import PhotoEye
from conveyor_sim.scene.parts.reject import Reject
from conveyor_sim.scene.parts.screw import Screw
from conveyor_sim.scene.parts.side_belt import SideBelt
from conveyor_sim.scene.parts.sink import Sink
from conveyor_sim.scene.parts.source import Source
from conveyor_sim.scene.parts.spill import Spill
from conveyor_sim.scene.parts.star import Star
from conveyor_sim.scene.parts.station import Station
from conveyor_sim.scene.parts.zone import Zone
from conveyor_sim.scene.plates import Plate
from conveyor_sim.scene.rails import Rail
from conveyor_sim.scene.types import (
    Angle,
    Count,
    Holds,
    Name,
    NotNegative,
    Number,
    OrText,
    Point,
    Positive,
    Seed,
    StartTime,
    Text,
    Velocity,
    Where,
    nanoseconds,
    quantity,
)
from conveyor_sim.scene.underlay import Underlay

Machine = Annotated[
    Annotated[Source, Tag("(source)")]
    | Annotated[Sink, Tag("(sink)")]
    | Annotated[Station, Tag("(station)")]
    | Annotated[Inspection, Tag("(inspection)")]
    | Annotated[Reject, Tag("(reject)")],
    one_of({kind: f"({kind})" for kind in ("source", "sink", "station", "inspection", "reject")}),
]


OnPanel = Annotated[
    Annotated[Button, Tag("(button)")]
    | Annotated[Selector, Tag("(selector)")]
    | Annotated[EmergencyStop, Tag("(emergency_stop)")]
    | Annotated[Lamp, Tag("(lamp)")]
    | Annotated[Horn, Tag("(horn)")]
    | Annotated[StackLight, Tag("(stack_light)")]
    | Annotated[NumberField, Tag("(numeric)")],
    one_of(
        {
            kind: f"({kind})"
            for kind in ("button", "selector", "emergency_stop", "lamp", "horn", "stack_light", "numeric")
        }
    ),
]


class BottleType(Part):
    """A kind of bottle."""

    radius: Positive = quantity("Outer radius R.", "m")
    mass: Positive = quantity("Mass m.", "kg")
    inertia: Positive | None = quantity(
        "Moment of inertia about the axis. Left out: m R^2, a thin-walled cylinder.", "kg m^2", default=None
    )
    contact_height: Positive | None = quantity(
        "Height at which bottles touch each other and rails, for the index of tipping. Needs `gravity_height`.",
        "m",
        default=None,
    )
    gravity_height: Positive | None = quantity(
        "Height of the centre of gravity, for the index of tipping. Needs `contact_height`.", "m", default=None
    )
    base_radius: Positive | None = quantity(
        "Radius of the ring that the bottle stands on. Friction on the ring couples sliding and spinning by a curve of "
        "its own, and is explicit with every friction_solver. Left out: the bottle stands on a point, as in the paper, "
        "even if other types have a ring.",
        "m",
        default=None,
    )
    material: Name = quantity("Material, as named in `contacts` and `base`.")

    @property
    def moment_of_inertia(self) -> float:
        """Moment of inertia about the axis (kg m^2): the one given, or m R^2."""
        return self.mass * self.radius**2 if self.inertia is None else self.inertia


class Floor(Part):
    """Support of bottles without a belt: a plane at rest."""

    friction: NotNegative | None = quantity(
        "Coefficient of friction of a bottle's base on the floor. "
        "Left out: that of the first listed belt for the bottle's material, `tangential` included; "
        "0 if there is no belt.",
        "1",
        default=None,
    )


class Single(Part):
    """One bottle at the start."""

    type: Name = quantity("Bottle type.")
    position: Point = quantity("Position of the axis.", "m")
    velocity: Velocity = quantity("Its velocity.", "m/s", default=(0.0, 0.0))
    angle: Angle = quantity("Its angle about its axis.", "rad", default=0.0)
    spin: Number = quantity("Its angular velocity, counter-clockwise.", "rad/s", default=0.0)


class GridOfBottles(Part):
    """Bottles at rest in rows."""

    type: Name = quantity("Bottle type.")
    origin: Point = quantity("Axis of the first bottle.", "m")
    rows: Count = quantity("Number of rows.", "1")
    columns: Count = quantity("Bottles in a row.", "1")
    pitch: Positive = quantity("Distance between neighbours in a row.", "m")
    pattern: Literal["square", "hexagonal"] = quantity(
        "square: rows a pitch apart; hexagonal: every second row shifted by half a pitch, rows sqrt(3)/2 pitch apart.",
        default="square",
    )
    angle: Angle = quantity("Direction of the rows; the columns grow to the left of it.", "rad", default=0.0)


class Grid(Part):
    """An entry of `bottles` for a grid of bottles."""

    grid: GridOfBottles = quantity("The bottles of the grid.")


class Outputs(Part):
    """Rate of each topic in simulated time, published and recorded; 0 is never. Each divides the tick rate."""

    bottles: NotNegative = quantity("State of every bottle.", "Hz", default=50.0)
    poses: NotNegative = quantity("Poses of the bottles, and their markers.", "Hz", default=50.0)
    contacts: NotNegative = quantity("Every contact with its forces.", "Hz", default=50.0)
    belts: NotNegative = quantity("Speeds of the belts.", "Hz", default=50.0)
    signals: NotNegative = quantity("The process image.", "Hz", default=100.0)
    counters: NotNegative = quantity("Counters and times of machines.", "Hz", default=1.0)
    ledger: NotNegative = quantity(
        "Energy ledger: work of each belt, dissipated and stored energy, and the residual.",
        "Hz",
        default=0.0,
    )
    damage: NotNegative = quantity(
        "Loads on every bottle (scuffing, crushing, impacts, tipping), and the wear of the rails.",
        "Hz",
        default=0.0,
    )


@dataclass(frozen=True)
class Origin:
    """Source of a scene. Scenes with the same content are equal regardless of their source."""

    text: str = field(default="", compare=False)
    name: str = field(default="", compare=False)
    given: str = field(default="", compare=False)
    """Overrides of the text, as YAML."""
    overrides: str = field(default="", compare=False)
    """Overrides and the content of other files, as YAML. With the text, it gives the scene without these files."""
    streams_by_index: bool = False
    """True if random streams are keyed by places in lists, as in old recordings, and not by names."""
    counts_starts: bool = False
    """True if machines count started cycles and work while they wait, as in recordings before format 3."""
    friction_anew: bool = False
    """True if implicit friction is solved anew in each step, as in recordings before format 4."""
    files: Mapping[str, str] = field(default_factory=dict, compare=False)
    """Texts of the files that an expanded scene was read from beside its own, by path from its folder."""
    is_expanded: bool = field(default=False, compare=False)
    """True if the text uses the layout language, so that recordings hold the expanded scene."""


def _bottle_tag(data: Any) -> str:
    return "(grid)" if isinstance(data, Grid) or (isinstance(data, Mapping) and "grid" in data) else "(single)"


def _floor_tag(data: Any) -> str:
    return "(none)" if isinstance(data, str) else "(floor)"


def _named(what: str) -> Holds:
    return Holds(f"a mapping of names to {what}")


class Scene(Part):
    """A line: its parts and materials, the duration and the accuracy of its simulation."""

    TOPICS: ClassVar[tuple[str, ...]] = tuple(Outputs.model_fields)

    name: Name = quantity("Name of the scene.")
    description: Text = quantity("Purpose of the scene.", default="")
    where: Where = quantity("Where the line is in a plant: area/cell/unit.", default="")
    start_time: StartTime = quantity(
        "Date and time at simulated time 0. Results do not depend on it.",
        default="2000-01-01T00:00:00Z",
    )
    seed: Seed = quantity("Seed of all random draws.", "1", default=0)
    gravity: NotNegative = quantity("Acceleration of gravity g.", "m/s^2", default=9.81)
    duration: Positive = quantity("Simulated time, a whole number of ticks.", "s")
    tick: Positive = quantity(
        "Scan cycle, in whole nanoseconds: commands act and outputs appear at ticks.", "s", default=0.01
    )
    accuracy: Annotated[
        Accuracy,
        OrText((*get_args(Preset), "fast")),
        Holds('"fast", "draft", "standard", "fine", or a mapping with the fields ' + ", ".join(Accuracy.model_fields)),
    ] = quantity(
        "Accuracy of the integration of a tick: a preset such as `fine`, or a mapping.",
        default=Accuracy.model_construct(),
    )
    slip_limit: Positive = quantity("Speed v_lim below which friction is regularised (7)-(10).", "m/s", default=0.01)
    friction_curve: Literal["polynomial", "atan"] = quantity(
        "Friction as a function of slip. polynomial: (7)-(10), constant from v_lim on; atan: 2/pi x atan(pi x "
        "speed / v_lim), with the same slope at rest. Ring-shaped bases have a special curve.",
        default="polynomial",
    )
    friction_solver: Literal["explicit", "implicit"] = quantity(
        "explicit: friction bounds the time step. implicit: friction is solved for the velocity at the end of a "
        "step, and does not bound it (with leapfrog, semi_implicit_euler, velocity_verlet and rk4; friction of "
        "ring-shaped bases remains explicit).",
        default="explicit",
    )
    lever_arm: Literal["overlap", "radius"] = quantity(
        "Lever arm of friction at a contact. overlap: to the middle of the overlap, which conserves angular momentum; "
        "radius: the bottle's radius, as in the paper.",
        default="overlap",
    )
    contacts: Annotated[tuple[Contact, ...], Holds("a list of contacts")] = quantity(
        "Contact laws of the materials that can touch.", default=()
    )
    base: Annotated[tuple[Base, ...], Holds("a list of base frictions")] = quantity(
        "Friction of bottles on belts and plates.", default=()
    )
    bottle_types: Annotated[dict[Name, BottleType], Len(1), _named("bottle types, at least one")] = quantity(
        "Kinds of bottles."
    )
    panel: Annotated[dict[Name, OnPanel], _named("parts of the panel")] = quantity(
        "Operator panel: inputs and outputs beside the line.", default={}
    )
    drives: Annotated[dict[Name, NamedDrive], _named("drives")] = quantity(
        "Drives that move several belts.", default={}
    )
    axes: Annotated[dict[Name, Axis], _named("axes")] = quantity(
        "Axes that move machines in step: star wheels, screws, turn-tables.", default={}
    )
    belts: Annotated[dict[Name, Belt], _named("belts")] = quantity(
        "Belts. Where belts overlap, the last one in the list carries.", default={}
    )
    plates: Annotated[dict[Name, Plate], _named("plates")] = quantity(
        "Surfaces at rest. Where they overlap belts, plates carry.", default={}
    )
    rails: Annotated[dict[Name, Rail], _named("rails")] = quantity(
        "Rails. Rails that join end to end, or end on another rail, are one surface.", default={}
    )
    gates: Annotated[dict[Name, Gate], _named("gates")] = quantity(
        "Gates and stops: rails that open and close on command.", default={}
    )
    pushers: Annotated[dict[Name, Pusher], _named("pushers")] = quantity(
        "Rails that push on command and return.", default={}
    )
    diverters: Annotated[dict[Name, Diverter], _named("diverters")] = quantity(
        "Rails that swing into the path of bottles on command and return.", default={}
    )
    dividers: Annotated[dict[Name, Divider], _named("dividers")] = quantity(
        "Lane dividers and lane switches: rails that move between the positions of several lanes.", default={}
    )
    adjustable: Annotated[dict[Name, AdjustableGuide], _named("adjustable guides")] = quantity(
        "Guides that a drive sets to one of several positions, such as those of formats.", default={}
    )
    clamps: Annotated[dict[Name, Clamp], _named("clamps")] = quantity(
        "Pairs of jaws that close on bottles on command.", default={}
    )
    stars: Annotated[dict[Name, Star], _named("star wheels")] = quantity(
        "Wheels that carry bottles in pockets.", default={}
    )
    carousels: Annotated[dict[Name, Carousel], _named("carousels")] = quantity(
        "Tools of star wheels that work on bottles: fillers, cappers, labellers.", default={}
    )
    screws: Annotated[dict[Name, Screw], _named("infeed screws")] = quantity(
        "Screws that space bottles to a pitch.", default={}
    )
    side_belts: Annotated[dict[Name, SideBelt], _named("side belts")] = quantity(
        "Belts on edge beside the path of bottles: timing belts, side grippers.", default={}
    )
    floor: Annotated[
        Annotated[Floor, Tag("(floor)")] | Annotated[Literal["none"], Tag("(none)")],
        Discriminator(_floor_tag),
        Holds('a mapping with the field friction, or "none"'),
    ] = quantity(
        'Support of bottles that no belt or plate carries; "none": they slide without friction.',
        default=Floor.model_construct(),
    )
    infeeds: Annotated[dict[Name, Infeed], _named("infeeds")] = quantity("Places where bottles enter.", default={})
    outfeeds: Annotated[dict[Name, Outfeed], _named("outfeeds")] = quantity("Regions where bottles leave.", default={})
    machines: Annotated[dict[Name, Machine], _named("machines")] = quantity(
        "Machines at the line: sources and sinks of bottles, stations, inspections, rejects.", default={}
    )
    spills: Annotated[dict[Name, Spill], _named("spills")] = quantity(
        "Places where a test can put bottles.", default={}
    )
    photo_eyes: Annotated[dict[Name, PhotoEye], _named("photo-eyes")] = quantity(
        "Beams that bottles block.", default={}
    )
    zones: Annotated[dict[Name, Zone], _named("zones")] = quantity("Regions in which bottles are counted.", default={})
    counters: Annotated[dict[Name, Counter], _named("counters")] = quantity(
        "Lines that count the bottles that pass.", default={}
    )
    indicators: Annotated[dict[Name, Indicator], _named("indicators")] = quantity(
        "Indicators of exits: flow, jam, starved, blocked.", default={}
    )
    alarms: Annotated[dict[Name, MeasuredAlarm], _named("alarms")] = quantity(
        "Alarms on measured values, in addition to the alarms of the line.", default={}
    )
    bottles: Annotated[
        tuple[
            Annotated[Annotated[Single, Tag("(single)")] | Annotated[Grid, Tag("(grid)")], Discriminator(_bottle_tag)],
            ...,
        ],
        Holds("a list of bottles and grids"),
    ] = quantity("Bottles at the start.", default=())
    outputs: Outputs = quantity("Rates of the outputs.", default=Outputs.model_construct())
    limits: Annotated[DamageLimits, Holds("a mapping with the fields " + ", ".join(DamageLimits.model_fields))] = (
        quantity(
            "Largest loads of bottles; a larger load is reported as an event.",
            default=DamageLimits.model_construct(),
        )
    )
    effects: Annotated[Forced, Holds('a mapping of names of effects to "on" or "off"')] = quantity(
        "Effects that are forced on or off; docs/effects.md lists all effects.", default={}
    )

    underlay: Annotated[Underlay | None, Holds("a mapping with the fields " + ", ".join(Underlay.model_fields))] = (
        quantity("An image or a drawing that is shown below the plan.", default=None)
    )

    _source: Origin = PrivateAttr(default=Origin())
    _underlay: tuple[str, str] = PrivateAttr(default=("", ""))
    _layout: LayoutPlan | None = PrivateAttr(default=None)

    @property
    def tick_ns(self) -> int:
        """Length of a tick (ns)."""
        return nanoseconds(self.tick)

    @property
    def duration_ticks(self) -> int:
        """Duration (ticks)."""
        return nanoseconds(self.duration) // self.tick_ns

    def named(self) -> dict[str, dict[str, Part]]:
        """Named parts by field, then by name."""
        fields = ((name, getattr(self, name)) for name in type(self).model_fields if name != "effects")
        return {name: value for name, value in fields if isinstance(value, dict)}

    def devices(self) -> Iterator[tuple[tuple[str, str], DevicePart]]:
        """Yield the parts that become devices with their paths, in the order in which devices act."""
        for place, parts in self.named().items():
            yield from (((place, name), part) for name, part in parts.items() if isinstance(part, DevicePart))

    def entries(self) -> Iterator[tuple[tuple[str, str], Entry]]:
        """Yield the parts that new bottles come from with their paths."""
        yield from ((path, part) for path, part in self.devices() if isinstance(part, Entry))

    def givers(self) -> Iterator[tuple[tuple[str, str], Giver]]:
        """Yield the parts that put bottles onto the line, new or not, with their paths."""
        yield from ((path, part) for path, part in self.devices() if isinstance(part, Giver))

    def exits(self) -> Iterator[tuple[tuple[str, str], Exit]]:
        """Yield the parts by which bottles leave with their paths."""
        yield from ((path, part) for path, part in self.devices() if isinstance(part, Exit))

    def every(self, topic: str) -> int:
        """Return the ticks between two outputs of a topic, 0 without output. Raise KeyError for unknown topics."""
        if topic not in self.TOPICS:
            raise KeyError(topic)
        rate = 0.0 if self._silenced(topic) else getattr(self.outputs, topic)
        return round(1e9 / (rate * self.tick_ns)) if rate else 0

    def _silenced(self, topic: str) -> bool:
        """Return True if the effect of an output is forced off."""
        behind: dict[str, EffectName] = {"contacts": "contact_arrays", "ledger": "energy_ledger"}
        return topic in behind and self.effects.get(behind[topic]) == "off"

    @property
    def streams_by_index(self) -> bool:
        """True if random streams are keyed by places in lists, as in old recordings, and not by names of devices."""
        return self._source.streams_by_index

    @property
    def counts_starts(self) -> bool:
        """True if machines count started cycles and work while they wait, as in recordings before format 3."""
        return self._source.counts_starts

    @property
    def friction_anew(self) -> bool:
        """True if implicit friction is solved anew in each step, as in recordings before format 4."""
        return self._source.friction_anew

    @property
    def layout(self) -> LayoutPlan | None:
        """Plan of the conveyors that the scene was expanded from; None without conveyors."""
        return self._layout

    @property
    def source_text(self) -> str:
        """Text of the scene, verbatim."""
        return self._source.text

    @property
    def source_name(self) -> str:
        """Name of the scene's file, as given."""
        return self._source.name

    @property
    def underlay_url(self) -> str:
        """Content of the underlay as a data URL; "" without."""
        return self._underlay[0]

    @property
    def underlay_fault(self) -> str:
        """Reason why the underlay can't be shown; "" if it can, or if there is none."""
        return self._underlay[1]

    @property
    def source_files(self) -> Mapping[str, str]:
        """Texts of the files that an expanded scene was read from beside its own, by path from its folder.

        An underlay is a data URL.
        """
        return self._source.files

    @property
    def is_expanded(self) -> bool:
        """True if the text uses the layout language: recordings then hold the expanded scene (`recorded.py`)."""
        return self._source.is_expanded

    @property
    def overrides_text(self) -> str:
        """Overrides and tables from files, as YAML: everything beyond the text."""
        return self._source.overrides

    @property
    def given_overrides(self) -> str:
        """Overrides as YAML, "" without overrides."""
        return self._source.given
