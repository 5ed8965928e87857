#!/bin/sh
# dist.sh pack|check|deb TARBALL NAME: what `make dist`, `make distcheck` and `make deb` run, in the top of the tree.
#   pack   every file that git knows, or without git every file but build/, into TARBALL, below NAME/
#   check  unpack TARBALL elsewhere; there build, test, install, uninstall, and pack again: the same bytes must come out
#   deb    unpack TARBALL below build/deb, build the Debian packages there, and let lintian judge them
# SPDX-License-Identifier: GPL-3.0-or-later
set -eu
job=$1 tarball=$2 name=$3
export LC_ALL=C

in_git() {
    [ "$(git rev-parse --show-cdup 2>/dev/null || echo no)" = "" ]
}

# Without git this is a tree that was unpacked, whose files all have the time that was given them.
tree_time() {
    if [ -n "${SOURCE_DATE_EPOCH-}" ]; then
        echo "$SOURCE_DATE_EPOCH"
    elif in_git; then
        git log -1 --format=%ct
    else
        date -r lib/vg.h +%s
    fi
}

tree_files() {
    if in_git; then
        git ls-files -z
    else
        find . -path ./.git -prune -o -path ./build -prune -o -path ./examples/asset-build/out -prune -o ! -type d -printf '%P\0'
    fi
}

pack() {
    mkdir -p "$(dirname "$tarball")"
    tree_files | sort -z | tar --create --format=ustar --null --no-recursion --files-from=- \
        --transform="s|^|$name/|" --mtime="@$(tree_time)" --owner=root:0 --group=root:0 --mode=u=rwX,go=rX |
        xz -9 --threads=1 >"$tarball.part"
    mv "$tarball.part" "$tarball"
    echo "$tarball: $(xz --decompress --stdout "$tarball" | tar --list | wc -l) files," \
        "$(stat -c %s "$tarball") bytes, sha256 $(sha256sum "$tarball" | cut -c 1-64)"
}

check() {
    scratch=$(mktemp -d "${TMPDIR:-/tmp}/vg-dist.XXXXXX")
    trap 'rm -rf "$scratch"' EXIT
    trap 'exit 1' INT TERM HUP
    tar -C "$scratch" -xf "$tarball"
    tree=$scratch/$name
    (
        cd "$tree"
        unset SOURCE_DATE_EPOCH MAKEFLAGS MFLAGS
        "$MAKE" -s -j "$(nproc)" all
        "$MAKE" -s check
        "$MAKE" -s install DESTDIR="$scratch/root" PREFIX=/usr
        "$scratch/root/usr/bin/vg-info" --check fmt/golden/smallest.vgs
        "$MAKE" -s uninstall DESTDIR="$scratch/root" PREFIX=/usr
        [ -z "$(find "$scratch/root" ! -type d)" ] || { echo "uninstall leaves files behind" >&2; exit 1; }
        "$MAKE" -s dist
        mv "$tarball" ../again.tar.xz
        "$MAKE" -s clean
    )
    cmp "$tarball" "$scratch/again.tar.xz"
    # nothing was changed, and `make clean` leaves nothing behind
    tar -C "$scratch" --compare -f "$tarball"
    (cd "$tree" && find . ! -type d | sort) >"$scratch/after"
    tar -tf "$tarball" | sed "s|^$name|.|" | sort | cmp - "$scratch/after"
    echo "$tarball builds, passes its tests, and installs"
}

deb() {
    rm -rf build/deb
    mkdir -p build/deb
    tar -C build/deb -xf "$tarball"
    (cd "build/deb/$name" && dpkg-buildpackage --no-sign --build=binary)
    rm -rf "build/deb/$name"
    if command -v lintian >/dev/null; then
        lintian --fail-on error,warning build/deb/*.changes
    fi
    ls -l build/deb/*.deb
}

"$job"
