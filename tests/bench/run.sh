#!/bin/sh
# make bench: how fast every stage is, beside a limit measured in the same run, and how much memory it holds.
# Quick by default: 6,890 and 50,002 vertices; BENCH=full adds 200,002 and 1,000,002. RUNS=2: a row is the best of so many.
# JSON=FILE: the rows, the goals and the limits also as JSON. PAGE=FILE: a Markdown page, of which what is between the lines
# <!-- bench --> and <!-- end of bench --> is replaced by the tables of instruction sets, pins, load and goals. VG_DATA: the
# folder of the kit, for the rows of pins. Inputs are generated into a directory of its own below TMPDIR
# (2 GB; full: 5 GB) and removed at the end. Leaves out accuracy: make check.
# SPDX-License-Identifier: GPL-3.0-or-later
set -eu
LC_ALL=C
export LC_ALL
ROOT=$(cd "$(dirname "$0")/../.." && pwd)
BUILD=$(cd "${BUILD:-$ROOT/build/release}" && pwd)
PATH=$BUILD/bin:$BUILD/bench:$PATH
BENCH=${BENCH:-quick}
RUNS=${RUNS:-2}
DATA=$ROOT/tests/data
case ${JSON:=} in
'' | /*) ;;
*) JSON=$PWD/$JSON ;;
esac
case ${PAGE:=} in
'' | /*) ;;
*) PAGE=$PWD/$PAGE ;;
esac
kit=${VG_DATA:+$(cd "$VG_DATA" && pwd)}
W=$(mktemp -d "${TMPDIR:-/tmp}/vg-bench.XXXXXX")
others= # processes that only take processors; see busy()
# shellcheck disable=SC2086 # a list of process numbers
trap 'kill $others 2>/dev/null || :; rm -rf "$W"' EXIT
trap 'exit 130' INT TERM HUP
cd "$W"
if [ "$BENCH" != quick ] && [ "$BENCH" != full ]; then
    echo "run.sh: BENCH is 'quick' or 'full', not '$BENCH'" >&2
    exit 2
fi

# ---- helpers ----

# repeat N TEXT: TEXT N times
repeat() {
    awk -v n="$1" -v text="$2" 'BEGIN { while (n-- > 0) printf "%s ", text }'
}

# bytes FILE...: their size together
bytes() {
    cat "$@" | wc -c
}

# calc EXPRESSION: a number
calc() {
    awk "BEGIN { printf \"%.6g\", ($1) }"
}

# rounded EXPRESSION: whole from 100 on, else with one digit
rounded() {
    awk "BEGIN { x = $1; printf x < 99.95 ? \"%.1f\" : \"%.0f\", x }"
}

# best RUNS COMMAND: the shortest time into $seconds, the largest peak into $kib; stops the benchmark when it fails
best() {
    took=$(measure "$1" "$2")
    seconds=${took% *}
    kib=${took#* }
}

first=
line() {
    printf '%-32s %5s %8s %8s %7s %6s  %-14s %8s %6s\n' "$@"
}

# head_of INPUT
head_of() {
    input=$1
    printf '\n%s\n\n' "$1"
    line stage poses poses/s later MB/s MiB limit poses/s ratio
    line ----- ----- ------- ----- ---- --- ----- ------- -----
}

# Limits: what the same work takes at the least, in seconds, into $least; its name into $limit
by_pipe() { # BYTES that go through
    limit='pipe copy' least=$(calc "$1 / 1e6 / $pipe")
}
by_memory() { # BYTES that are copied
    limit='memory copy' least=$(calc "$1 / 1e6 / $memory")
}
by_cholmod() { # POSES that are solved
    limit=cholmod_solve2 least=$(calc "$1 / $cholmod")
}
by_sgemm() { # FLOPS, on all processors
    limit=sgemm least=$(calc "$1 / 1e9 / $gflops")
}

# row STAGE POSES BYTES: a row for what `best` has measured, and the limit. BYTES is every byte read, passed on or written.
# $first, unless empty: what a run of one pose takes. Beside cholmod_solve2 it is poses after the first that are compared, for
# its figure has no set-up in it either.
row() {
    rate=$(calc "$2 / $seconds")
    later=
    # noise can make one pose take as long as all of them
    [ -z "$first" ] || later=$(awk "BEGIN { t = $seconds - $first; if (t > 0) printf \"%.4g\", ($2 - 1) / t }")
    own=$rate
    [ "$limit" != cholmod_solve2 ] || own=${later:-$rate}
    can=$(calc "$2 / $least")
    ratio=$(awk "BEGIN { printf \"%.2f\", $own / $can }")
    line "$1" "$2" "$(rounded "$rate")" "${later:--}" "$(rounded "$3 / 1e6 / $seconds")" "$((kib / 1024))" "$limit" \
        "$(rounded "$can")" "$ratio"
    printf '{"input": "%s", "stage": "%s", "poses": %d, "seconds": %s, "poses_per_s": %s, "later_poses_per_s": %s, ' \
        "$input" "$1" "$2" "$seconds" "$rate" "${later:-null}" >>rows
    printf '"bytes_per_s": %.0f, "peak_bytes": %.0f, "limit": "%s", "limit_poses_per_s": %s, "ratio": %s}\n' \
        "$(calc "$3 / $seconds")" "$(calc "$kib * 1024")" "$limit" "$can" "$ratio" >>rows
    first=
}

# goal TEXT VALUE UNIT "<="|">=" LIMIT: remembered for the last table
goal() {
    verdict=$(awk "BEGIN { print ($2 $4 $5) ? \"reached\" : \"MISSED\" }")
    printf '%-62s %9s %-8s %s %-7s %s\n' "$1" "$2" "$3" "$4" "$5" "$verdict" >>goals
    printf '{"goal": "%s", "value": %s, "unit": "%s", "bound": "%s %s", "verdict": "%s"}\n' "$1" "$2" "$3" "$4" "$5" \
        "$verdict" >>json_goals
}

# list FILE: its lines with commas between
list() {
    sed '$!s/$/,/; s/^/    /' "$1"
}

# ---- inputs ----

# copies TIMES FROM TO
copies() {
    # shellcheck disable=SC2046 # a list of names without spaces
    vg-encode $(repeat "$1" "$2") -o "$3"
}

# one NAME: NAME-1.vgs and NAME-1w.vgs, one pose and its vectors on the target
one() {
    vg-deform "$1-1.vgs" --onto "$1-b.vgs" -o "$1-1w.vgs"
}

# rods NAME RINGS SEGMENTS TIMES SOME: NAME-11.vgs, eleven poses of body A; NAME.vgs and NAME-some.vgs, so many times the same;
# NAME-1.vgs, one pose; NAME-b.vgs, the target B; NAME-w.vgs, the vectors of the transfer; NAME-q.vgs, another cut of A into
# quads; NAME-p.vgs, vectors of A as quads, which are not planar, NAME-p1.vgs, one pose of them
rods() {
    rod A tri "$2" "$3" 11 >"$1-11.vgs"
    rod A tri "$2" "$3" 1 >"$1-1.vgs"
    rod B tri "$2" "$3" 1 >"$1-b.vgs"
    rod A quad $(($2 - 2)) $(($3 + 2)) 1 >"$1-q.vgs"
    rod A quad "$2" "$3" 11 | vg-encode --vectors -o "$1-p.vgs"
    rod A quad "$2" "$3" 1 | vg-encode --vectors -o "$1-p1.vgs"
    copies "$4" "$1-11.vgs" "$1.vgs"
    copies "$5" "$1-11.vgs" "$1-some.vgs"
    vg-deform "$1.vgs" --onto "$1-b.vgs" -o "$1-w.vgs"
    one "$1"
}

human() {
    vg-encode "$DATA/human-man-poses.tar.xz" -o human-some.vgs
    vg-encode "$DATA/human-heavy-poses.tar.xz" -o human-b.vgs
    copies 9 human-some.vgs human-quarter.vgs
    copies 36 human-some.vgs human.vgs
    mkdir obj
    vg-decode human-some.vgs -o 'obj/%02d.obj'
    vg-encode obj/00.obj -o human-1.vgs
    vg-deform human-quarter.vgs --onto human-b.vgs -o human-quarter-w.vgs
    vg-deform human.vgs --onto human-b.vgs -o human-w.vgs
    one human
}

# ---- rows ----

# solver NAME TEXT: how many poses/s the limit does on this mesh, into $cholmod; a line of the table of solves
solver() {
    OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 solve "$1-w.vgs" >solve.out
    read -r loading one two simplicial supernodal apart <solve.out
    cholmod=$(calc "$simplicial > $supernodal ? $simplicial : $supernodal")
    gain=$(calc "$two / $cholmod")
    printf '%-28s %9.0f %9.0f %9.0f %11.0f %11.0f %8.2f %8.2f %10s\n' "$2" "$loading" "$one" "$two" "$simplicial" \
        "$supernodal" "$(calc "$one / $cholmod")" "$gain" "$apart" >>solves
}

# stage RUNS COMMAND ONE: $seconds and $kib of COMMAND; $first of ONE, the same with one pose
stage() {
    best "$1" "$3"
    first=$seconds
    best "$1" "$2"
}

# transfer NAME POSES RUNS: vg-deform, vg-solve, and both; poses/s of the pipeline, set-up included, into $rate
transfer() {
    in=$(bytes "$1.vgs")
    between=$(bytes "$1-w.vgs")
    stage "$3" "vg-deform $1.vgs --onto $1-b.vgs >/dev/null" "vg-deform $1-1.vgs --onto $1-b.vgs >/dev/null"
    by_pipe $((in + between))
    row 'vg-deform --onto' "$2" $((in + between))
    stage "$3" "vg-solve --fit squares $1-w.vgs >/dev/null" "vg-solve --fit squares $1-1w.vgs >/dev/null"
    solve_kib=$kib
    by_cholmod "$2"
    row vg-solve "$2" $((in + between))
    squares_rate=${later:-$rate} squares_ratio=$ratio
    stage "$3" "vg-solve --fit absolute $1-w.vgs >/dev/null" "vg-solve --fit absolute $1-1w.vgs >/dev/null"
    by_cholmod "$2"
    row 'vg-solve --fit absolute' "$2" $((in + between))
    absolute_rate=$(calc "int(${later:-$rate})")
    # 8 plain solves a pose or 150 poses/s at 13,380 vertices, whichever is slower
    absolute_least=$(calc "int($squares_rate / 8 < 150 ? $squares_rate / 8 : 150)")
    stage "$3" "$ulimit vg-deform $1.vgs --onto $1-b.vgs | vg-solve --fit squares >/dev/null" \
        "vg-deform $1-1.vgs --onto $1-b.vgs | vg-solve --fit squares >/dev/null"
    by_cholmod "$2"
    row 'vg-deform --onto | vg-solve' "$2" $((2 * in + between))
}

# pairs NAME POSES RUNS: a correspondence, and the transfer by it
pairs() {
    pair=$(bytes "$1-1.vgs" "$1-q.vgs")
    best 1 "vg-register -q --aligned $1-1.vgs $1-q.vgs -o $1-c.vgs"
    by_memory "$pair"
    row 'vg-register --aligned' 1 "$pair"
    best "$3" "vg-deform $1-some.vgs --onto $1-q.vgs --correspondence $1-c.vgs -o $1-cw.vgs"
    by_pipe $(($(bytes "$1-some.vgs") + $(bytes "$1-cw.vgs")))
    row 'vg-deform --correspondence' "$2" $(($(bytes "$1-some.vgs") + $(bytes "$1-cw.vgs")))
    rm "$1-cw.vgs"
}

# every_stage NAME POSES SOME RUNS: each program on one mesh; SOME poses where it takes longer
every_stage() {
    n=$1 poses=$2 some=$3 runs=$4
    few=$(bytes "$n-some.vgs")
    mkdir "$n-obj"
    vg-decode "$n-some.vgs" -o "$n-obj/%04d.obj"
    tar -cf "$n.tar" "$n-obj"
    rm -r "$n-obj"
    text=$(bytes "$n.tar")
    best "$runs" "vg-encode $n.tar >/dev/null"
    by_pipe "$text"
    row 'vg-encode, archive of OBJ' "$some" "$text"
    obj_rate=$(calc "$text / 1e6 / $seconds")
    best "$runs" "vg-encode $n.vgs >/dev/null"
    by_pipe "$(bytes "$n.vgs")"
    row 'vg-encode, stream' "$poses" $((2 * $(bytes "$n.vgs")))
    best "$runs" "vg-encode --vectors $n.vgs >/dev/null"
    by_pipe "$(bytes "$n-w.vgs")"
    row 'vg-encode --vectors, stream' "$poses" $(($(bytes "$n.vgs") + $(bytes "$n-w.vgs")))
    transfer "$n" "$poses" "$runs"
    transfer_rate=$rate
    [ "$n" = cable ] || pairs "$n" "$some" "$runs" # the fit of a million vertices takes many minutes, and 5 GB
    stage "$runs" "vg-solve --planar $n-p.vgs >/dev/null" "vg-solve --planar $n-p1.vgs >/dev/null"
    by_cholmod 11
    row 'vg-solve --planar, quads' 11 $(($(bytes "$n-11.vgs") + $(bytes "$n-p.vgs")))
    vg-poisson "$n.vgs" --first "$n-1.vgs" --last "$n-1.vgs" -o "$n-g.vgs"
    best "$runs" "vg-poisson $n.vgs --first $n-1.vgs --last $n-1.vgs >/dev/null"
    by_memory $((2 * $(bytes "$n.vgs")))
    row 'vg-poisson --first --last' "$poses" $((2 * $(bytes "$n.vgs")))
    best "$runs" "vg-diff $n.vgs $n-g.vgs >/dev/null"
    by_pipe $((2 * $(bytes "$n.vgs")))
    row vg-diff "$poses" $((2 * $(bytes "$n.vgs")))
    rm "$n-g.vgs"
    best "$runs" "vg-info --check $n.vgs >/dev/null"
    by_pipe "$(bytes "$n.vgs")"
    row 'vg-info --check' "$poses" "$(bytes "$n.vgs")"
    mkdir out
    for format in obj ply; do
        best "$runs" "vg-decode --replace $n-some.vgs -o 'out/%02d.$format'"
        by_pipe "$(bytes out/*)"
        row "vg-decode, $format" "$some" "$(bytes out/*)"
        rm -f out/*
    done
    best "$runs" "vg-view $n-some.vgs -o out/sheet.png"
    by_memory $((8 * 360 * 360 * 9 * 16)) # what its samples take; compressing the picture takes twice as long as they do
    row 'vg-view, sheet of 8' "$some" "$few"
    best "$runs" "vg-view -q $n-some.vgs -o out/page.html"
    by_pipe "$few"
    row 'vg-view, page' "$some" "$few"
    best "$runs" "$ulimit vg-encode $n.tar | vg-deform --onto $n-b.vgs | vg-solve --fit squares | vg-decode --replace -o 'out/%04d.ply'"
    by_cholmod "$some"
    row 'encode | deform | solve | decode' "$some" $((text + few))
    rm -rf out "$n.tar"
}

# patches NAME INPUT POSES PLAYED RUNS FACES VERTICES: patches of the POSES of INPUT, a map, and the map at work on PLAYED poses (a
# multiple of eleven)
patches() {
    n=$1 in=$2 poses=$3 played=$4 runs=$5 k=50
    data=$(bytes "$in")
    best "$runs" "vg-segment $in -k $k -q -o $n.patches"
    segment_seconds=$seconds
    rounds=$(vg-segment "$in" -k $k -v 2>&1 >/dev/null | sed -n 's/.* \([0-9]*\) rounds.*/\1/p')
    segment_flops="2 * $k * $6 * $rounds * $(calc "9 * $poses < 1024 ? 9 * $poses : 1024")"
    by_sgemm "$segment_flops"
    row vg-segment "$poses" "$data"
    best "$runs" "vg-segment --connected $in -k $k -q >/dev/null"
    connected_seconds=$seconds
    row 'vg-segment --connected' "$poses" "$data"
    best "$runs" "vg-fitmap -q --patches $n.patches $in -o $n.map"
    fit_seconds=$seconds
    by_cholmod $(((4 * k + 2) / 3))
    row vg-fitmap "$poses" "$data"
    # shellcheck disable=SC2046
    vg-encode --f32 $(repeat $((played / 11)) "$n-11.vgs") | vg-play "$n.map" --transforms -o motions.vgs
    product=$(product "$k" "$7")
    best "$runs" "vg-play $n.map motions.vgs >/dev/null"
    limit=sgemm least=$(calc "$played / ${product% *}")
    row 'vg-play, binary32' "$played" $((played * $7 * 12))
    rm -f motions.vgs "$n.map" "$n.patches"
}

