# SPDX-License-Identifier: Apache-2.0
"""Error for the problems of a file: one line per problem, in the order of the file."""

from collections.abc import Callable, Iterable

from conveyor_sim.errors import SceneError
from conveyor_sim.scene.problem_count import MOST_SAID
from conveyor_sim.scene.problems import Path, Problem, dotted
from conveyor_sim.scene.provenance import FieldPlace

_MOST_PROBLEMS = 50  # listed; more would scroll the first off the screen


def refused(
    problems: Iterable[Problem], place_of: Callable[[Path], FieldPlace], name: str, more: int = 0
) -> SceneError:
    """Return the error for the problems of a file. Those of other files and of overrides come with their own place.

    place_of: place of a problem's path; name: of the scene's file; more: number of problems that were only counted. A
    list of more than MOST_SAID problems may be incomplete.
    """
    lines = []
    for problem in problems:
        place = place_of(problem.path)
        path = f" {dotted(place.path)}:" if place.path else ""
        expanded = f" {dotted(place.expanded)}:" if place.expanded else ""
        order = (place.file != name and place.line is not None, place.file, place.line or 0)
        lines.append((order, f"{place}:{path}{expanded} {problem.text}"))
    texts = [text for _, text in sorted(lines, key=lambda line: line[0])]
    rest = len(texts) - _MOST_PROBLEMS + more
    if rest > 0:
        at_least = "at least " if len(lines) > MOST_SAID else ""
        texts[_MOST_PROBLEMS:] = [f"{name}: and {at_least}{rest} more problems"]
    return SceneError("\n".join(texts))
