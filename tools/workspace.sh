#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# workspace.sh DIR: links both packages of this checkout side by side into DIR/src, for `colcon build` and `rosdep` in DIR.
set -eu

fail() {
    echo "workspace.sh: $1" >&2
    exit 1
}

[ $# -eq 1 ] && [ -n "$1" ] || fail "$# arguments given, expected one: the folder of the workspace"
checkout=$(cd "$(dirname "$0")/.." && pwd -P)
src=$(realpath -m -- "$1/src")
case "$src/" in
"$checkout"/*) fail "$1 lies in the checkout, expected a folder outside, because colcon would find the packages twice" ;;
esac
mkdir -p -- "$src" || fail "$src: can't be made, expected a folder that can be written"

link() {
    if [ -e "$src/$2" ] || [ -L "$src/$2" ]; then
        [ "$(readlink "$src/$2")" = "$1" ] || fail "$src/$2 exists already, expected no other package of that name"
    else
        ln -s -- "$1" "$src/$2"
    fi
}
link "$checkout" conveyor_sim
link "$checkout/msg_defs" conveyor_msgs
echo "cd '$1' && rosdep install --from-paths src -y --ignore-src && colcon build"
