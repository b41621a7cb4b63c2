# SPDX-License-Identifier: Apache-2.0
"""Tables of tags in docs/line.md and docs/parts/, generated from a scene with one device of each kind."""

from collections.abc import Iterator

from conveyor_sim.line.commands.authority import MAY
from conveyor_sim.line.commands.inputs import WRITER_KINDS
from conveyor_sim.line.line import image_of
from conveyor_sim.line.machines.weihenstephan import DATA_POINTS
from conveyor_sim.line.tag import Tag
from conveyor_sim.scene import parse_scene
from conveyor_sim.scene.parts.alarm import PREFIX

EVERYTHING = """
name: everything
duration: 1.0
bottle_types: {bottle: {radius: 0.03, mass: 0.3, material: glass}}
contacts:
  - {between: [glass, glass], stiffness: 5000}
  - {between: [glass, rail], stiffness: 5000}
base: [{between: [glass, chain], friction: 0.4}]
panel:
  button: {kind: button}
  maintained: {kind: button, action: maintained, contact: NC}
  selector: {kind: selector, positions: [manual, auto]}
  estop: {kind: emergency_stop, cuts: [drives, machines], deceleration: 1}
  lamp: {kind: lamp}
  horn: {kind: horn}
  stack: {kind: stack_light}
  number: {kind: numeric, unit: m/s, limits: [0, 1], written_by: both}
drives: {m: {acceleration: 1.0, pulses_per_metre: 1000}}
axes: {a: {rate: 1, rate_limit: 2}, f: {drive: m, travel: 1}, s: {master: a, torque_limit: 20}}
belts:
  b:
    {kind: straight, start: [0, 0], angle: 0, length: 10, width: 1, material: chain,
     drive: {acceleration: 1.0, pulses_per_metre: 1000}}
gates:
  g:
    {kind: slide, from: [1, 0], to: [1, 1], direction: 90 deg, stroke: 1, max_speed: 1, acceleration: 5, material: rail}
pushers:
  p: {from: [2, 0], to: [3, 0], direction: 90 deg, stroke: 0.5, max_speed: 1, acceleration: 5, material: rail, zone: z}
diverters:
  d: {from: [4, 0], to: [4.5, 0], angle: 45 deg, max_speed: 1, acceleration: 5, material: rail}
dividers:
  v:
    {kind: swing, from: [4, 0.5], to: [4.5, 0.5], positions: [-20 deg, 0 deg, 20 deg], max_speed: 1,
     acceleration: 5, material: rail}
adjustable:
  a:
    {from: [7, 0.1], to: [7.5, 0.1], direction: 90 deg, positions: [0, 10 mm], max_speed: 1, acceleration: 5,
     material: rail}
clamps:
  k:
    {from: [6.2, 0.2], to: [6.4, 0.2], direction: 90 deg, opening: 0.1, stroke: 0.03, max_speed: 1, acceleration: 5,
     material: rail}
stars:
  st:
    {centre: [1, 5], turn: left, entry: -90 deg, pockets: 12, pitch_radius: 0.3, pocket_radius: 34 mm, axis: a,
     material: rail}
carousels:
  ca: {star: st, from: 30 deg, to: 120 deg, sets: {test: {to: 1}}, tests: {test: {low: 1}}}
screws:
  sc: {from: [2, 5], to: [2.6, 5], side: left, pitch: [[0, 70 mm]], pocket_radius: 34 mm, axis: a, material: rail}
side_belts:
  sb: {from: [3, 5], to: [4, 5], material: rail}
infeeds:
  i: {bottle: bottle, types: [bottle], position: [0.1, 0.5], direction: 0, speed: 0.5, rate: 1, rate_limit: 2}
outfeeds: {o: {region: [[9.5, 0], [10, 0], [10, 1]]}}
machines:
  source: {kind: source, bottle: bottle, types: [bottle], position: [0.5, 0.2], direction: 0, speed: 0.5, rate: 1}
  sink: {kind: sink, region: [[9, 0], [9.4, 0], [9.4, 1]], rate: 1}
  station:
    {kind: station, region: [[3, 0.6], [3.2, 0.6], [3.2, 1]], position: [3.5, 0.8], direction: 0, speed: 0.5, rate: 1,
     sets: {test: {to: 1}}, tests: {test: {low: 1}}}
  carrier:
    {kind: station, region: [[3.6, 0.6], [3.8, 0.6], [3.8, 1]], position: [3.9, 0.8], direction: 0, speed: 0.5, rate: 1,
     capacity: 3, hold: 2}
  inspection: {kind: inspection, from: [5, 0], to: [5, 1]}
  reject: {kind: reject, region: [[6, 0], [6.1, 0], [6.1, 1]]}
spills: {s: {bottle: bottle, position: [7, 0.5], count: 3}}
photo_eyes: {e: {from: [8, 0], to: [8, 1]}}
zones: {z: {region: [[8, 0], [8.5, 0], [8.5, 1]], full_at: 3}}
counters: {c: {from: [8.5, 0], to: [8.5, 1]}}
indicators: {i: {counter: c, zone: z, belt: b, backup: z, jam_time: 5}}
"""
"""Scene with one device of each kind, and all its optional features."""