# bones N: a skeleton of N bones in a row along a rod, as text
bones() {
    awk -v n="$1" 'BEGIN { for (i = 0; i < n; i++) {
        printf "b%d %s 0 0 %g 0 0 %g\n", i, i ? "b" (i - 1) : "-", -1 + 2 * i / n, -1 + 2 * (i + 1) / n } }'
}

# rigs NAME INPUT POSES PLAYED RUNS FACES VERTICES: a skeleton of 33 bones without motion, learned from the POSES of INPUT, and the rig at
# work on PLAYED poses (a multiple of eleven)
rigs() {
    n=$1 in=$2 poses=$3 played=$4 runs=$5 k=33
    bones $k >bones.txt
    best "$runs" "vg-fitmap -q --skeleton bones.txt $in -o $n.rig"
    rig_seconds=$seconds
    by_sgemm "6 * $poses * $k * (4 * $7 + 9 * $6)"
    row 'vg-fitmap --skeleton, learned' "$poses" "$(bytes "$in")"
    # shellcheck disable=SC2046
    vg-encode --f32 $(repeat $((played / 11)) "$n-11.vgs") | vg-play "$n.rig" --transforms -o motions.vgs
    product=$(product "$k" "$7")
    best "$runs" "vg-play $n.rig motions.vgs >/dev/null"
    limit=sgemm least=$(calc "$played / ${product% *}")
    row 'vg-play, rig, binary32' "$played" $((played * $7 * 12))
    rig_rate=$rate
    best "$runs" "vg-play --live $n.rig motions.vgs >/dev/null"
    row 'vg-play --live, rig' "$played" $((played * $7 * 12))
    live_seconds=$(calc "1000 * $seconds / $played")
    rm -f motions.vgs "$n.rig" bones.txt
}

