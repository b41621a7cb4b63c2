"""What a schema can't see of machines, spills and drives: regions, rates, names."""

from collections.abc import Iterator

from conveyor_sim.scene.machines import Inspection, Reject, Sink, Source
from conveyor_sim.scene.polygons import why_not_simple
from conveyor_sim.scene.problems import Problem
from conveyor_sim.scene.schema import Scene
from conveyor_sim.scene.words import shown


def machine_problems(scene: Scene) -> Iterator[Problem]:
    """Everything that is wrong with machines whose fields are each valid by themselves."""
    for name, machine in scene.machines.items():
        path = ("machines", name)
        if isinstance(machine, Sink | Reject) and (reason := why_not_simple(machine.region)) is not None:
            text = f"{shown(machine.region)} given, expected a simple polygon ({reason})"
            yield Problem((*path, "region"), text)
        if isinstance(machine, Source | Sink) and machine.rate_limit is not None and machine.rate_limit < machine.rate:
            yield Problem(
                (*path, "rate_limit"),
                f"{shown(machine.rate_limit)} given, expected at least {machine.rate:g} (1/s), the rate",
            )
        if isinstance(machine, Source) and machine.bad_share and machine.bad_every is not None:
            yield Problem(path, "both of bad_share and bad_every given, expected at most one of them")
        if isinstance(machine, Inspection) and machine.from_ == machine.to:
            yield Problem((*path, "to"), f"{shown(machine.to)} given, expected another point than from")
