#!/bin/sh
# make bench: how fast every stage is, beside a reference measured in the same run, and how much memory it holds.
# Quick by default; BENCH=full adds meshes of 200,000 and 1,000,000 vertices. RUNS=3: a row is the best of so many.
# Inputs are generated into a directory of its own below TMPDIR (3 GB; full: 4 GB) and removed at the end.
# Leaves out accuracy: make check.
# SPDX-License-Identifier: GPL-3.0-or-later
set -eu
LC_ALL=C
export LC_ALL
ROOT=$(cd "$(dirname "$0")/../.." && pwd)
BUILD=$(cd "${BUILD:-$ROOT/build/release}" && pwd)
PATH=$BUILD/bin:$BUILD/bench:$PATH
BENCH=${BENCH:-quick}
RUNS=${RUNS:-3}
DATA=$ROOT/tests/data
W=$(mktemp -d "${TMPDIR:-/tmp}/vg-bench.XXXXXX")
trap 'rm -rf "$W"' EXIT
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
    printf '%-20s %-26s %5s %8s %8s %6s %5s  %-23s %8s %6s\n' "$@"
}

# head_of TITLE
head_of() {
    printf '\n%s\n\n' "$1"
    line stage input poses poses/s later MB/s MiB reference 'it does' ratio
    line ----- ----- ----- ------- ----- ---- --- --------- ------- -----
}

# row STAGE INPUT POSES BYTES REFERENCE UNIT VALUE: a row for what `best` has measured. BYTES is every byte read, passed
# on or written. UNIT of the reference: poses/s or MB/s. $first, unless empty: what a run of one pose takes.
row() {
    rate=$(calc "$3 / $seconds")
    mbs=$(calc "$4 / 1e6 / $seconds")
    later=
    # noise can make one pose take as long as all of them
    [ -z "$first" ] || later=$(awk "BEGIN { t = $seconds - $first; if (t > 0) printf \"%.4g\", ($3 - 1) / t }")
    own=$mbs
    [ "$6" != poses/s ] || own=${later:-$rate}
    line "$1" "$2" "$3" "$(rounded "$rate")" "${later:--}" "$(rounded "$mbs")" "$((kib / 1024))" "$5, $6" \
        "$(rounded "$7")" "$(awk "BEGIN { printf \"%.2f\", $own / $7 }")"
    first=
}

# goal TEXT VALUE UNIT "<="|">=" LIMIT: remembered for the last table
goal() {
    verdict=$(awk "BEGIN { print ($2 $4 $5) ? \"reached\" : \"MISSED\" }")
    printf '%-62s %9s %-8s %s %-7s %s\n' "$1" "$2" "$3" "$4" "$5" "$verdict" >>goals
}

# ---- inputs ----

# rods NAME RINGS SEGMENTS POSES TIMES: NAME.vgs, so many times the same poses of body A; NAME-b.vgs, the target B;
# NAME-1.vgs, one pose; NAME-w.vgs, the vectors of the transfer.
rods() {
    rod A tri "$2" "$3" "$4" >"$1-some.vgs"
    rod A tri "$2" "$3" 1 >"$1-1.vgs"
    rod B tri "$2" "$3" 1 >"$1-b.vgs"
    copies "$5" "$1-some.vgs" "$1.vgs"
    vg-deform "$1.vgs" --onto "$1-b.vgs" -o "$1-w.vgs"
}

# copies TIMES FROM TO
copies() {
    # shellcheck disable=SC2046 # a list of names without spaces
    vg-encode $(repeat "$1" "$2") -o "$3"
}

human() {
    vg-encode "$DATA/human-man-poses.tar.xz" -o human-some.vgs
    vg-encode "$DATA/human-heavy-poses.tar.xz" -o human-b.vgs
    copies 9 human-some.vgs human-quarter.vgs
    copies 36 human-some.vgs human.vgs
    mkdir obj
    vg-decode human-some.vgs -o 'obj/%02d.obj'
    vg-encode obj/00.obj -o human-1.vgs
    mkdir target
    vg-decode human-b.vgs -o 'target/%02d.obj'
    vg-deform human-quarter.vgs --onto human-b.vgs -o human-quarter-w.vgs
    vg-deform human.vgs --onto human-b.vgs -o human-w.vgs
}

