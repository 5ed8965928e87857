#!/usr/bin/env bats
# Instruction sets of the numeric kernels: which one runs, that answers agree, and what must not be compiled for the narrow ones.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# sets: those that the machine has, narrowest first
sets() {
    vg-info --version --verbose | sed -n 's/.*this machine has//p' | tr -d ','
}

@test "--version --verbose tells the instruction set, --version does not" {
    vg-info -V >short
    vg-info -V -v >long
    vg-info -v --version | cmp - long
    head -2 long | cmp - short
    [[ $(sed -n 3p long) =~ ^kernels\ for\ [a-z0-9]+\;\ this\ machine\ has( [a-z0-9]+,?)+$ ]]
    for set in $(sets); do
        VG_ISA=$set vg-info -V -v | grep -q "^kernels for $set;"
    done
    VG_ISA='' vg-info -V -v | cmp - long
}

@test "VG_ISA: a set that does not exist or is not there is wrong usage" {
    missing=neon
    [ "$(uname -m)" != aarch64 ] || missing=avx2
    run env VG_ISA=mmx vg-solve walk.vgs
    [ "$status" = 2 ]
    [ "$output" = "vg-solve: VG_ISA: an instruction set is avx512, avx2, sse2 or neon, not 'mmx'" ]
    run env VG_ISA=$missing vg-solve walk.vgs
    [ "$status" = 2 ]
    [[ $output == "vg-solve: VG_ISA: this machine has no $missing: its widest instruction set is "* ]]
    [ "${#lines[@]}" = 1 ]
}

# answers SET THREADS: every kind of kernel at work on the walk of a body, as text of one line
answers() {
    export VG_ISA=$1
    vg-deform -j "$2" walk.vgs --onto other.vgs -o vectors.vgs --no-provenance
    vg-solve -j "$2" vectors.vgs -o "solved-$1-$2.vgs" --no-provenance
    vg-deform -j "$2" walk.vgs --by blend --onto other.vgs --no-provenance | vg-solve -j "$2" --weights area --planar \
        --planar-weights 1,1 -o "planar-$1-$2.vgs" --no-provenance
    vg-deform -j "$2" walk.vgs --onto other.vgs --correspondence pairs.vgs --no-provenance | vg-solve -j "$2" -o \
        "carried-$1-$2.vgs" --no-provenance
    unset VG_ISA
}

@test "one answer for any number of threads, and within 1e-12 D between sets" {
    vg-encode "$DATA/human-man-poses.tar.xz" -o walk.vgs
    vg-encode "$DATA/human-heavy-poses.tar.xz" -o other.vgs
    vg-encode --take 0 walk.vgs -o rest.vgs
    vg-register -q --aligned rest.vgs other.vgs -o pairs.vgs
    widest=$(sets | awk '{ print $NF }')
    for set in $(sets); do
        for threads in 1 2 3; do answers "$set" $threads; done
    done
    for set in $(sets); do
        for what in solved planar carried; do
            cmp "$what-$set-1.vgs" "$what-$set-2.vgs"
            cmp "$what-$set-1.vgs" "$what-$set-3.vgs"
            vg-diff -t 1e-12 "$what-$widest-1.vgs" "$what-$set-1.vgs"
        done
        VG_ISA=$set vg-diff --json "solved-$set-1.vgs" walk.vgs >"apart-$set.json" || true
    done
    # shellcheck disable=SC2046 # each set is a word
    python3 - $(sets) <<'PY'
import json, sys
def numbers(x):
    if isinstance(x, dict): return [n for k in sorted(x) for n in numbers(x[k])]
    if isinstance(x, list): return [n for y in x for n in numbers(y)]
    return [x] if isinstance(x, (int, float)) and not isinstance(x, bool) else []
of = [numbers(json.load(open(f'apart-{s}.json'))) for s in sys.argv[1:]]
assert len(of[0]) > 20
for other in of[1:]:
    for a, b in zip(of[0], other):
        assert abs(a - b) <= 1e-9 * max(abs(a), abs(b)), (a, b)
PY
}

@test "a signal has the same numbers for any set, and the same bytes for any number of threads" {
    vg-encode "$DATA/trex-walk.tar.xz" -o trex.vgs
    for set in $(sets); do
        for threads in 1 3; do
            VG_ISA=$set vg-fitsignal -q --no-provenance -j $threads trex.vgs -o "trex-$set-$threads.signal"
        done
        cmp "trex-$set-1.signal" "trex-$set-3.signal"
        vg-info --json "trex-$set-1.signal" | python3 -c "
import json, sys
s = json.load(sys.stdin)['signal']
print(s['control_points'], s['sites'], s['coordinates'], s['layout'])" >"numbers-$set"
        vg-sample "trex-$set-1.signal" -o "trex-$set.vgs"
    done
    widest=$(sets | awk '{ print $NF }')
    for set in $(sets); do
        cmp "numbers-$widest" "numbers-$set"
        vg-diff -t 1e-9 "trex-$widest.vgs" "trex-$set.vgs"
    done
}

@test "vectors wider than the registers are in no file that is compiled for a narrower set" {
    # 8 * VGI_WIDTH bytes are what the set has; 16 and 32 are lowered well everywhere they are used
    cd "$ROOT"
    run grep -rnE 'vector_size\((64|128|256)\)|target(_clones)?\("' lib cmd
    [ "$status" = 1 ]
    run grep -rlE 'vector_size' lib cmd
    # lib/net/real.h names eight numbers of a network, 32 bytes, which only its kernels compute with
    for file in "${lines[@]}"; do [[ $file == lib/core/wide.h || $file == lib/net/real.h || $file == *_kernel.c ]]; done
    grep -q 'vector_size(8 \* VGI_WIDTH)' lib/core/wide.h
}
