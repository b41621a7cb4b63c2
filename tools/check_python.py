# SPDX-License-Identifier: Apache-2.0
"""Says in one sentence why the Python that runs this file can't carry the environment; silent exit 0 if it can.

Kept to syntax that any Python from 3.6 on reads. Exit 10: wrong version. Exit 20: right version, something missing.
"""

import os
import platform
import sys
import sysconfig

NAME = f"python{sys.version_info[0]}.{sys.version_info[1]}"


def complain(code, sentence):
    print(sentence)
    sys.exit(code)


if platform.python_implementation() != "CPython" or not (3, 10) <= sys.version_info[:2] <= (3, 12):
    found = f"{platform.python_implementation()} {platform.python_version()}"
    complain(
        10,
        f"conveyor_sim needs CPython 3.10, 3.11 or 3.12, and python3 is {found}: install python3.12 (or 3.11, 3.10) "
        "beside it, with its venv module and headers; it only has to be on PATH.",
    )
if sys.platform != "linux" or platform.machine() != "x86_64" or platform.libc_ver()[0] != "glibc":
    complain(
        20,
        "The ROS 2 wheels are built for Linux on x86-64 with glibc, which this machine is not "
        f"({sys.platform}, {platform.machine()}): build conveyor_sim with colcon where ROS 2 is installed.",
    )
try:
    import ensurepip  # noqa: F401
    import venv  # noqa: F401
except ImportError:
    complain(20, f"{NAME} has no venv module: install it (Debian, Ubuntu: apt install {NAME}-venv).")
if not os.path.exists(os.path.join(sysconfig.get_path("include"), "Python.h")):
    complain(
        20,
        f"{NAME} has no headers (Python.h), which building the messages needs: install them "
        f"(Debian, Ubuntu: apt install {NAME}-dev; Fedora: dnf install {NAME}-devel).",
    )