# ---- rows ----

# solver NAME: how many poses/s the reference does on this mesh, into $cholmod; a line of the table of solves
solver() {
    OPENBLAS_NUM_THREADS=1 OMP_NUM_THREADS=1 solve "$1-w.vgs" >solve.out
    read -r loading one two simplicial supernodal apart <solve.out
    cholmod=$(calc "$simplicial > $supernodal ? $simplicial : $supernodal")
    printf '%-28s %9.0f %9.0f %9.0f %11.0f %11.0f %8.2f %8.2f %10s\n' "$2" "$loading" "$one" "$two" "$simplicial" \
        "$supernodal" "$(calc "$one / $cholmod")" "$(calc "$two / $cholmod")" "$apart" >>solves
    echo "$cholmod" >"$1.cholmod"
    calc "$two / $cholmod" >"$1.gain"
}

# stage RUNS COMMAND: $seconds and $kib of COMMAND, in which INPUT stands for the name of a mesh, and $first of the same
# with one pose.
stage() {
    one=$(echo "$2" | sed 's/INPUT\.vgs/INPUT-1.vgs/; s/INPUT-w\.vgs/INPUT-1w.vgs/')
    best "$1" "$(echo "$one" | sed "s/INPUT/$mesh/g")"
    first=$seconds
    best "$1" "$(echo "$2" | sed "s/INPUT/$mesh/g")"
}

# transfer NAME INPUT POSES RUNS: vg-deform, vg-solve, and both; poses/s of the pipeline, set-up included, into $rate
transfer() {
    mesh=$1
    in=$(bytes "$1.vgs")
    between=$(bytes "$1-w.vgs")
    vg-deform "$1-1.vgs" --onto "$1-b.vgs" -o "$1-1w.vgs"
    if [ -e "$1.cholmod" ]; then
        read -r value <"$1.cholmod"
        set -- "$@" cholmod_solve2 poses/s "$value"
    else
        set -- "$@" 'pipe copy' MB/s "$pipe"
    fi
    stage "$4" 'vg-deform INPUT.vgs --onto INPUT-b.vgs >/dev/null'
    row vg-deform "$2" "$3" $((in + between)) 'pipe copy' MB/s "$pipe"
    stage "$4" 'vg-solve INPUT-w.vgs >/dev/null'
    solve_kib=$kib
    row vg-solve "$2" "$3" $((in + between)) "$5" "$6" "$7"
    stage "$4" "$limit vg-deform INPUT.vgs --onto INPUT-b.vgs | vg-solve >/dev/null"
    row 'vg-deform | vg-solve' "$2" "$3" $((2 * in + between)) "$5" "$6" "$7"
}