# core_of SET: the kernels of OpenBLAS that use no more than this instruction set
core_of() {
    case $1 in
    avx512) echo SkylakeX ;;
    avx2) echo Haswell ;;
    sse2) echo Nehalem ;;
    esac
}

# of_set STAGE: the row that was measured last, for the table of sets
of_set() {
    printf '%s\t%s\t%s\t%s\t%s\n' "$1" "$set" "$(rounded "$rate")" "$limit" "$ratio" >>sets
}

# under_sets NAME TEXT POSES SOME RUNS VERTICES: what differs between instruction sets, each beside its limit under the same set
under_sets() {
    n=$1 poses=$3 some=$4 runs=$5 k=50 input_before=$input gflops_before=$gflops cholmod_before=$cholmod
    vg-segment "$n-11.vgs" -k $k -q -o "$n.patches"
    vg-fitmap -q --patches "$n.patches" "$n-11.vgs" -o "$n.map"
    vg-segment many.vgs -k $k -q -o "$n-many.patches"
    # shellcheck disable=SC2046
    vg-encode --f32 $(repeat 440 "$n-11.vgs") | vg-play "$n.map" --transforms -o motions.vgs
    vg-register -q --aligned "$n-1.vgs" "$n-q.vgs" -o "$n-c.vgs"
    in=$(bytes "$n.vgs") between=$(bytes "$n-w.vgs")
    for set in $sets; do
        OPENBLAS_CORETYPE=$(core_of "$set")
        export VG_ISA="$set" OPENBLAS_CORETYPE
        [ "$OPENBLAS_CORETYPE" ] || unset OPENBLAS_CORETYPE
        took=$(product 50 6890)
        gflops=$(calc "${took% *} * 2 * 3 * 200 * 6890 / 1e9")
        input="$2, $set"
        solver "$n" "$2, $set"
        stage "$runs" "vg-deform $n.vgs --onto $n-b.vgs >/dev/null" "vg-deform $n-1.vgs --onto $n-b.vgs >/dev/null"
        by_pipe $((in + between))
        row 'vg-deform --onto' "$poses" $((in + between)) >/dev/null
        of_set 'vg-deform --onto'
        stage "$runs" "vg-solve --fit squares $n-w.vgs >/dev/null" "vg-solve --fit squares $n-1w.vgs >/dev/null"
        by_cholmod "$poses"
        row vg-solve "$poses" $((in + between)) >/dev/null
        of_set vg-solve
        stage "$runs" "vg-deform $n.vgs --onto $n-b.vgs | vg-solve --fit squares >/dev/null" \
            "vg-deform $n-1.vgs --onto $n-b.vgs | vg-solve --fit squares >/dev/null"
        by_cholmod "$poses"
        row 'vg-deform --onto | vg-solve' "$poses" $((2 * in + between)) >/dev/null
        of_set 'vg-deform --onto | vg-solve'
        stage "$runs" "vg-solve --fit absolute $n-w.vgs >/dev/null" "vg-solve --fit absolute $n-1w.vgs >/dev/null"
        by_cholmod "$poses"
        row 'vg-solve --fit absolute' "$poses" $((in + between)) >/dev/null
        of_set 'vg-solve --fit absolute'
        best "$runs" "vg-deform $n-some.vgs --onto $n-q.vgs --correspondence $n-c.vgs >/dev/null"
        by_pipe $((3 * $(bytes "$n-some.vgs")))
        row 'vg-deform --correspondence' "$some" "$(bytes "$n-some.vgs")" >/dev/null
        of_set 'vg-deform --correspondence'
        stage "$runs" "vg-solve --planar $n-p.vgs >/dev/null" "vg-solve --planar $n-p1.vgs >/dev/null"
        by_cholmod 11
        row 'vg-solve --planar, quads' 11 "$(bytes "$n-p.vgs")" >/dev/null
        of_set 'vg-solve --planar, quads'
        best "$runs" "vg-diff $n.vgs $n.vgs >/dev/null"
        by_pipe $((2 * in))
        row vg-diff "$poses" $((2 * in)) >/dev/null
        of_set vg-diff
        best "$runs" "vg-info --check $n.vgs >/dev/null"
        by_pipe "$in"
        row 'vg-info --check' "$poses" "$in" >/dev/null
        of_set 'vg-info --check'
        best "$runs" "vg-segment many.vgs -k $k -q >/dev/null"
        by_sgemm "$segment_flops"
        row vg-segment 484 "$(bytes many.vgs)" >/dev/null
        of_set 'vg-segment, 484 poses'
        best "$runs" "vg-fitmap -q --patches $n-many.patches many.vgs >/dev/null"
        by_cholmod $(((4 * k + 2) / 3))
        row vg-fitmap 484 "$(bytes many.vgs)" >/dev/null
        of_set 'vg-fitmap, 484 poses'
        product=$(product "$k" "$6")
        best "$runs" "vg-play $n.map motions.vgs >/dev/null"
        limit=sgemm least=$(calc "4840 / ${product% *}")
        row 'vg-play, binary32' 4840 $((4840 * $6 * 12)) >/dev/null
        of_set 'vg-play, binary32'
    done
    unset VG_ISA OPENBLAS_CORETYPE
    rm -f "$n.map" "$n.patches" "$n-c.vgs" motions.vgs
    rm -f "$n-many.patches"
    input=$input_before gflops=$gflops_before cholmod=$cholmod_before
}

