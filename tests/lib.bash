# lib.bash: what all .bats files share. Each test runs in a directory of its own; programs come from the build.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck shell=bash

ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
BUILD=${BUILD:-$ROOT/build/release}
DATA=$ROOT/tests/data
GOLDEN=$ROOT/fmt/golden
CORPUS=$ROOT/tests/corpus
PATH=$BUILD/bin:$PATH
export ROOT BUILD DATA GOLDEN CORPUS PATH
export LC_ALL=C.UTF-8 PYTHONDONTWRITEBYTECODE=1

setup() {
    cd "$BATS_TEST_TMPDIR" || return 1
}

fail() {
    printf '%s\n' "$@" >&2
    return 1
}

# capture CMD...: run it; status in $status, standard output in $output, standard error in $stderr (without NUL). Fails on a
# signal, on "not found", and on a report of a sanitizer, whatever the test expects.
capture() {
    status=0
    "$@" >"$BATS_TEST_TMPDIR/.stdout" 2>"$BATS_TEST_TMPDIR/.stderr" || status=$?
    output=$(tr -d '\0' <"$BATS_TEST_TMPDIR/.stdout")
    stderr=$(tr -d '\0' <"$BATS_TEST_TMPDIR/.stderr")
    case $stderr in
    *'Sanitizer'* | *'runtime error:'*) fail "sanitizer report from: $*" "$stderr" || return 1 ;;
    esac
    if [ "$status" -ge 99 ]; then
        fail "'$*' ended with status $status (a signal, a sanitizer, or not found)" "$stderr" || return 1
    fi
}

# must CMD...: status 0 and nothing on standard error
must() {
    capture "$@" || return 1
    [ "$status" = 0 ] || fail "'$*' ended with status $status" "$stderr" "$output" || return 1
    [ -z "$stderr" ] || fail "'$*' wrote to standard error" "$stderr"
}

# must_warn CMD...: status 0, and something is said on standard error
must_warn() {
    capture "$@" || return 1
    [ "$status" = 0 ] || fail "'$*' ended with status $status" "$stderr" "$output" || return 1
    [ -n "$stderr" ] || fail "'$*' said nothing on standard error"
}

# must_fail CODE CMD...: exactly this status, and a line on standard error that begins with a program's name
must_fail() {
    local want=$1
    shift
    capture "$@" || return 1
    [ "$status" = "$want" ] || fail "'$*' ended with status $status, not $want" "$stderr" || return 1
    [[ $stderr =~ ^[a-z_.-]+:\ . ]] || fail "'$*' failed, but no program says why:" "$stderr"
}

# pipe COMMANDLINE, pipe_fail CODE COMMANDLINE: the same for a pipeline, whose status is that of the last program that failed
pipe() {
    must bash -o pipefail -c "$1"
}
pipe_fail() {
    must_fail "$1" bash -o pipefail -c "$2"
}

# says TEXT...: each is in $stderr. shows TEXT...: each is in $output.
says() {
    local text
    for text; do
        [[ $stderr == *"$text"* ]] || fail "standard error does not say: $text" "it says: $stderr" || return 1
    done
}
shows() {
    local text
    for text; do
        [[ $output == *"$text"* ]] || fail "standard output does not show: $text" "it shows: $output" || return 1
    done
}

# vertex_error mean|p95|max [OPTION...] TRUTH RESULT: as vg-diff with these options finds it, in D
vertex_error() {
    local which=$1
    shift
    must vg-diff --json "$@" || return 1
    python3 -c 'import json, sys; print(json.load(sys.stdin)["vertex_error"][sys.argv[1]]["D"])' "$which" <<<"$output"
}

# at_most X Y: as numbers
at_most() {
    python3 -c 'import sys; a, b = map(float, sys.argv[1:]); sys.exit(not a <= b)' "$1" "$2" || fail "$1 is more than $2"
}

# one_line: a failure is one line. More are allowed only in a pipe, one for each program.
one_line() {
    [ "$(printf '%s\n' "$stderr" | wc -l)" = 1 ] || fail "more than one line on standard error:" "$stderr"
}

same_file() {
    cmp "$1" "$2" || fail "'$1' and '$2' differ"
}

# nothing_but NAME...: the directory holds these files and no others, hidden ones included (a temporary file left behind is one)
nothing_but() {
    local have want
    have=$(find . -mindepth 1 -maxdepth 1 ! -name .stdout ! -name .stderr -printf '%f\n' | LC_ALL=C sort)
    want=$(printf '%s\n' "$@" | LC_ALL=C sort)
    [ "$have" = "$want" ] || fail "in the directory: $have" "expected: $want"
}

# needs_terminal: some containers have no pseudo-terminals to give
needs_terminal() {
    python3 -c 'import os; os.openpty()' 2>/dev/null || skip "there is no terminal to be had: is /dev/pts mounted?"
}

each_program() {
    local source
    for source in "$ROOT"/cmd/vg-*.c; do basename "$source" .c; done
}

witness() {
    python3 "$ROOT/examples/read_stream.py" "$@"
}

# Meshes. cube, tetra, two (a cube and a tetra apart: two components), strip (a quad, a triangle, a line segment).
# mesh NAME [TWIST [DX]]: OBJ on standard output, every vertex turned about the y axis by TWIST * y, then moved by DX along x.
mesh() {
    local cube_v='0 0 0  1 0 0  1 1 0  0 1 0  0 0 1  1 0 1  1 1 1  0 1 1'
    local cube_f='1,4,3,2 5,6,7,8 1,2,6,5 2,3,7,6 3,4,8,7 4,1,5,8'
    local v f
    case $1 in
    cube) v=$cube_v f=$cube_f ;;
    tetra) v='0 0 0  1 0 0  0 1 0  0 0 1' f='1,3,2 1,2,4 2,3,4 3,1,4' ;;
    two) v="$cube_v  3 0 0  4 0 0  3 1 0  3 0 1" f="$cube_f 9,11,10 9,10,12 10,11,12 11,9,12" ;;
    strip) v='0 0 0  1 0 0  1 1 0  0 1 0  1.5 0.5 0.25  2 0.5 0.75' f='1,2,3,4 3,2,5 l5,6' ;;
    *) return 1 ;;
    esac
    LC_ALL=C awk -v v="$v" -v f="$f" -v twist="${2:-0}" -v dx="${3:-0}" 'BEGIN {
        n = split(v, p, " ")
        for (i = 1; i <= n; i += 3) {
            c = cos(twist * p[i + 1]); s = sin(twist * p[i + 1])
            printf "v %.6f %.6f %.6f\n", c * p[i] + s * p[i + 2] + dx, p[i + 1], c * p[i + 2] - s * p[i]
        }
        n = split(f, face, " ")
        for (i = 1; i <= n; i++) {
            key = sub(/^l/, "", face[i]) ? "l" : "f"
            gsub(/,/, " ", face[i])
            print key, face[i]
        }
    }'
}

# poses NAME N: pose1.obj .. poseN.obj, the first without twist
poses() {
    local i
    for ((i = 1; i <= $2; i++)); do mesh "$1" "0.$((i - 1))" "$((i - 1))" >"pose$i.obj"; done
}

# py [ARGUMENT...] <<'END': a Python script that can import read_stream and make_corpus
py() {
    must env PYTHONPATH="$ROOT/examples:$ROOT/tests" python3 - "$@"
}
