#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# ament_lint.sh BIN PATH...: checks sources as ROS does, in the style that ruff checks; output only if there are errors.
set -u
bin=$1
shift
log=$(mktemp)
trap 'rm -f "$log"' EXIT

quietly() {
    "$@" >"$log" 2>&1 || {
        cat "$log"
        exit 1
    }
}

quietly "$bin/ament_flake8" --config "$(dirname "$0")/ament_flake8.ini" "$@"
# Ruff checks these with fewer false reports: it reads a summary of two lines, and takes properties for attributes.
quietly "$bin/ament_pep257" --add-ignore D205 D209 D210 D213 D301 D400 D401 D402 D403 D415 -- "$@"