PAGES: dict[str, dict[str, tuple[str, ...]]] = {
    "parts/axes": {"axes": ("axes",)},
    "parts/belts": {"belts": ("belts", "drives")},
    "parts/infeeds": {"feeds": ("infeeds", "outfeeds"), "spills": ("spills",)},
    "parts/machines": {"machines": ("machines",)},
    "parts/movers": {"movers": ("gates", "pushers", "diverters", "clamps")},
    "parts/dividers": {"dividers": ("dividers", "adjustable")},
    "parts/carousels": {"carousels": ("carousels",)},
    "parts/stars": {"stars": ("stars",)},
    "parts/screws": {"screws": ("screws",)},
    "parts/side_belts": {"side_belts": ("side_belts",)},
    "parts/photo_eyes": {"photo_eyes": ("photo_eyes",)},
    "parts/zones": {"zones": ("zones",), "counters": ("counters",)},
    "parts/indicators": {"indicators": ("indicators",)},
    "parts/panel": {"panel": ("panel",)},
    "parts/alarms": {"alarms": ("alarm_counts", "alarms")},
    "line": {"run": ("run",)},
}
"""Fields of a scene whose devices a table of tags lists, by page of docs/ and name of the table."""


def tables() -> dict[str, dict[str, str]]:
    """Return the tables by their names; pages by their path in docs/ without suffix."""
    tags = image_of(parse_scene(EVERYTHING)).tags
    pages = {
        page: {
            name: "\n".join(_rows([tag for tag in tags if tag.name.split("/")[0] in fields]))
            for name, fields in sections.items()
        }
        for page, sections in PAGES.items()
    }
    pages["line"]["authority"] = "\n".join(_rights())
    pages["parts/data_points"] = {"weihenstephan": "\n".join(_data_points())}
    return pages


def _rights() -> Iterator[str]:
    kinds = [kind for kind in WRITER_KINDS if kind != "line"]
    yield f"| operation | {' | '.join(kinds)} | meaning |"
    yield "|---|" + "---|" * len(kinds) + "---|"
    for operation, right in MAY.items():
        yield f"| `{operation}` | {' | '.join('yes' * (kind in right.writers) for kind in kinds)} | {right.what} |"


def _data_points() -> Iterator[str]:
    yield "| data point | number | tags | meaning |"
    yield "|---|---|---|---|"
    for name, point in DATA_POINTS.items():
        yield f"| `{name}` | {point.number} | {', '.join(f'`{tag}`' for tag in point.tags)} | {point.what} |"


def _rows(tags: list[Tag]) -> Iterator[str]:
    """Yield the rows of a table. Tags of several devices that differ in the device only share a row."""
    yield "| tag | role | kind, unit | initial | meaning |"
    yield "|---|---|---|---|---|"
    names: dict[str, list[str]] = {}
    for tag in tags:
        kind = tag.kind if tag.unit == "1" else tag.unit
        texts = f" {tag.listed_texts}." if tag.texts else ""
        signal = tag.name.rpartition("/")[2]
        row = f"{tag.role} | {kind} | {tag.initial:g} | {tag.description}{texts} |"
        names.setdefault(f"{signal} | {row}", []).append(f"`{_pattern(tag)}`")
    for key, named in names.items():
        yield f"| {', '.join(named)} | {key.partition(' | ')[2]}"


def _pattern(tag: Tag) -> str:
    """Return the tag's name with `<name>` for that of the device; machines are named by their kind."""
    before, name = (PREFIX, tag.name.removeprefix(PREFIX)) if tag.name.startswith(PREFIX) else ("", tag.name)
    field, _, rest = name.partition("/")
    device, _, what = rest.partition("/")
    return before + (f"{field}/<{device}>/{what}" if what else name)
