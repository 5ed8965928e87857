#!/bin/sh
# arkit.sh HEAD POINTS -o OUT: 52 shapes with the names of ARKit for a head of any topology.
#
#   HEAD    the head at rest: eyes open, mouth shut, y up, looking along +z; any mesh that vg-encode reads
#   POINTS  a line for each point: a name of arkit/landmarks.txt and the vertex of HEAD that is there, counted from 0,
#           or what the pick page saved: a name, the vertex of the template, the vertex of HEAD
#   OUT     a GLB or glTF with HEAD as its mesh and 52 named morph targets; any other format that vg-decode writes gets
#           the rest pose and 52 frames
#
# Eyes, teeth and tongue that HEAD has take the motions of the template's; see arkit.md for a head from start to end.
# SPDX-License-Identifier: GPL-3.0-or-later

set -u
here=$(cd "$(dirname "$0")" && pwd)
template=$here/arkit/head52.vgs.xz landmarks=$here/arkit/landmarks.txt

name=${0##*/}
usage() {
    echo "usage: $name HEAD POINTS -o OUT" >&2
    exit 2
}

head='' points='' out=''
while [ $# -gt 0 ]; do
    case $1 in
    -h | --help) sed -n '2,/^# SPDX/{/SPDX/d;s/^# \{0,1\}//p;}' "$0" && exit 0 ;;
    -o)
        [ $# -gt 1 ] || usage
        out=$2
        shift
        ;;
    -*) usage ;;
    *) if [ -z "$head" ]; then head=$1; elif [ -z "$points" ]; then points=$1; else usage; fi ;;
    esac
    shift
done
[ -n "$points" ] || usage
[ -n "$out" ] || usage

BUILD=${BUILD:-$here/../build/release}
[ ! -x "$BUILD/bin/vg-register" ] || PATH=$(cd "$BUILD/bin" && pwd):$PATH
command -v vg-register >/dev/null || {
    echo "$name: no programs in '$BUILD/bin', and none installed: run 'make' first" >&2
    exit 2
}
work=$(mktemp -d) || exit 4
trap 'rm -rf "$work"' EXIT
trap 'exit 130' HUP INT TERM

[ -r "$points" ] || {
    echo "$name: cannot read '$points'" >&2
    exit 4
}
# Names become vertices of the template; lines with both vertices stay as they are.
awk -v program="$name" -v points="$points" '
    {sub(/\r$/, ""); sub(/#.*/, ""); gsub(/[,;]/, " ")}
    NF == 0 {next}
    FNR == NR {vertex[$1] = $2; next}
    NF == 2 && $1 in vertex {print $1, vertex[$1], $2; next}
    NF == 3 || NF == 2 && $1 ~ /^[0-9]+$/ {print; next}
    {printf "%s: '\''%s'\'' line %d: no point of the template is called '\''%s'\''\n", program, points, FNR, $1 > "/dev/stderr"
     exit 3}' "$landmarks" "$points" >"$work/markers.txt" || exit 3

case $out in
*.glb | *.gltf) shapes=--shapes ;;
*) shapes= ;;
esac
vg-register "$template" "$head" --markers "$work/markers.txt" -o "$work/pairs.vgs" || exit
vg-deform "$template" --onto "$head" --correspondence "$work/pairs.vgs" | vg-solve | vg-decode $shapes -o "$out"
