#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Finds a Python that can carry the environment and hands over to set_up.py: set_up.sh DISTRO [test] [bench] [docs]
tools=$(dirname "$0")
best=0
complaint="conveyor_sim needs CPython 3.10, 3.11 or 3.12 and there is no python3 on PATH: install python3.12 with its venv module and headers."
for python in python3 python3.12 python3.11 python3.10; do
    command -v "$python" >/dev/null 2>&1 || continue
    # -I -S: nothing that is installed for that Python, and no variable of a sourced ROS, has a say.
    said=$("$python" -I -S "$tools/check_python.py" 2>/dev/null)
    result=$?
    if [ $result -eq 0 ]; then
        exec "$python" -I -S "$tools/set_up.py" "$@"
    fi
    # The complaint of the Python that comes nearest is the one worth reading; a broken one (1, 126, 127) has none.
    if [ -n "$said" ] && [ $result -le 20 ] && [ $result -gt $best ]; then
        best=$result
        complaint=$said
    fi
done
echo "$complaint" >&2
exit 1
