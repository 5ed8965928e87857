# run.sh: what the examples share; to be sourced. Goes into the directory that is their argument, and defines: out (that
# directory), data (the test data), and run COMMANDLINE, which prints a command line as one would type it and executes it.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck shell=sh disable=SC2034,SC2164

case ${1-} in
'' | -*)
    echo "usage: $0 OUTDIR" >&2
    exit 2
    ;;
esac
root=$(cd "$(dirname "$0")/.." && pwd)
data=$root/tests/data
[ -d "$data" ] || data=$root/examples/data # as a package installs it
BUILD=${BUILD:-$root/build/release}
if [ -x "$BUILD/bin/vg-encode" ]; then
    BUILD=$(cd "$BUILD" && pwd)
    PATH=$BUILD/bin:$PATH
elif ! command -v vg-encode >/dev/null; then
    echo "$0: no programs in '$BUILD/bin', and none installed: run 'make' first" >&2
    exit 2
fi
LC_ALL=C # awk writes numbers, and in some languages with a comma
export BUILD PATH LC_ALL
mkdir -p -- "$1"
out=$(cd -- "$1" && pwd)
cd "$out"

# A pipe's status is that of its last program. That is enough: a vg program fails when its input was cut short.
run() {
    printf '\n$ %s\n' "$1"
    eval "$1"
}

printf '$ cd %s\n$ data=%s\n' "$out" "$data"