# print_sets: a line for each stage, poses/s and ratio under each set
print_sets() {
    awk -F '\t' -v sets="$sets" '
    !($1 in limit) { order[++n] = $1 }
    { rate[$1, $2] = $3; limit[$1] = $4; ratio[$1, $2] = $5 }
    END {
        k = split(sets, set, " ")
        printf "%-30s %-14s", "stage", "limit"
        for (i = k; i > 0; i--) printf " %9s %5s", set[i], "ratio"
        printf "\n%-30s %-14s", "-----", "-----"
        for (i = k; i > 0; i--) printf " %9s %5s", "----", "-----"
        print ""
        for (j = 1; j <= n; j++) {
            printf "%-30s %-14s", order[j], limit[order[j]]
            for (i = k; i > 0; i--) printf " %9s %5s", rate[order[j], set[i]], ratio[order[j], set[i]]
            print ""
        }
    }' sets
}

# page_sets: the same in Markdown
page_sets() {
    awk -F '\t' -v sets="$sets" '
    !($1 in limit) { order[++n] = $1 }
    { rate[$1, $2] = $3; limit[$1] = $4; ratio[$1, $2] = $5 }
    END {
        k = split(sets, set, " ")
        printf "| 6,890 vertices | limit |"
        for (i = k; i > 0; i--) printf " %s, poses/s | ratio |", toupper(set[i])
        printf "\n| --- | --- |"
        for (i = k; i > 0; i--) printf " ---: | ---: |"
        print ""
        for (j = 1; j <= n; j++) {
            name = order[j]
            gsub(/\|/, "\\|", name)
            printf "| `%s` | %s |", name, limit[order[j]]
            for (i = k; i > 0; i--) printf " %s | %s |", rate[order[j], set[i]], ratio[order[j], set[i]]
            print ""
        }
    }' sets
}

