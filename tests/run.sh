#!/bin/sh
# run.sh: every test: unit tests, replays of the fuzz targets over the corpora, bats files. From the environment: BUILD (where
# `make` put things), CONFIG, TESTS (default all: which to run: "unit", "fuzz" and "bats" are all of a kind, "test_mesh",
# "fuzz_obj" and "stream.bats" one each).
# Ends with "N passed, N failed"; fails if anything failed, nothing ran, or the run left files in the tree.
# Tests of kernels run once more under every instruction set that is narrower than the machine's, see vg(7).
# SPDX-License-Identifier: GPL-3.0-or-later
set -u
cd "$(dirname "$0")/.." || exit 4
BUILD=$(cd "${BUILD:-build/release}" && pwd) || exit 4
CONFIG=${CONFIG:-release}
TESTS=${TESTS:-all}
export BUILD CONFIG
export LC_ALL=C.UTF-8 PYTHONDONTWRITEBYTECODE=1
unset BASH_ENV ENV CDPATH MAKEFLAGS MFLAGS # those of the make that runs this are not for the makes under test

work=$(mktemp -d) || exit 4
trap 'rm -rf "$work"' EXIT
trap 'exit 4' HUP INT TERM
passed=0 failed=0 skipped=0

# wanted KIND NAME: is this one to be run?
wanted() {
    case " $TESTS " in
    *" all "* | *" $1 "* | *" $2 "*) return 0 ;;
    esac
    return 1
}

for name in $TESTS; do
    case $name in
    all | unit | fuzz | bats) continue ;;
    test_*) [ ! -f "tests/unit/$name.c" ] || continue ;;
    fuzz_*) [ ! -f "tests/fuzz/$name.c" ] || continue ;;
    *.bats) [ ! -f "tests/$name" ] || continue ;;
    esac
    echo "there is no test '$name': see TESTS in tests/run.sh" >&2
    exit 2
done

# count NAME PASSED FAILED [SKIPPED]: one line for each thing that ran
count() {
    passed=$((passed + $2)) failed=$((failed + $3)) skipped=$((skipped + ${4:-0}))
    printf '%-28s %4d passed' "$1" "$2"
    [ "$3" = 0 ] || printf ', %d FAILED' "$3"
    [ "${4:-0}" = 0 ] || printf ', %d skipped' "$4"
    echo
}

untracked() {
    git ls-files --others --exclude-standard 2>/dev/null || :
}

# LeakSanitizer stops where it may not trace its own process (some containers): then everything but leaks is looked for.
sanitizers() {
    case $CONFIG in
    asan | fuzz) ;;
    *) return ;;
    esac
    leaks=1
    printf 'int main(void) { return 0; }\n' >"$work/leak.c"
    if ${CC:-cc} -fsanitize=address -o "$work/leak" "$work/leak.c" 2>/dev/null; then
        ASAN_OPTIONS=detect_leaks=1 "$work/leak" 2>/dev/null || leaks=0
    fi
    [ $leaks = 1 ] || echo "note: leaks are not looked for, this machine does not allow it"
    export ASAN_OPTIONS="halt_on_error=1:exitcode=99:detect_leaks=$leaks:detect_stack_use_after_return=1"
    export UBSAN_OPTIONS="halt_on_error=1:exitcode=99:print_stacktrace=1"
}

# Limits of time end what hangs: they are many times what anything takes, so that nothing fails because the machine is busy.

