#!/bin/sh
# coverage.sh: which lines of lib the tests have run: per file and in all, from what `make CONFIG=cov check` left. Lines that
# were not run go to BUILD/coverage/FILE.gcov, marked with #####. From the environment: BUILD.
# SPDX-License-Identifier: GPL-3.0-or-later
set -eu
cd "$(dirname "$0")/.."
BUILD=$(cd "${BUILD:-build/cov}" && pwd)
rm -rf "$BUILD/coverage"
mkdir -p "$BUILD/coverage"
root=$PWD
cd "$BUILD/coverage"
# one call for each object, run where the sources are named from
find "$BUILD/lib" -name '*.gcda' | sort | while read -r data; do
    (cd "$root" && ${GCOV:-gcov} -t -r "$data" 2>/dev/null) >one || continue
    # a header's inline functions are counted with the file that is named like the object only
    awk -v name="lib/${data#"$BUILD"/lib/}" '
        BEGIN { sub(/\.gcda$/, ".c", name); out = name; gsub("/", "#", out); out = out ".gcov" }
        / *-: *0:Source:/ { ours = substr($0, index($0, "Source:") + 7) == name }
        !ours { next }
        { print > out }
        /^ *-:/ { next }
        { all++ }
        /^ *(#####|=====):/ { missed++ }
        END { if (all) print all - missed, all, name }' one
done >lines
rm -f one
sort -k3 lines | awk '
    { run += $1; all += $2; printf "%6.1f %%  %5d of %5d  %s\n", 100 * $1 / $2, $1, $2, $3 }
    END { if (!all) exit 1; printf "%6.1f %%  %5d of %5d  lib\n", 100 * run / all, run, all }'