# block HEADING FILE: lines of a file as they are, below a heading and a blank line
block() {
    # shellcheck disable=SC2016 # these are no commands
    printf '\n%s\n\n```\n' "$1"
    cat "$2"
    # shellcheck disable=SC2016
    printf '```\n'
}

# page_tables: what goes between the lines of PAGE
page_tables() {
    printf 'One run of `make bench`, load before %s, best of %s; limits: %s MB/s through a pipe of 1 MiB, %s MB/s copied in memory, ' \
        "$before" "$RUNS" "$pipe" "$memory"
    printf 'sgemm %s GFLOP/s.\n\n' "$(rounded "$all_gflops")"
    page_sets
    block 'The solve alone, in memory, poses/s: vg_solver_load and the solve on one thread, the solve on two; cholmod_solve2 simplicial and
supernodal; both ratios; the largest difference in D:' solves
    [ ! -s pins ] || block 'Pins: seconds of `vg-deform | vg-solve` with `--pin none`, with `--pin auto`, and their ratio:' pins
    block 'Beside so many busy processes: poses/s, the part of the speed alone that is kept, the part that is fair, their ratio:' shares
    block 'What it must reach:' goals
}

# ratio_of STAGE SET, rate_of STAGE SET: out of the table of sets
ratio_of() {
    awk -F '\t' -v stage="$1" -v set="$2" '$1 == stage && $2 == set { print $5 }' sets
}
rate_of() {
    awk -F '\t' -v stage="$1" -v set="$2" '$1 == stage && $2 == set { print $3 }' sets
}

