# SPDX-License-Identifier: Apache-2.0
"""Effects of real lines that the simulation does not model, with consequences and alternatives.

`conveyor-sim explain --limits` prints this list, and docs/limits.md is generated from it.
"""

from dataclasses import dataclass
from textwrap import wrap


@dataclass(frozen=True)
class Limit:
    """Something that acts on a real line and that the simulation leaves out."""

    effect: str
    """Name."""
    model: str
    """Substitute in the simulation."""
    consequence: str
    """Difference that a line engineer must expect."""
    instead: str
    """Alternative within the simulation, or a measurement that answers the question."""


LIMITS: dict[str, tuple[Limit, ...]] = {
    "Bottles": (
        Limit(
            "three-dimensional motion, falling over",
            "The plan is two-dimensional. Bottles stay upright.",
            "A bottle that would fall stays up and goes on, so jams by fallen bottles are missing.",
            "Enable `tipping`: an index of 1 means that the bottle would tip. Compare it with a tilting test.",
        ),
        Limit(
            "slopes, lifts and heights",
            "Belts, plates and the floor form one horizontal plane. All contacts act in that plane.",
            "Bottles neither slide down an incline nor hit a step, and contacts at different heights are alike.",
            "Simulate the level parts. Replace a lift by a station with its time.",
        ),
        Limit(
            "liquid in bottles",
            "A bottle is a rigid body. Its mass changes only when a station gives it another type (`changes`).",
            "Sloshing, foam and spilling are missing. Filled bottles brake and tip differently.",
            "Test accelerations with real bottles.",
        ),
        Limit(
            "shapes other than circles",
            "The outline of a bottle is a circle, its base a point or a ring.",
            "Square, oval and handled containers do not jam by their corners or turn into place.",
            "None. A circle of the diagonal or of the side gives the two extremes of the room that they need.",
        ),
        Limit(
            "tolerances of bottles",
            "All bottles of a type have equal radius, mass and friction.",
            "Bottles that are out of tolerance, and their jams in narrow lanes, are missing.",
            "Run the scene with bottles of the largest and of the smallest permitted radius.",
        ),
        Limit(
            "deformation beyond the contact law",
            "A contact is a spring with damping at one point. The outline stays a circle.",
            "Dents, ovalisation of PET and sidewall buckling are missing, as is their effect on other contacts.",
            "Take force over overlap from a press test as `table`. Compare squeeze loads with a limit.",
        ),
        Limit(
            "breakage",
            "Bottles never break. Loads above a limit are reported.",
            "Shards, spilled product and the stops that they cause are missing.",
            "Set `limits` for impacts and crushing. Model the stops as failures of a machine.",
        ),
        Limit(
            "cases, packs, trays and pallets",
            "Only single bottles move. Machines that pack remove them.",
            "Nothing is conveyed behind the packer.",
            "End the scene at the packer, with its cycle and its failures.",
        ),
    ),
    "Contacts and friction": (
        Limit(
            "static friction above kinetic friction, dependence on speed",
            "One coefficient per pair of materials holds at every slip above the slip limit.",
            "Stick-slip, squeal and the higher force at a start are missing.",
            "Use the larger coefficient for pressure and tipping, the smaller one for throughput; compare both.",
        ),
        Limit(
            "lubrication and its history",
            "Coefficients are constant in place and time.",
            "Dry spots, lubricant that runs out, and lines that start wet are missing.",
            "Run the scene with the coefficients of the dry and of the lubricated chain. Measure both.",
        ),
        Limit(
            "wear and dirt",
            "Chains, guides and bottles do not change during a run.",
            "Friction and clearances of a worn line differ from those of a new one.",
            "Vary friction and clearances in a study (`conveyor-sim sweep`).",
        ),
        Limit(
            "temperature and humidity",
            "No law depends on them.",
            "Softer PET, expanded chains and condensation are missing.",
            "Measure friction and stiffness under operating conditions.",
        ),
        Limit(
            "static electricity and adhesion",
            "Contacts do not attract. Only the damping law `paper` may pull at the end of a rebound.",
            "Empty PET that clings to guides, and wet bottles that stick together, move freely here.",
            "None. A larger friction coefficient does not replace it, because it holds no bottle without pressure.",
        ),
        Limit(
            "rolling resistance",
            "Bottles roll along guides and each other without loss. Only friction under a ring base brakes their spin.",
            "Bottles on points roll too easily. Scuffing of rails is then wrong by up to a factor of two.",
            "Set `base_radius` (docs/base.md).",
        ),
        Limit(
            "air drag and air conveyors",
            "Air exerts no force.",
            "Air conveyors and blowers can't be simulated. On chains the drag is negligible.",
            "Replace an air conveyor by a belt of low friction and check its speeds against the real ones.",
        ),
    ),
    "Belts and guides": (
        Limit(
            "links of the chain",
            "A belt is a smooth surface of one speed. Its `vibration` is a sine, and off unless set.",
            "Bumps of links and gaps between strands are missing, as is the ripple of speed of a chain on a sprocket.",
            "Set `vibration` with a measured amplitude and frequency. It changes creep and pressure in queues.",
        ),
        Limit(
            "gaps and edges at transfers",
            "The belt under the axis carries a bottle, or belts share a ring base. Edges have no height.",
            "Bottles do not catch, tilt or hesitate at transfers.",
            "`check` warns of wide gaps. Measure the losses at real transfers and model them as failures.",
        ),
        Limit(
            "stretch and slack of belts",
            "A belt moves everywhere at the speed of its drive times its ratio.",
            "Pulsing of long chains, slack on reversal and a late start of the far end are missing.",
            "Divide a long chain into belts with drives of their own and delay their commands.",
        ),
        Limit(
            "elasticity of guides",
            "Fixed guides do not move. The stiffness of a contact belongs to a point of it.",
            "Guides do not bulge under pressure, so lanes do not widen and forces on bottles are too large.",
            "Reduce the stiffness of contacts with the material of the guide.",
        ),
        Limit(
            "the third dimension of star wheels and screws",
            "A wheel, its guide and the thread of a screw touch bottles at one height, and are rigid.",
            "Bottles do not lean in pockets. A turning screw does not rub across the path, lift or spin bottles.",
            "Choose the friction of the contact, and the play of pockets, as measured with bottles of the format.",
        ),
        Limit(
            "robots",
            "Bodies move along straight lines, about a pivot, or on a cam. Stations take bottles and return them.",
            "Forces of grippers that pick bottles up are missing.",
            "Use a station with the cycle of the machine.",
        ),
    ),
    "Drives, sensors and machines": (
        Limit(
            "dynamics of drives below the ramp",
            "A drive follows its ramp exactly under any load. Only rails that move and axes have a limit.",
            "Slip of motors, controllers that overshoot and overload trips of a jammed chain are missing.",
            "Inject the fault `trip`. Compare the work of belts in the energy ledger with the rating of the drive.",
        ),
        Limit(
            "optics of sensors",
            "A beam is a line without width, which the outline of a bottle blocks.",
            "Transparent bottles, reflections, dirt and ambient light do not disturb it.",
            "Inject the faults `stuck_on`, `stuck_off`, `chatter` and `delay`. Set `debounce` as in the device.",
        ),
        Limit(
            "processes in machines",
            "Fillers, labellers and inspections are cycles with states, failures and attributes of bottles.",
            "Fill levels, torque of caps and quality follow given distributions, not physics.",
            "Give stations measured distributions.",
        ),
        Limit(
            "people",
            "No operator clears a jam or stands a bottle up. Times to repair are given distributions.",
            "A jam without an automatic reaction lasts to the end of the run.",
            "Add the reaction to the controller or to a scenario.",
        ),
        Limit(
            "sound",
            "It is not computed.",
            "No noise level follows from a run.",
            "Impact speeds and their number are a relative measure for comparisons of layouts.",
        ),
    ),
}
"""By subject."""

