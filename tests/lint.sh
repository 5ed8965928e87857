#!/bin/sh
# lint.sh: the static analysers that are installed, over all that is ours: shellcheck, cppcheck, clang-tidy, gcc -fanalyzer.
# What they say is a failure; what is said in vain is switched off where it is, or in .clang-tidy, .shellcheckrc and below,
# with the reason. From the environment: LINT (default all: which of them), CPPFLAGS.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck disable=SC2317 # functions that `run` calls
set -u
cd "$(dirname "$0")/.." || exit 4
LINT=${LINT:-shellcheck cppcheck clang-tidy analyzer}
flags="-std=gnu11 -D_GNU_SOURCE -Ilib -Icmd -include lib/core/banned.h -I/usr/include/suitesparse -I/usr/include/freetype2 ${CPPFLAGS:-}"
failed=0

# run NAME COMMAND...: one of them, if it is asked for and there
run() {
    name=$1
    shift
    case " $LINT " in *" $name "*) ;; *) return ;; esac
    if ! command -v "$1" >/dev/null; then
        echo "$name: not installed"
    elif "$@"; then
        echo "$name: nothing found"
    else
        echo "$name: see above"
        failed=1
    fi
}

scripts() {
    git ls-files | while read -r file; do
        case $file in
        *.sh | *.bats | *.bash) echo "$file" ;;
        esac
    done
}

# Not asked: what it says of vectors (an element set is not the vector set), of results that a function is given a place for, of
# memcpy next to what it copies, and of pointers behind a call that does not come back.
check_c() {
    cppcheck --quiet --error-exitcode=1 --enable=warning,performance,portability --std=c11 --inline-suppr --library=gnu \
        --suppress=missingIncludeSystem --suppress=uninitvar --suppress=legacyUninitvar --suppress=ctuuninitvar \
        --suppress=overlappingWriteFunction --suppress=memleak --suppress=memleakOnRealloc --suppress=nullPointerRedundantCheck \
        --suppress=nullPointerArithmeticRedundantCheck -D_GNU_SOURCE \
        '-DVG_MUST_CHECK=' '-DVG_PRINTF(a,b)=' -Ilib -Icmd lib cmd
}

tidy() {
    # shellcheck disable=SC2086 # words
    clang-tidy --quiet lib/*/*.c lib/*/*/*.c cmd/*.c -- $flags -Wno-psabi 2>/dev/null
}

# Known to be wrong: the file that a program reads when it ends by _exit (cli.c), what a function of another file or a loop
# fills (vg-interpolate.c, vg-sample.c, planar.c, number.c, loss.c, guess_kernel.c), pointers that calls before have checked
# (pack.c, report.c, inverse_skin.c, pieces.c, names.c, payload.c, reconstruct.c, artefact.c, frame.c, chain.c), what the caller frees
# (edit.c), a free of two lists of pointers (judge.c), and shifts of whole vectors (layer_kernel.c).
KNOWN='cli\.c.*-leak|vg-interpolate\.c.*stats|vg-sample\.c.*NULL|pack\.c.*NULL .k.|report\.c.*NULL .p.|inverse_skin\.c.*NULL'
KNOWN="$KNOWN|planar\.c.*unit|number\.c.*(from|digits)|loss\.c.*value|guess_kernel\.c.*a\.at|pieces\.c.*NULL|names\.c.*(whole|part)"
KNOWN="$KNOWN|payload\.c.*name|reconstruct\.c.*anchor|artefact\.c.*NULL .t.|frame\.c.*NULL .c.|edit\.c.*leak|judge\.c.*double"
KNOWN="$KNOWN|layer_kernel\.c.*shift-count|chain\.c.*NULL .rows."

analyze() {
    status=0
    for file in lib/*/*.c lib/*/*/*.c cmd/*.c; do
        # shellcheck disable=SC2086 # words
        said=$(${CC:-gcc} $flags -O1 -Wno-psabi -fanalyzer -c -o /dev/null "$file" 2>&1 | grep 'Wanalyzer' | grep -Ev "$KNOWN")
        [ -z "$said" ] || status=1
        [ -z "$said" ] || echo "$said"
    done
    return "$status"
}

# shellcheck disable=SC2046 # names without blanks
run shellcheck shellcheck $(scripts)
run cppcheck check_c
run clang-tidy tidy
run analyzer analyze
exit $failed
