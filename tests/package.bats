#!/usr/bin/env bats
# What is handed on: the tarball of `make dist`, and the Debian package's lists. Building the package is `make deb`.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

version() {
    sed -n 's/^#define VG_VERSION "\(.*\)"/\1/p' "$ROOT/lib/vg.h"
}

@test "the tarball: the same bytes from the tree and from what was unpacked" {
    name=vg-$(version)
    tarball=$PWD/$name.tar.xz
    must env -C "$ROOT" sh tests/dist.sh pack "$tarball" "$name"
    shows "$(sha256sum "$tarball" | cut -c 1-64)"
    must tar -xf "$tarball"
    [ "$(tar -tf "$tarball" | sed 's|/.*||' | sort -u)" = "$name" ]
    must tar -tf "$tarball"
    [ "$output" = "$(LC_ALL=C sort <<<"$output")" ] || fail "names are not sorted"
    [ "$(tar --numeric-owner -tvf "$tarball" | awk '{print $2, $4, $5}' | sort -u | wc -l)" = 1 ] || fail "more than one owner or time"
    must cmp "$ROOT/lib/vg.h" "$name/lib/vg.h"
    [ -x "$name/debian/rules" ] && [ ! -e "$name/build" ]
    must env -C "$name" GIT_CEILING_DIRECTORIES="$PWD" bash -c "umask 077 && sh tests/dist.sh pack ../again.tar.xz $name"
    same_file "$tarball" again.tar.xz
    must env -C "$name" GIT_CEILING_DIRECTORIES="$PWD" SOURCE_DATE_EPOCH=86400 TZ=UTC sh tests/dist.sh pack ../old.tar.xz "$name"
    must tar --utc -tvf old.tar.xz
    [[ $output == *' 1970-01-02 00:00 '* && $output != *' 20'[0-9][0-9]-* ]]
}

@test "debian/ speaks of this version, these files and these packages" {
    [ "$(sed -n '1s/^vg-tools (\([^)]*\)).*/\1/p' "$ROOT/debian/changelog")" = "$(version)" ]
    for list in "$ROOT"/debian/*.docs "$ROOT"/debian/*.examples; do
        while read -r path; do
            # shellcheck disable=SC2086 # patterns are wanted
            ls -d "$ROOT"/$path >/dev/null || fail "$list: there is no $path"
        done <"$list"
    done
    needed=$(sed 's/#.*//' "$ROOT/debian-packages.txt" | grep -v -x -F -e gcc -e g++ -e libc6-dev -e make -e '')
    for package in $needed; do
        grep -q "^ *$package\( <!nocheck>\)\?,\?\$" "$ROOT/debian/control" || fail "debian/control does not name $package"
    done
}
