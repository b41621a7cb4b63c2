# SPDX-License-Identifier: Apache-2.0
"""Import rules of the package, and the diagram of docs/architecture.md that is generated from them.

`test/test_imports.py` compares the rules with the imports of all sources.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

PAGE = Path(__file__).resolve().parents[1] / "docs" / "architecture.md"

RULES: Mapping[str, str] = {
    "engine": "| llvmlite numba numpy",
    "columns": "| numpy",
    "statistics": "| numpy scipy",
    "errors": "",
    "support": "errors | numpy rich",
    "control": "support | lark",
    "scene": "errors support | annotated_types numpy pydantic pydantic_core ruamel yaml",
    "physics": "columns engine errors scene support | llvmlite numpy pydantic",
    "line": "columns engine errors physics scene support | numpy",
    "simulation": "columns engine line physics scene | numpy",
    "__init__": "scene simulation",
    "bag": "columns errors line scene simulation support | lz4 mcap numpy pandas pyarrow rosbags yaml zstandard",
    "page": "bag columns errors scene simulation support | ezdxf numpy ruamel",
    "run": "bag columns control engine errors line physics scene simulation support | click numpy",
    "report": "bag columns errors line page physics run scene simulation statistics support | "
    "click matplotlib numpy rich",
    "protocols": "bag columns errors line page run scene simulation support | "
    "aiohttp asyncua cryptography foxglove google numpy paho pyads pylogix pymodbus snap7",
    "accuracy": "columns engine errors line physics report scene simulation statistics support | "
    "matplotlib numpy rich ruamel scipy",
    "studies": "bag columns control errors line physics report run scene simulation statistics support | "
    "SALib annotated_types distributed matplotlib numpy optuna pyarrow pydantic rich scipy",
    "ros": "bag columns control errors line protocols report run scene simulation support | "
    "builtin_interfaces click conveyor_msgs diagnostic_msgs geometry_msgs numpy rcl_interfaces rclpy regex "
    "rosgraph_msgs simulation_interfaces std_msgs std_srvs",
    "testing": "bag control errors line page protocols report ros run scene simulation support | numpy pytest",
    "cli": "accuracy bag errors page physics protocols report ros run scene studies support | click rich",
}
"""Packages and modules from the lowest up: what each may import of this package | of third-party packages."""

WITHIN: Mapping[str, Mapping[str, str]] = {
    "physics": {
        "sources_hash": "",
        "plant": "",
        "laws": "",
        "timestep": "laws",
        "effects": "laws plant timestep",
        "model": "effects laws plant sources_hash timestep",
        "state": "model",
        "accounts": "model state",
        "stepping": "accounts model state timestep",
    },
    "bag": {"mcap": "", "messages": "", "": "mcap messages"},
    "page": {"drawings": "", "": "drawings"},
    "line": {
        "tag": "",
        "alarms": "",
        "device": "alarms tag",
        "commands": "alarms device tag",
        "devices": "alarms commands device tag",
        "machines": "alarms commands device devices tag",
        "": "alarms commands device devices machines tag",
    },
    "control": {
        "alarm": "",
        "scan": "alarm",
        "load": "scan",
        "recorded": "scan",
        "blocks": "",
        "edges": "scan",
        "st": "load recorded scan",
        "": "alarm blocks edges scan",
    },
    "protocols": {
        "server": "",
        "tags": "server",
        "opcua": "server tags",
        "modbus": "server tags",
        "mqtt": "server tags",
        "web": "server tags",
        "foxglove": "server tags",
        "hosting": "foxglove modbus mqtt opcua server tags web",
        "attach": "hosting opcua server tags",
    },
}
"""Import rules inside a package, from the lowest up: what each part may import of the others.

"" stands for all files directly in the package; every part may import these where they come first.
"""

LABELS: Mapping[str, str] = {
    "cli": "command line",
    "testing": "scenarios, pytest plugin",
    "ros": "ROS 2 nodes (only importer of rclpy)",
    "studies": "sweeps, optimisation",
    "accuracy": "error against run time",
    "report": "summaries, figures",
    "protocols": "OPC UA, Modbus, MQTT, web, Foxglove",
    "run": "stepping, wall time, lockstep",
    "page": "plans, page of a recording",
    "bag": "MCAP recordings",
    "simulation": "advance, command, observe",
    "line": "devices, commands, alarms",
    "physics": "effects, time step, model, state, tick",
    "scene": "YAML schema, geometry",
    "control": "controllers, Structured Text",
    "engine": "kernels over arrays",
    "columns": "observations",
    "statistics": "intervals, comparisons",
    "support": "files, processes, progress",
    "errors": "exceptions",
}


def allowed(name: str) -> set[str]:
    """Return the packages of this project that `name` may import."""
    return set(RULES[name].partition("|")[0].split())


def levels() -> dict[str, int]:
    """Return the import level of each package and module: 1 for those that import no other."""
    level: dict[str, int] = {}
    for name in RULES:
        level[name] = 1 + max((level[lower] for lower in allowed(name)), default=0)
    return level


def diagram() -> str:
    """Return the Mermaid diagram: packages by level, with the arrows that no longer path implies."""
    level = {name: height for name, height in levels().items() if name != "__init__"}
    lines = ["```mermaid", "flowchart TB"]
    for height in sorted(set(level.values()), reverse=True):
        for name in (name for name in level if level[name] == height):
            suffix = ".py" if name in ("simulation", "errors") else "/"
            lines.append(f'    {name}["{name}{suffix}: {LABELS[name]}"]')
    reached: dict[str, set[str]] = {}
    for name in level:
        reached[name] = allowed(name).union(*(reached[lower] for lower in allowed(name)))
    for name in reversed(level):
        implied = {far for lower in allowed(name) for far in reached[lower]}
        lines += [f"    {name} --> {lower}" for lower in level if lower in allowed(name) - implied]
    return "\n".join([*lines, "```"])


def page(text: str) -> str:
    """Return the text of docs/architecture.md with the diagram renewed."""
    return re.sub(r"```mermaid.*?```", diagram().replace("\\", r"\\"), text, count=1, flags=re.DOTALL)
