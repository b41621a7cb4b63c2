# SPDX-License-Identifier: Apache-2.0
"""Overview of a scene in at most twelve lines: contents, flow, accuracy, steps, speed, findings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from conveyor_sim.physics.effects.notes import bottles_on_points
from conveyor_sim.physics.effects.sprung_walls import sprung_walls
from conveyor_sim.physics.model import Model
from conveyor_sim.physics.model.remedies import StepLimit
from conveyor_sim.physics.model.slow_drag import slow_drag
from conveyor_sim.physics.timestep.prediction import expected_deep_warning, percent
from conveyor_sim.report.flow.exit_findings import ending, has_exit
from conveyor_sim.report.flow.finding import Finding
from conveyor_sim.report.flow.flow import LineFlow
from conveyor_sim.report.flow.routes import TransitRoute
from conveyor_sim.report.flow.stretches import feed_rate
from conveyor_sim.report.labelled import MOST_LINES, labelled
from conveyor_sim.run.speed import expected_factor
from conveyor_sim.scene import Scene
from conveyor_sim.scene.places import Places
from conveyor_sim.scene.problems import dotted
from conveyor_sim.support.printable import printable

MOST_ROUTES = 2
"""Largest number of lines about the flow."""


def overview(scene: Scene, model: Model, limit: StepLimit, flow: LineFlow) -> list[str]:
    """Return the overview, without the line about the picture, which the caller adds."""
    lines = [
        f"{printable(scene.name)}: valid. {_contents(scene, model)}; "
        f"{scene.duration:g} s in ticks of {1e3 * scene.tick:g} ms",
        *_flow_lines(scene, flow),
        labelled("accuracy", _accuracy(model)),
        *([] if model.settling is None else [labelled("settling", model.settling.sentence)]),
        labelled("step", _step(limit)),
        labelled("speed", expected_factor(limit)),
    ]
    findings = all_findings(model, flow)
    room = MOST_LINES - 1 - len(lines)
    if len(findings) > room:
        more = len(findings) - room + 1
        return [*lines, *_finding_lines(scene, findings[: room - 1]), labelled("", f"{more} more findings: --details")]
    return [*lines, *_finding_lines(scene, findings)]


def finding_lines(scene: Scene, model: Model, flow: LineFlow) -> list[str]:
    """Return a line for each finding, with file, line and field."""
    return list(_finding_lines(scene, all_findings(model, flow)))


def all_findings(model: Model, flow: LineFlow) -> list[Finding]:
    """Return all findings, warnings first."""
    findings = [*flow.findings, *_slow_belts(model), *_sprung_walls(model), *_deep(model), *_points(model)]
    return sorted(findings, key=lambda finding: finding.level != "warning")


def _finding_lines(scene: Scene, findings: Sequence[Finding]) -> Iterator[str]:
    places = Places(scene)
    for finding in findings:
        yield labelled(finding.level, finding.line(places))


def _contents(scene: Scene, model: Model) -> str:
    layout = scene.layout
    counts = [
        (len(layout.conveyors), "conveyor") if layout is not None else (len(scene.belts), "belt"),
        (len(model.plant.rails_at_rest), "rail"),
        (len(model.plant.machines), "moving rail"),
    ]
    entries = [
        f"{'endless' if part.most is None else part.most}" for path, part in scene.entries() if path[0] == "infeeds"
    ]
    infeeds = f"{_count(len(entries), 'infeed')} ({_infeed_bottles(entries)})" if entries else ""
    rest = [
        (len(scene.machines), "machine"),
        (sum(len(part) for part in (scene.photo_eyes, scene.zones, scene.counters)), "sensor"),
        (len(model.plant.bottles), "bottle at the start"),
    ]
    parts = [
        *(_count(*count) for count in counts if count[0]),
        infeeds,
        *(_count(*count) for count in rest if count[0]),
    ]
    return ", ".join(filter(None, parts)) or "empty"


def _infeed_bottles(most: Sequence[str]) -> str:
    if "endless" in most:
        return "endless"
    return _count(sum(int(count) for count in most), "bottle")


def _count(number: int, what: str) -> str:
    plural = what.replace("bottle at", "bottles at") if "bottle at" in what else f"{what}s"
    return f"{number} {what if number == 1 else plural}"


def _flow_lines(scene: Scene, flow: LineFlow) -> list[str]:
    if not flow.routes:
        return [labelled("flow", "nothing to trace: no belts or no bottles")]
    groups: dict[tuple[object, ...], list[TransitRoute]] = {}
    for route in flow.routes:
        groups.setdefault((route.stops[1:], route.last.end), []).append(route)
    texts = [_group(scene, flow, routes) for routes in groups.values()]
    if len(texts) > MOST_ROUTES:
        texts[MOST_ROUTES - 1 :] = [f"{len(texts) - MOST_ROUTES + 1} more routes: --details"]
    lines = [labelled("" if index else "flow", text) for index, text in enumerate(texts)]
    capacity = _capacity(scene, flow)
    return [*lines, labelled("capacity", capacity)] if capacity else lines


def _group(scene: Scene, flow: LineFlow, routes: Sequence[TransitRoute]) -> str:
    """Return routes with the same stops behind their entries in one line."""
    first = routes[0]
    names = [_name(route.entry) for route in routes]
    entries = names[0] if len(names) == 1 else f"{names[0]} ... {names[-1]} ({len(names)} entries)"
    way = " -> ".join([entries, *(_name(stop) for stop in first.stops[1:])])
    seconds = sorted(route.seconds for route in routes)
    time = f"{seconds[0]:.3g} s" if seconds[-1] - seconds[0] < 0.05 else f"{seconds[0]:.3g} to {seconds[-1]:.3g} s"
    if first.last.end == "exit":
        estimate = "" if first.traced is None else f", after {first.traced:.3g} m by belt speeds"
        return f"{way}: transit {time} over {first.length:.3g} m{estimate}"
    text = f"{way}: a lone bottle {ending(first.last, flow.surfaces)} after {time}"
    return text if has_exit(scene) else f"{text}; no exit"


def _name(path: tuple[str | int, ...]) -> str:
    return dotted(path) if path[0] == "bottles" else printable(str(path[-1]))


def _capacity(scene: Scene, flow: LineFlow) -> str:
    """Return the sum of all stretches and the bottleneck."""
    if not flow.stretches or flow.bottleneck is None:
        return ""
    bottles = sum(stretch.capacity for stretch in flow.stretches)
    fed = sum(feed_rate(scene, route.entry) for route in flow.routes)
    text = f"about {_count(round(bottles), 'bottle')}; bottleneck {flow.bottleneck.name}, {flow.bottleneck.rate:.3g} /s"
    return f"{text} (fed {fed:.3g} /s)" if fed else text


def _accuracy(model: Model) -> str:
    prediction = model.prediction
    if prediction.value is None:
        return f"{model.accuracy}: {prediction.reason}"
    resting = f"; {percent(prediction.resting)} in resting load" if prediction.resting else ""
    return f"{model.accuracy}: expected error {percent(prediction.value)} in impact forces{resting}"


def _step(limit: StepLimit) -> str:
    steps = f"{limit.steps} step{'' if limit.steps == 1 else 's'} per tick"
    if limit.given:
        return f"{steps}, given in the scene"
    return f"{steps}, set by {limit.bounds[0].name}" if limit.bounds else f"{steps}; nothing bounds the time step"


def _slow_belts(model: Model) -> list[Finding]:
    """Return a warning about belts below the slip limit."""
    slow = slow_drag(model.plant, {choice.name for choice in model.effects if choice.on})
    return [] if slow is None else [Finding(slow.belt.path, slow.text)]


def _deep(model: Model) -> list[Finding]:
    """Return a warning about large overlaps in expected impacts."""
    warning = expected_deep_warning(model.impacts)
    return [Finding(("contacts",), warning)] if warning else []


def _sprung_walls(model: Model) -> list[Finding]:
    """Return a warning about straight rails that carry a part of a queue."""
    walls = sprung_walls(model.plant, {choice.name for choice in model.effects if choice.on})
    return [] if walls is None else [Finding(walls.path, walls.text)]


def _points(model: Model) -> list[Finding]:
    """Return a note about bottles on points that rub along rails."""
    names = bottles_on_points(model.plant, {choice.name for choice in model.effects if choice.on})
    if not names:
        return []
    others = "" if len(names) == 1 else f" (and {len(names) - 1} more)"
    text = f"no base_radius{others}: scuffing is uncertain by a factor of 1.8 (docs/base.md)"
    return [Finding(("bottle_types", names[0]), text, "note")]