LEAST_WIDTH = 70
"""Characters of a line below which the list can't be read."""

_INTRODUCTION = """# What it does not model

<!-- Generated by `make docs` from conveyor_sim/physics/effects/limits.py. -->

The list contains effects of real lines that the simulation leaves out. Each entry states the model used, the
consequence, and an alternative. `conveyor-sim explain --limits` prints the list. [Effects](effects.md) lists the
effects that are modelled, [accuracy](accuracy.md) the numerical error, and [validation](validation.md) the comparison
with published experiments.
"""


def limits_page() -> str:
    """Return the text of docs/limits.md."""
    parts = [_INTRODUCTION]
    for subject, limits in LIMITS.items():
        rows = [f"| {one.effect} | {one.model} | {one.consequence} | {one.instead} |" for one in limits]
        heading = "| not modelled | in the simulation | consequence | instead |\n| --- | --- | --- | --- |"
        parts.append("\n".join([f"## {subject}", heading, *rows, ""]))
    return "\n".join(parts)


def limits_text(width: int) -> list[str]:
    """Return the list as lines of at most `width` characters, or of LEAST_WIDTH if that is more."""
    width = max(width, LEAST_WIDTH)
    lines = wrap("not modelled, with the model used, the consequence and an alternative:", width)
    for subject, limits in LIMITS.items():
        lines += ["", subject]
        for one in limits:
            lines.append(f"  {one.effect}")
            for heading, text in (("model", one.model), ("consequence", one.consequence), ("instead", one.instead)):
                lines += wrap(text, width, initial_indent=f"    {heading:13}", subsequent_indent=" " * 17)
    return lines