# busy N COMMAND: seconds of the command beside N processes that do nothing but take processors
busy() {
    others=
    for _ in $(repeat "$1" x); do
        sh -c 'while :; do :; done' &
        others="$others $!"
    done
    best "$RUNS" "$2"
    # shellcheck disable=SC2086 # a list of process numbers
    kill $others
    # shellcheck disable=SC2086
    wait $others 2>/dev/null || :
    others=
}

# share NAME POSES: the part of its speed alone that the pipe keeps beside busy processes, and the part that is fair
share() {
    command="vg-deform $1.vgs --onto $1-b.vgs | vg-solve --fit squares >/dev/null"
    best "$RUNS" "$command"
    alone=$seconds
    for others_n in 2 6; do
        busy $others_n "$command"
        kept=$(calc "$alone / $seconds") fair=$(calc "$processors / ($others_n + $processors)")
        printf '%-28s %6d %9s %8.2f %8.2f %8.2f\n' 'vg-deform | vg-solve' $others_n "$(rounded "$2 / $seconds")" "$kept" \
            "$fair" "$(calc "$kept / $fair")" >>shares
        least_share=$(awk "BEGIN { x = $kept / $fair; print x < ${least_share:-9} ? x : ${least_share:-9} }")
    done
}

# least ROUNDS COMMAND OTHER: the shortest times of two commands that take turns, into $seconds and $other
least() {
    seconds='' other=''
    for _ in $(repeat "$1" x); do
        took=$(measure 1 "$2") took=${took% *} rival=$(measure 1 "$3") rival=${rival% *}
        seconds=$(calc "${seconds:-$took} < $took ? ${seconds:-$took} : $took")
        other=$(calc "${other:-$rival} < $rival ? ${other:-$rival} : $rival")
    done
}

# pinned NAME TRANSFER FIT: the pipe with pins of each pose beside that without, on parts of the kit that do not ship
pinned() {
    least 9 "vg-deform -q $2 --pin none | vg-solve -q $3 >/dev/null" "vg-deform -q $2 --pin auto | vg-solve -q $3 >/dev/null"
    pins_ratio=$(calc "$other / $seconds")
    printf '%-42s %8.3f %8.3f %8.2f\n' "$1" "$seconds" "$other" "$pins_ratio" >>pins
    goal "pins beside none, $1" "$pins_ratio" times '<=' 1.3
}

# setup NAME TEXT: from files to the first pose; the whole of vg-solve into $seconds
setup() {
    best "$RUNS" "vg-deform $1-1.vgs --onto $1-b.vgs | vg-solve --fit squares >/dev/null"
    both=$seconds
    : >facts
    for _ in $(repeat "$RUNS" x); do
        vg-solve --fit squares -v "$1-1w.vgs" 2>>facts >/dev/null
    done
    best "$RUNS" "vg-solve --fit squares $1-1w.vgs >/dev/null"
    # frames with pins have systems of their own: the facts are those of the largest
    awk -v input="$2" -v both="$both" -v all="$seconds" -v mib=$((kib / 1024)) '/factorized in/ {
        gsub(",", "")
        for (i = 1; i < NF; i++) {
            if ($(i + 1) == "entries") n = $i
            if ($i == "analysed") a = $(i + 2)
            if ($i == "factorized") f = $(i + 2)
        }
        if (n > most) { most = n; analyse = a; factor = f }
        if (n == most && a < analyse) analyse = a
        if (n == most && f < factor) factor = f
    }
    END { printf "%-28s %12.3f %10.3f %9.3f %9.3f %14d %6d\n", input, both, all, analyse, factor, most, mib }
    ' facts >>setups
}

# grows STAGE COMMAND-FOR-N COMMAND-FOR-4N
grows() {
    best 1 "$2"
    small=$kib
    best 1 "$3"
    printf '%-28s %10.1f %10.1f %8.2f\n' "$1" "$(calc "$small / 1024")" "$(calc "$kib / 1024")" \
        "$(calc "$kib / $small")" >>memory
    worst=$(calc "$kib / $small > $worst ? $kib / $small : $worst")
}

# load: how many processes wanted a processor in the last minute; more than a few tenths before: others disturb
load() {
    cut -d ' ' -f 1 /proc/loadavg 2>/dev/null || echo unknown
}

