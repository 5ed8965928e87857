#!/usr/bin/env bats
# make install: everything is there, a C program of somebody else builds against it, and uninstall takes all of it away.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# make_into_root TARGET: with the build that is being tested, into ./root
make_into_root() {
    capture make -s --no-print-directory -C "$ROOT" "$1" B="$BUILD" CONFIG="${CONFIG:-release}" DESTDIR="$PWD/root" PREFIX=/usr
    [ "$status" = 0 ] || fail "make $1 ended with status $status" "$output" "$stderr"
}

# flags --cflags|--libs: of libvg as installed in ./root
flags() {
    PKG_CONFIG_LIBDIR=$PWD/root/usr/lib/pkgconfig PKG_CONFIG_SYSROOT_DIR=$PWD/root \
        PKG_CONFIG_ALLOW_SYSTEM_CFLAGS=1 PKG_CONFIG_ALLOW_SYSTEM_LIBS=1 pkg-config "$@" libvg
}

@test "install, use from C, uninstall" {
    make_into_root install

    # programs and pages
    must diff <(echo vg && each_program) <(ls root/usr/bin)
    must diff <(each_program | sed 's/$/.1/') <(ls root/usr/share/man/man1)
    [ -s root/usr/share/man/man5/vg-stream.5 ] && [ -s root/usr/share/man/man7/vg.7 ]
    must root/usr/bin/vg-info --check "$GOLDEN/smallest.vgs"

    # vg lists them; tutorial and examples, the library's page, completion
    must root/usr/bin/vg
    for program in $(each_program); do shows "$program  "; done
    shows "vg help transfer"
    must root/usr/bin/vg --version
    shows "vg (vg) $(sed -n 's/^#define VG_VERSION "\(.*\)"/\1/p' "$ROOT/lib/vg.h")"
    pipe_fail 4 'root/usr/bin/vg >/dev/full'
    [ "$stderr" = "vg: cannot write to standard output" ]
    must sh "$ROOT/cmd/vg" # in the sources, the programs are those that were built
    shows "vg-solve  "
    must root/usr/bin/vg info --check "$GOLDEN/smallest.vgs"
    must_fail 2 root/usr/bin/vg nonsense
    must_fail 2 root/usr/bin/vg help nonsense
    must_fail 2 root/usr/bin/vg solv
    says "there is no program 'solv': did you mean 'solve'?"
    must_fail 2 root/usr/bin/vg help transferr
    says "there is no page for 'transferr': did you mean 'transfer'?"
    grep -q 'id="vg_solver_new"' root/usr/share/doc/vg/vg-api.html
    for file in README.md examples/tutorial.md examples/farm/shot examples/c/transfer.c examples/blender/vg_tools/__init__.py \
        examples/python/vgstream.py examples/data/trex.rest.obj; do
        [ -s "root/usr/share/doc/vg/$file" ] || fail "not installed: $file"
    done
    [ -s root/usr/share/zsh/site-functions/_vg ] && [ -s root/usr/share/fish/vendor_completions.d/vg-solve.fish ]

    # of the shared library only vg_* is seen, in one version
    must nm --dynamic --defined-only root/usr/lib/libvg.so.0
    [ "$(awk '$2 != "A" && $3 !~ /^vg_.*@@VG_0$/' <<<"$output" | grep -v -e ' __asan' -e ' __odr' -e ' gcov' -c)" = 0 ] ||
        fail "seen besides: $(awk '$3 !~ /^vg_/' <<<"$output" | head)"
    [ "$(grep -c '@@VG_0' <<<"$output")" -gt 200 ]
    must readelf -d root/usr/lib/libvg.so
    shows "soname: [libvg.so.0]"
    export LD_LIBRARY_PATH=$PWD/root/usr/lib

    # the library, from a program that knows only its header and its .pc file
    cat >count.c <<'END'
#include <fcntl.h>
#include <stdio.h>
#include <vg.h>

int main(int argc, char **argv)
{
    vg_reader *r;
    vg_frame f = {0};
    vg_err e;
    int n = 0, more, fd = argc == 2 ? open(argv[1], O_RDONLY) : -1;
    if (vg_reader_open(&r, fd, argv[1], &e) < 0) return fprintf(stderr, "%s\n", e.message), vg_exit_status(e.code);
    while ((more = vg_reader_next(r, &f, &e)) > 0) printf("%d %s %.17g\n", n++, f.name, f.values[0]);
    if (more < 0) fprintf(stderr, "%s\n", e.message);
    else printf("%d frames of %zu %s\n", n, vg_reader_head(r)->count, vg_kind_name(vg_reader_head(r)->kind));
    vg_frame_clear(&f);
    vg_reader_close(&r);
    return more < 0 ? vg_exit_status(e.code) : 0;
}
END
    sanitize=
    case ${CONFIG:-} in asan) sanitize=-fsanitize=address,undefined ;; cov) sanitize=--coverage ;; esac
    must flags --cflags
    shows "-I$PWD/root/usr/include"
    # shellcheck disable=SC2046,SC2086 # words
    must ${CC:-cc} -Wall -Wextra -Werror -std=c11 $sanitize $(flags --cflags) -o count count.c $(flags --libs)
    must ./count "$GOLDEN/times.vgs"
    [ "$output" = $'0 pose1 0\n1 pose2 0\n2 frames of 4 vertices' ]
    capture ./count "$CORPUS/reject/no-end.vgs"
    [ "$status" = 3 ]
    says "no-end.vgs" "cut short"

    # it is the shared one that was linked; the static one does as well
    must readelf -d count
    shows "[libvg.so.0]"
    # shellcheck disable=SC2046,SC2086 # words
    must ${CC:-cc} -Wall -std=c11 $sanitize $(flags --cflags) -o static count.c "$PWD/root/usr/lib/libvg.a" \
        $(flags --static --libs | sed 's/-lvg //')
    must env -u LD_LIBRARY_PATH ./static "$GOLDEN/times.vgs"

    # the examples in C, against the same by the programs
    cp -r root/usr/share/doc/vg/examples/c .
    PKG_CONFIG_LIBDIR=$PWD/root/usr/lib/pkgconfig PKG_CONFIG_SYSROOT_DIR=$PWD/root PKG_CONFIG_ALLOW_SYSTEM_CFLAGS=1 \
        PKG_CONFIG_ALLOW_SYSTEM_LIBS=1 make -s -C c CC="${CC:-cc}" CFLAGS="-O1 -Wall -Wextra -Werror $sanitize"
    must vg-encode --take 0-3 "$DATA/human-man-poses.tar.xz" -o man.vgs
    must c/transfer man.vgs "$DATA/human-heavy-poses.tar.xz" heavy.npz
    pipe 'vg-deform --by pose --pin none --onto "$DATA/human-heavy-poses.tar.xz" man.vgs | vg-solve --fit squares -o heavy.vgs'
    must vg-diff -q -t 1e-7 heavy.vgs heavy.npz # binary32
    must_fail 3 c/transfer "$DATA/horse.rest.obj" "$DATA/human-heavy-poses.tar.xz" no.npz
    [ ! -e no.npz ]
    pipe 'c/shift 1 -2 0.5 <man.vgs | vg-encode --origin 1,-2,0.5 - | vg-diff -t 1e-14 man.vgs -'
    pipe_fail 3 'head -c 100000 man.vgs | c/shift 1 2 3 | vg-info -'
    says "shift: "
    must c/centroids "$DATA/horse.rest.obj"
    [[ $output == 'horse.rest '* ]]

    # the program of the README
    sed -n '/^    #include <stdio.h>/,/^    }/s/^    //p' "$ROOT/README.md" >centroids.c
    # shellcheck disable=SC2046,SC2086 # words
    must ${CC:-cc} -Wall -Wextra -Werror -std=c11 $sanitize $(flags --cflags) -o centroids centroids.c $(flags --libs)
    must ./centroids "$DATA/horse.rest.obj"
    [[ $output == 'horse.rest '* ]]

    [ "$(PKG_CONFIG_LIBDIR=root/usr/lib/pkgconfig pkg-config --modversion libvg)" = "$(sed -n 's/^#define VG_VERSION "\(.*\)"/\1/p' "$ROOT/lib/vg.h")" ]

    # nothing of where it was built
    capture grep -l -r -F -e "$ROOT/" root/usr/lib/pkgconfig root/usr/include root/usr/share
    [ "$status" = 1 ] || fail "these name the directory of the sources: $output"

    make_into_root uninstall
    must find root ! -type d
    [ -z "$output" ] || fail "left behind: $output"
}