# run_unit NAME [SET]: under that instruction set
run_unit() {
    name=$1 log=$work/unit.log
    if [ $# = 2 ]; then
        VG_ISA=$2 && export VG_ISA
        run_unit "$1"
        unset VG_ISA
        return
    fi
    if [ ! -x "$BUILD/unit/$name" ]; then
        echo "$name was not built"
        count "$name" 0 1
        return
    fi
    timeout -k 10 3600 "$BUILD/unit/$name" >"$log" 2>&1
    status=$?
    totals=$(sed -n '$s/^\([0-9][0-9]*\) passed, \([0-9][0-9]*\) failed$/\1 \2/p' "$log")
    good=${totals% *} bad=${totals#* }
    if [ -z "$totals" ] || { [ $status != 0 ] && [ "$bad" = 0 ]; }; then
        echo "$name ended with status $status and did not say that it failed:"
        good=$(grep -c '^ok ' "$log")
        bad=$(($(grep -c '^not ok ' "$log") + 1))
    fi
    [ "$bad" = 0 ] || sed 's/^/    /' "$log"
    count "$name${VG_ISA:+, $VG_ISA}" "$good" "$bad"
}

run_replay() {
    name=$1 log=$work/fuzz.log
    set --
    for directory in tests/corpus/accept tests/corpus/reject "tests/corpus/$name"; do
        for file in "$directory"/*; do
            [ ! -f "$file" ] || set -- "$@" "$file"
        done
    done
    if [ $# != 0 ] && timeout -k 10 3600 "$BUILD/fuzz/$name" "$@" >"$log" 2>&1; then
        count "$name, $# files" 1 0
    else
        sed 's/^/    /' "$log"
        count "$name, $# files" 0 1
    fi
}

# All of a bats file at once; what the plan promised and did not come is a failure.
run_bats() {
    name=$1 log=$work/bats.log
    timeout -k 10 10800 bats --tap "tests/$name" >"$log" 2>&1
    status=$?
    good=$(grep -c '^ok ' "$log")
    bad=$(grep -c '^not ok ' "$log")
    skip=$(grep -c '^ok .* # skip' "$log")
    plan=$(sed -n 's/^1\.\.\([0-9][0-9]*\)$/\1/p' "$log")
    missing=$((${plan:-1} - good - bad))
    [ $missing -ge 0 ] || missing=0
    [ $status = 0 ] || [ $((bad + missing)) != 0 ] || missing=1
    bad=$((bad + missing))
    [ "$bad" = 0 ] || awk '/^ok /{show = 0} /^not ok /{show = 1} show || !/^(ok |1\.\.)/{print "    " $0}' "$log"
    [ "$skip" = 0 ] || sed -n 's/^ok [0-9]* \(.*\) # skip/    skipped: \1:/p' "$log"
    count "$name" $((good - skip)) "$bad" "$skip"
}

# all but the last of the sets that the machine has; test_isa goes through them by itself
unset VG_ISA
narrower=$("$BUILD/bin/vg-info" --version --verbose | sed -n 's/.*this machine has//p' | tr -d ',' | awk 'NF { NF--; print }')

untracked >"$work/before"
sanitizers
command -v pkill >/dev/null || command -v ps >/dev/null && export BATS_TEST_TIMEOUT=1800 # bats needs one of them for it

for source in tests/unit/test_*.c; do
    name=$(basename "$source" .c)
    wanted unit "$name" || continue
    run_unit "$name"
    case $name in
    test_carry | test_deform | test_map | test_measures | test_memory | test_planar | test_reconstruct | test_rig | test_segment)
        for set in $narrower; do run_unit "$name" "$set"; done
        ;;
    esac
done
for source in tests/fuzz/fuzz_*.c; do
    name=$(basename "$source" .c)
    if wanted fuzz "$name"; then run_replay "$name"; fi
done
for file in tests/*.bats; do
    name=$(basename "$file")
    if wanted bats "$name"; then run_bats "$name"; fi
done

untracked >"$work/after"
if ! cmp -s "$work/before" "$work/after"; then
    echo "the run left files in the tree:"
    comm -13 "$work/before" "$work/after"
    failed=$((failed + 1))
fi

tail=
[ $skipped = 0 ] || tail=", $skipped skipped"
echo "$passed passed, $failed failed$tail"
[ $failed = 0 ] && [ $passed != 0 ]
