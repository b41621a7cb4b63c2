# SPDX-License-Identifier: Apache-2.0
"""Installs conveyor_sim: by pip into an environment, by colcon (ament_python) into a ROS workspace.

All of the description is here, as strings and lists, because colcon reads it by running this file, with whatever
setuptools the ROS distribution brings.
"""

import re
from glob import glob
from pathlib import Path

from setuptools import find_packages, setup

NAME = "conveyor_sim"
VERSION = re.search(r'^__version__ = "(.+)"$', Path(NAME, "__init__.py").read_text(), re.MULTILINE).group(1)


def requirements(name: str) -> list[str]:
    """Return the lines of a file in requirements/ without its comments."""
    lines = Path("requirements", f"{name}.txt").read_text().splitlines()
    return [line for line in lines if not line.startswith("#")]


setup(
    name=NAME,
    version=VERSION,
    description="Bottles on industrial conveyors, simulated by force, as a ROS 2 node",
    long_description=Path("README.md").read_text(encoding="utf-8"),
    long_description_content_type="text/markdown",
    author="conveyor_sim contributors",
    license="Apache-2.0",
    classifiers=["Operating System :: POSIX :: Linux", "Programming Language :: Python :: 3"],
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={
        NAME: ["py.typed"],
        f"{NAME}.control.st": ["grammar.lark"],
        f"{NAME}.page": ["page/*", "page/lib/*"],
        f"{NAME}.protocols.opcua": ["nodesets/*.xml"],
    },
    # share/ as ROS expects it; conveyor_sim/support/resources.py finds config/ and msg_defs/ there.
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/config", glob("config/*.yaml")),
        (f"share/{NAME}/config/brewery", glob("config/brewery/*.yaml")),
        (f"share/{NAME}/config/brewery/plc", glob("config/brewery/plc/*.st")),
        (f"share/{NAME}/config/scenarios", glob("config/scenarios/*.yaml")),
        (f"share/{NAME}/examples", glob("examples/small_packaging.*")),
        (f"share/{NAME}/config/ros", glob("config/ros/*")),
        (f"share/{NAME}/config/viewers", glob("config/viewers/*")),
        (f"share/{NAME}/launch", glob("launch/*.launch.py")),
        (f"share/{NAME}/include", ["include/conveyor_sim_plc.h"]),
        (f"share/{NAME}/msg_defs", ["msg_defs/package.xml", "msg_defs/CMakeLists.txt"]),
        (f"share/{NAME}/msg_defs/msg", glob("msg_defs/msg/*.msg")),
        (f"share/{NAME}/msg_defs/srv", glob("msg_defs/srv/*.srv")),
    ],
    zip_safe=False,
    python_requires=">=3.10",
    install_requires=requirements("run"),
    extras_require={
        "plot": requirements("plot"),
        "accuracy": requirements("accuracy"),
        "scada": requirements("scada"),
        "mqtt": requirements("mqtt"),
        "s7": requirements("s7"),
        "ethernet_ip": requirements("ethernet_ip"),
        "ads": requirements("ads"),
        "foxglove": requirements("foxglove"),
        "tables": requirements("tables"),
        "studies": requirements("studies"),
        "optimise": [*requirements("studies"), *requirements("optimise")],
        "dask": requirements("dask"),
        "st": requirements("st"),
        "cad": requirements("cad"),
        "bench": requirements("bench"),
        "test": requirements("pytest"),
        "docs": requirements("docs"),
    },
    entry_points={
        "console_scripts": [
            "conveyor-sim = conveyor_sim.cli:main",
            "sim_node = conveyor_sim.ros.sim_node:main",
            "controller_node = conveyor_sim.ros.controller_node:main",
        ],
        "pytest11": ["conveyor_sim.testing.plugin = conveyor_sim.testing.plugin"],
    },
)