busy=$(load | awk '{ print ($1 > 0.7) ? "yes" : "no" }')
ulimit=
before=$(load)
processors=$(getconf _NPROCESSORS_ONLN)
sets=$(vg-info --version --verbose | sed -n 's/.*this machine has//p' | tr -d ',')
widest=${sets##* }
pipe=$(pipe 1048576 2000)
pipe_small=$(pipe 65536 2000)
memory=$(bandwidth 400)
took=$(product 50 6890)
gflops=$(calc "${took% *} * 2 * 3 * 200 * 6890 / 1e9") all_gflops=$gflops
printf 'vg bench (%s), %s processors, load before %s, best of %s\n\n' "$BENCH" "$processors" "$before" "$RUNS"
printf 'Limits: %s MB/s through a pipe of 1 MiB (%s at 64 KiB), %s MB/s copied in memory, sgemm %s GFLOP/s\n' "$pipe" \
    "$pipe_small" "$memory" "$(rounded "$gflops")"

# the smallest mesh: a body of quads, and what must not grow with the length of a sequence
human
solver human '13,380 vertices, quads'
head_of '13,380 vertices, 13,378 quads: a body'
transfer human 540 "$RUNS"
human_rate=$rate human_ratio=$squares_ratio human_absolute=$absolute_rate human_least=$absolute_least
setup human '13,380 / 13,378 quads'
human_setup=$seconds
# shellcheck disable=SC2046
poses=$(repeat 36 "$(echo obj/*.obj)")
quarter=$(repeat 9 "$(echo obj/*.obj)")
vg-solve human-w.vgs -o human-result.vgs
vg-solve human-quarter-w.vgs -o quarter-result.vgs
mkdir out
worst=0
grows 'vg-encode OBJ' "vg-encode $quarter >/dev/null" "vg-encode $poses >/dev/null"
grows 'vg-encode --vectors' "vg-encode --vectors human-quarter.vgs >/dev/null" "vg-encode --vectors human.vgs >/dev/null"
grows 'vg-deform' "vg-deform human-quarter.vgs --onto human-b.vgs >/dev/null" \
    "vg-deform human.vgs --onto human-b.vgs >/dev/null"
grows 'vg-solve' "vg-solve --fit squares human-quarter-w.vgs >/dev/null" "vg-solve --fit squares human-w.vgs >/dev/null"
grows 'vg-decode PLY' "vg-decode --replace human-quarter.vgs -o 'out/%04d.ply'" "vg-decode --replace human.vgs -o 'out/%04d.ply'"
grows 'vg-diff' "vg-diff human-quarter.vgs quarter-result.vgs >/dev/null" \
    "vg-diff human.vgs human-result.vgs >/dev/null"
grows 'vg-info --check' "vg-info --check human-quarter.vgs >/dev/null" "vg-info --check human.vgs >/dev/null"
grows 'vg-view' "vg-view human-quarter.vgs -o sheet.png" "vg-view human.vgs -o sheet.png"
rm -rf out obj sheet.png human* quarter-result.vgs

: >pins
if [ "$kit" ]; then
    vg-encode "$kit/face/faceA.tar.gz" -o faces.vgs
    vg-encode "$kit/face/faceB.tar.gz" -o faces-b.vgs
    vg-encode "$kit/face/head-shapes.tar.xz" -o heads.vgs
    pinned '15 faces, --fit absolute' 'faces.vgs --onto faces-b.vgs' '--fit absolute'
    pinned '15 faces, --fit squares' 'faces.vgs --onto faces-b.vgs' '--fit squares'
    pinned '11 heads, --fit absolute' 'heads.vgs --onto heads.vgs' '--fit absolute'
    pinned '11 heads, --fit squares' 'heads.vgs --onto heads.vgs' '--fit squares'
    rm -f faces* heads.vgs
fi

rods rod 84 82 49 9
solver rod '6,890 vertices'
head_of '6,890 vertices, 13,776 triangles'
every_stage rod 539 99 "$RUNS"
rod_rate=$transfer_rate rod_obj=$obj_rate
copies 44 rod-11.vgs many.vgs
patches rod many.vgs 484 4840 "$RUNS" 13776 6890
goal 'segmentation of 484 poses, 6,890 vertices' "$segment_seconds" s '<=' 2
goal '... with --connected' "$connected_seconds" s '<=' 2
goal 'fit of a map to 484 poses, 6,890 vertices' "$fit_seconds" s '<=' 5
goal 'playing a map, 6,890 vertices' "$(calc "int($rate)")" poses/s '>=' 10000
rigs rod many.vgs 484 4840 "$RUNS" 13776 6890
goal 'rig of 33 bones learned from 484 poses, 6,890 vertices' "$rig_seconds" s '<=' 3
goal 'playing a rig, 6,890 vertices' "$(calc "int($rig_rate)")" poses/s '>=' 10000
goal '... frame by frame, a pose' "$live_seconds" ms '<=' 1
vg-segment rod-11.vgs -k 50 -q -o eleven.patches
best "$RUNS" 'vg-fitmap -q --patches eleven.patches rod-11.vgs -o eleven.map'
goal 'fit of a map to 11 poses, 6,890 vertices' "$seconds" s '<=' 0.3
under_sets rod '6,890 vertices' 539 99 "$RUNS" 6890
share rod 539
setup rod '6,890 / 13,776 triangles'
rm -f rod* many.vgs eleven*

rods tube 250 200 6 2
solver tube '50,002 vertices'
tube_gain=$gain
head_of '50,002 vertices, 100,000 triangles'
every_stage tube 66 22 "$RUNS"
patches tube tube-11.vgs 11 264 "$RUNS" 100000 50002
setup tube '50,002 / 100,000 triangles'
rm -f tube*

if [ "$BENCH" = full ]; then
    rods hose 500 400 2 1
    solver hose '200,002 vertices'
    head_of '200,002 vertices, 400,000 triangles'
    every_stage hose 22 11 1
    patches hose hose-11.vgs 11 66 1 400000 200002
    setup hose '200,002 / 400,000 triangles'
    rm -f hose*
    rods cable 1000 1000 1 1
    solver cable '1,000,002 vertices'
    head_of '1,000,002 vertices, 2,000,000 triangles'
    ulimit='ulimit -v 8388608;' # 8 GiB for each program
    every_stage cable 11 11 1
    ulimit=
    cable_kib=$solve_kib
    patches cable cable-11.vgs 11 22 1 2000000 1000002
    setup cable '1,000,002 / 2,000,000 tri.'
    cable_setup=$seconds
    rm -f cable*
fi

printf '\nThe solve alone, in memory, poses/s (CHOLMOD: METIS order, 3 right-hand sides per call, one thread)\n\n'
printf '%-28s %9s %9s %9s %11s %11s %8s %8s %10s\n' mesh load solve 'solve' cholmod cholmod ratio ratio largest \
    '' '1 thread' '1 thread' '2 thr.' simplicial supernodal '1 thr.' '2 thr.' 'diff., D' \
    ---- -------- -------- ------ ---------- ---------- ------ ------ ---------
cat solves

printf '\nUnder each instruction set, 6,890 vertices: poses/s, and the ratio beside the limit under the same set\n\n'
print_sets

if [ -s pins ]; then
    printf '\nPins: seconds of vg-deform | vg-solve without and with, least of 9 in turns, and the ratio\n\n'
    cat pins
fi

printf '\nBeside busy processes: poses/s, the part of the speed alone that is kept, and the part that is fair\n\n'
printf '%-28s %6s %9s %8s %8s %8s\n' stage others poses/s kept fair ratio ----- ------ ------- ---- ---- -----
cat shares

printf '\nSet-up: seconds from streams on disk to the first pose\n\n'
printf '%-28s %12s %10s %9s %9s %14s %6s\n' mesh deform+solve vg-solve analyse factor 'factor entries' MiB \
    ---- ------------ -------- ------- ------ -------------- ---
cat setups

printf '\nPeak memory in MiB of sequences of 135 and 540 poses, 13,380 vertices\n\n'
printf '%-28s %10s %10s %8s\n' stage 135 540 ratio ----- --- --- -----
cat memory

case $widest in
avx512) least_solve=1.1 least_both=0.45 least_gain=4 ;;
*) least_solve=0.6 least_both=0.35 least_gain=3 ;;
esac
goal "vg-solve beside cholmod_solve2, 13,380 vertices, $widest" "$human_ratio" times '>=' $least_solve
goal "vg-solve beside cholmod_solve2, 6,890 vertices, $widest" "$(ratio_of vg-solve "$widest")" times '>=' $least_solve
goal "vg-deform | vg-solve beside cholmod_solve2, 6,890, $widest" "$(ratio_of 'vg-deform --onto | vg-solve' "$widest")" times '>=' \
    $least_both