# setup NAME INPUT: from files to the first pose; the whole of vg-solve into $seconds
setup() {
    best "$RUNS" "vg-deform $1-1.vgs --onto $1-b.vgs | vg-solve >/dev/null"
    both=$seconds
    : >facts
    for _ in $(repeat "$RUNS" x); do
        vg-solve -v "$1-1w.vgs" 2>>facts >/dev/null
    done
    best "$RUNS" "vg-solve $1-1w.vgs >/dev/null"
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

printf 'vg bench (%s), %s processors, load before %s, best of %s\n' "$BENCH" "$(getconf _NPROCESSORS_ONLN)" \
    "$(load)" "$RUNS"

limit=
busy=$(load | awk '{ print ($1 > 0.7) ? "yes" : "no" }')
pipe=$(pipe 1048576 2000)
pipe_small=$(pipe 65536 2000)
printf '\nMemory through a pipe: %s MB/s at 1 MiB, %s MB/s at 64 KiB\n' "$pipe" "$pipe_small"

human
rods rod 84 82 11 49
rods tube 250 200 11 6
for mesh in 'human 13,380' 'rod 6,890' 'tube 50,002'; do
    solver "${mesh% *}" "${mesh#* } vertices"
done

head_of 'Deformation transfer, streams on disk to /dev/null (poses/s with set-up, later: after the first pose)'
transfer human '13,380 / 13,378 quads' 540 "$RUNS"
human_rate=$rate
transfer rod '6,890 / 13,776 triangles' 539 "$RUNS"
rod_rate=$rate
transfer tube '50,002 / 100,000 triangles' 66 "$RUNS"

head_of 'Reading, writing, comparing'
# shellcheck disable=SC2046
poses=$(repeat 36 "$(echo obj/*.obj)")
text=$((36 * $(bytes obj/*.obj)))
stream=$(bytes human.vgs)
vectors=$(bytes human-w.vgs)
best "$RUNS" "cat $poses >/dev/null"
cat_text=$(calc "$text / 1e6 / $seconds")
best "$RUNS" "vg-encode $poses >/dev/null"
row 'vg-encode OBJ' '13,380 / 13,378 quads' 540 "$text" 'cat of the files' MB/s "$cat_text"
obj_rate=$mbs
best "$RUNS" "vg-encode --vectors human.vgs >/dev/null"
row 'vg-encode --vectors' '13,380 / 13,378 quads' 540 $((stream + vectors)) 'pipe copy' MB/s "$pipe"
mkdir out
best "$RUNS" "vg-decode human.vgs -o 'out/%04d.obj'"
size=$(bytes out/*)
decode="$seconds $kib"
best "$RUNS" 'cat out/* >copy'
copy=$(calc "$size / 1e6 / $seconds")
seconds=${decode% *} kib=${decode#* }
row 'vg-decode OBJ' '13,380 / 13,378 quads' 540 "$size" 'cat to one file' MB/s "$copy"
rm -f out/* copy
best "$RUNS" "vg-decode human.vgs -o 'out/%04d.ply'"
row 'vg-decode PLY' '13,380 / 13,378 quads' 540 "$(bytes out/*)" 'cat to one file' MB/s "$copy"
rm -f out/*
vg-solve human-w.vgs -o human-result.vgs
best "$RUNS" "cat human.vgs human-result.vgs | cat >/dev/null"
cat_two=$(calc "2 * $stream / 1e6 / $seconds")
best "$RUNS" "vg-diff human.vgs human-result.vgs >/dev/null"
row vg-diff '13,380 / 13,378 quads' 540 $((2 * stream)) 'cat of both | cat' MB/s "$cat_two"
best "$RUNS" "vg-info --check human.vgs >/dev/null"
row 'vg-info --check' '13,380 / 13,378 quads' 540 "$stream" 'pipe copy' MB/s "$pipe"
vg-solve human-quarter-w.vgs -o quarter-result.vgs

worst=0
quarter=$(repeat 9 "$(echo obj/*.obj)")
grows 'vg-encode OBJ' "vg-encode $quarter >/dev/null" "vg-encode $poses >/dev/null"
grows 'vg-encode --vectors' "vg-encode --vectors $quarter >/dev/null" "vg-encode --vectors $poses >/dev/null"
grows 'vg-deform' "vg-deform human-quarter.vgs --onto human-b.vgs >/dev/null" \
    "vg-deform human.vgs --onto human-b.vgs >/dev/null"
grows 'vg-solve' "vg-solve human-quarter-w.vgs >/dev/null" "vg-solve human-w.vgs >/dev/null"
grows 'vg-decode PLY' "vg-decode human-quarter.vgs -o 'out/%04d.ply'" "vg-decode human.vgs -o 'out/%04d.ply'"
grows 'vg-diff' "vg-diff human-quarter.vgs quarter-result.vgs >/dev/null" \
    "vg-diff human.vgs human-result.vgs >/dev/null"
grows 'vg-info --check' "vg-info --check human-quarter.vgs >/dev/null" "vg-info --check human.vgs >/dev/null"
grows 'vg-view' "vg-view human-quarter.vgs -o sheet.png" "vg-view human.vgs -o sheet.png"
rm -rf out sheet.png human-result.vgs quarter-result.vgs human-w.vgs human-quarter-w.vgs human.vgs human-quarter.vgs

setup human '13,380 / 13,378 quads'
human_setup=$seconds
setup rod '6,890 / 13,776 triangles'
setup tube '50,002 / 100,000 triangles'
rm -f rod.vgs rod-w.vgs tube.vgs tube-w.vgs
read -r gain <tube.gain || [ -n "$gain" ]

head_of 'Patches and maps, 50 patches (reference: sgemm of the same shape, blocks of 32 poses)'
rod A tri 84 82 11 >eleven.vgs
copies 44 eleven.vgs many.vgs
# playing a map: the motions of the patches, as binary32, many times over
read -r product single <<EOF
$(product 50 6890)
EOF
best 1 'vg-segment many.vgs -k 50 -q -o rod.patches'
row vg-segment '6,890 / 13,776, 484 poses' 484 "$(bytes many.vgs)" 'pipe copy' MB/s "$pipe"
goal 'segmentation of 484 poses, 6,890 vertices' "$seconds" s '<=' 2
best 1 'vg-fitmap -q --patches rod.patches many.vgs -o rod.map'
row vg-fitmap '6,890 / 13,776, 484 poses' 484 "$(bytes many.vgs)" 'pipe copy' MB/s "$pipe"
goal 'fit of a map to 484 poses, 6,890 vertices' "$seconds" s '<=' 5
best 1 'vg-fitmap -q --patches rod.patches eleven.vgs -o eleven.map'
goal 'fit of a map to 11 poses, 6,890 vertices' "$seconds" s '<=' 0.3
# shellcheck disable=SC2046
vg-encode --f32 $(repeat 440 eleven.vgs) | vg-deform --map rod.map --transforms -o motions.vgs
best "$RUNS" 'vg-deform --map rod.map motions.vgs >/dev/null'
row 'vg-deform --map' '6,890, binary32' 4840 $((4840 * 6890 * 12)) sgemm poses/s "$product"
goal 'playing a map, 6,890 vertices' "$(calc "int($rate)")" poses/s '>=' 10000
printf 'sgemm one pose at a time: %s poses/s\n' "$single"
rm -f many.vgs motions.vgs

if [ "$BENCH" = full ]; then
    head_of 'Large meshes'
    rods hose 500 400 11 2
    solver hose '200,002 vertices'
    transfer hose '200,002 / 400,000 triangles' 22 1
    setup hose '200,002 / 400,000 triangles'
    rm -f hose*.vgs
    rods cable 1000 1000 16 1
    limit='ulimit -v 8388608;' # 8 GiB for each program
    transfer cable '1,000,002 / 2,000,000 tri.' 16 1
    limit=
    setup cable '1,000,002 / 2,000,000 tri.'
    cable_setup=$seconds
fi

printf '\nThe solve alone, in memory, poses/s (CHOLMOD: METIS order, 3 right-hand sides per call, one thread)\n\n'
printf '%-28s %9s %9s %9s %11s %11s %8s %8s %10s\n' mesh load solve 'solve' cholmod cholmod ratio ratio largest \
    '' '1 thread' '1 thread' '2 thr.' simplicial supernodal '1 thr.' '2 thr.' 'diff., D' \
    ---- -------- -------- ------ ---------- ---------- ------ ------ ---------
cat solves

printf '\nSet-up: seconds from streams on disk to the first pose\n\n'
printf '%-28s %12s %10s %9s %9s %14s %6s\n' mesh deform+solve vg-solve analyse factor 'factor entries' MiB \
    ---- ------------ -------- ------- ------ -------------- ---
cat setups

printf '\nPeak memory in MiB of sequences of 135 and 540 poses, 13,380 vertices\n\n'
printf '%-28s %10s %10s %8s\n' stage 135 540 ratio ----- --- --- -----
cat memory

goal 'vg-deform | vg-solve, 13,380 vertices' "$(calc "int($human_rate)")" poses/s '>=' 300
goal 'vg-deform | vg-solve, 6,890 vertices' "$(calc "int($rod_rate)")" poses/s '>=' 500
goal 'solve alone, 50,002 vertices, 2 threads, beside CHOLMOD' "$gain" times '>=' 4
goal 'set-up, 13,380 vertices' "$human_setup" s '<=' 0.2
goal 'reading OBJ text on one core' "$(calc "int($obj_rate)")" MB/s '>=' 300
goal 'largest growth of memory when poses become four times as many' "$worst" times '<=' 1.1
if [ "$BENCH" = full ]; then
    goal 'set-up, 1,000,002 vertices' "$cable_setup" s '<=' 30
    goal 'memory of vg-solve, 1,000,002 vertices' "$(calc "$solve_kib / 1048576")" GiB '<=' 8
fi
printf '\nWhat it must reach\n\n'
if [ "$busy" = yes ]; then
    printf 'Something else was running when this began: a verdict here says little about the programs.\n\n'
fi
cat goals