goal "vg-deform --onto beside a pipe copy, 6,890, $widest" "$(ratio_of 'vg-deform --onto' "$widest")" times '>=' 0.9
goal "playing a map beside sgemm, 6,890, $widest" "$(ratio_of 'vg-play, binary32' "$widest")" times '>=' 0.5
case " $sets " in
*' sse2 avx2 '*)
    for stage in vg-solve 'vg-deform --onto' 'vg-deform --onto | vg-solve' vg-diff; do
        goal "SSE2 beside AVX2, $stage" "$(calc "$(rate_of "$stage" sse2) / $(rate_of "$stage" avx2)")" times '>=' 0.5
    done
    ;;
esac
goal 'the fair share of the pipe that it keeps beside 2 and 6 busy processes' "$least_share" times '>=' 0.75
goal 'vg-deform | vg-solve, 13,380 vertices' "$(calc "int($human_rate)")" poses/s '>=' 300
goal 'vg-solve --fit absolute, 13,380 vertices' "$human_absolute" poses/s '>=' "$human_least"
goal 'vg-deform | vg-solve, 6,890 vertices' "$(calc "int($rod_rate)")" poses/s '>=' 1000
goal 'solve alone, 50,002 vertices, 2 threads, beside CHOLMOD' "$tube_gain" times '>=' "$least_gain"
goal 'set-up, 13,380 vertices' "$human_setup" s '<=' 0.2
goal 'reading OBJ text' "$(calc "int($rod_obj)")" MB/s '>=' 300
goal 'largest growth of memory when poses become four times as many' "$worst" times '<=' 1.1
if [ "$BENCH" = full ]; then
    goal 'set-up, 1,000,002 vertices' "$cable_setup" s '<=' 30
    goal 'memory of vg-solve, 1,000,002 vertices' "$(calc "$cable_kib / 1048576")" GiB '<=' 8
fi
printf '\nContinuous signals\n\n'
signal | tee signals
goal 'shape signal, 100 frames, beside dsyrk and dgemm' "$(sed -n '1s/.*: //p' signals)" times '<=' 2
goal 'all sites of 295 frames beside dgemm' "$(sed -n '2s/.*: //p' signals)" times '<=' 3
printf '\nWhat it must reach\n\n'
if [ "$busy" = yes ]; then
    printf 'Something else was running when this began: a verdict here says little about the programs.\n\n'
fi
cat goals
if [ -n "$PAGE" ]; then
    page_tables >tables.md
    sed -e '/^<!-- bench -->$/r tables.md' -e '/^<!-- bench -->$/,/^<!-- end of bench -->$/{/^<!--/!d}' "$PAGE" >page.md
    cat page.md >"$PAGE"
fi
if [ -n "$JSON" ]; then
    {
        printf '{\n  "bench": "%s", "version": "%s", "processors": %s, "load_before": "%s", "runs": %s,\n' "$BENCH" \
            "$(vg-solve --version | sed -n '1s/.* //p')" "$processors" "$before" "$RUNS"
        printf '  "limits": {"pipe_bytes_per_s": %s000000, "memory_bytes_per_s": %s000000, "sgemm_flops": %.0f},\n' "$pipe" \
            "$memory" "$(calc "$gflops * 1e9")"
        printf '  "stages": [\n%s\n  ],\n  "goals": [\n%s\n  ]\n}\n' "$(list rows)" "$(list json_goals)"
    } >"$JSON"
fi
