# register.bats: vg-register: what it writes, says and refuses, and that a transfer goes through what it found.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck shell=bash disable=SC2154

load lib

# body NAME: the light bodies of tests/data as NAME.obj
body() {
    xz -dc "$DATA/$1.rest.obj.xz" >"$1.obj"
}

bodies() {
    body walk-man
    body walk-woman
    cp "$DATA/male1591-female1605.markers.txt" markers.txt
}

# sheet N M TURN: a wavy sheet of N x M quads with its texture coordinates, moved and turned about z by TURN radians
sheet() {
    LC_ALL=C awk -v n="$1" -v m="$2" -v turn="$3" 'BEGIN {
        for (i = 0; i <= n; i++) for (k = 0; k <= m; k++) {
            x = 3 * i / n; y = 2 * k / m
            c = cos(turn); s = sin(turn)
            printf "v %.6f %.6f %.6f\n", c * x - s * y + turn, s * x + c * y, 0.3 * sin(2 * x) * cos(3 * y)
            printf "vt %.6f %.6f\n", i / n, k / m
        }
        for (i = 0; i < n; i++) for (k = 0; k < m; k++) {
            a = i * (m + 1) + k + 1; b = a + m + 1
            printf "f %d/%d %d/%d %d/%d %d/%d\n", a, a, b, b, b + 1, b + 1, a + 1, a + 1
        }
    }'
}

# number FILE KEY: a number of the correspondence that vg-info --json tells
number() {
    vg-info --json "$1" |
        python3 -c 'import json, sys; print(json.load(sys.stdin)["correspondence"][sys.argv[1]])' "$2"
}

@test "two bodies: every face matched, the fitted source lies on the target, the stream is whole" {
    bodies
    must vg-register walk-man.obj walk-woman.obj --markers markers.txt -o c.vgs
    nothing_but c.vgs markers.txt walk-man.obj walk-woman.obj
    must vg-info --check c.vgs
    must vg-info c.vgs
    shows '1591 vertices' "frames     1: 'walk-woman'" 'reference   walk-man' \
        'target       1584 faces, 1605 vertices' 'matched      1584 of 1584 faces (100 %)' \
        'vg-register walk-man.obj walk-woman.obj --markers markers.txt -o c.vgs'
    python3 -c 'import sys; sys.exit(not float(sys.argv[1]) < 0.005)' "$(number c.vgs mean_distance_D)"
    pipe 'vg-register walk-man.obj walk-woman.obj -m - <markers.txt | vg-decode -o fitted.obj'
    [ "$(grep -c '^f ' fitted.obj)" = 1570 ]
    must vg-view c.vgs -o c.png
}

@test "patches of the source are none of the target" {
    bodies
    must vg-register walk-man.obj walk-woman.obj --markers markers.txt -o c.vgs
    must vg-encode walk-man.obj walk-man.obj -o man.vgs
    must vg-segment -k 3 man.vgs -o patches.vgs
    must vg-deform --onto walk-woman.obj --correspondence c.vgs patches.vgs -o out.vgs
    must vg-info --check out.vgs
    must vg-info --json out.vgs
    [[ $output != *'"patches"'* && $output == *'"kind": "vectors"'* ]] || fail "$output"
}

@test "the same bytes for any number of threads" {
    bodies
    must vg-register -j 1 --no-provenance walk-man.obj walk-woman.obj -m markers.txt -o 1.vgs
    must vg-register -j 5 --no-provenance walk-man.obj walk-woman.obj -m markers.txt -o 5.vgs
    same_file 1.vgs 5.vgs
}

@test "dinosaurs of mixed polygons: most faces matched, the rest reported and driven" {
    cp "$DATA/velociraptor.rest.obj" v.obj
    cp "$DATA/trex.rest.obj" t.obj
    cp "$DATA/velociraptor-trex.markers.txt" m.txt
    capture vg-register v.obj t.obj -m m.txt -o c.vgs
    [ "$status" = 0 ]
    one_line
    says " of the 838 faces of the target's component 0 have no counterpart: they ride with those beside them"
    [ "$(number c.vgs matched_faces)" -gt 700 ]
    must vg-register -q v.obj t.obj -m m.txt -o c.vgs
}

@test "a mesh to itself: exactly one source per face, and a transfer over it gives nearly the sequence back" {
    printf '0 0\n100 100\n200 200\n300 300\n' >self.txt
    must vg-register "$DATA/horse.rest.obj" "$DATA/horse.rest.obj" -m self.txt -o c.vgs
    [ "$(number c.vgs pairs)" = "$(number c.vgs target_faces)" ]
    vg-encode "$DATA/horse.rest.obj" "$DATA/horse-run.tar.xz" >run.vgs
    pipe "vg-deform --by gradient --onto $DATA/horse.rest.obj --correspondence c.vgs run.vgs | vg-solve -o again.vgs"
    # one linear map a face: what polygons that are not flat do beyond it is lost
    must vg-diff --of mean -t 3e-3 --centred run.vgs again.vgs
}

@test "markers: names, base 1, and what contradicts the others" {
    bodies
    awk '!/^#/ {print "m" ++n, $1 + 1, $2 + 1}' markers.txt >one.txt
    must vg-register --no-provenance walk-man.obj walk-woman.obj -m markers.txt -o 0.vgs
    must vg-register --no-provenance --index-base 1 walk-man.obj walk-woman.obj -m one.txt -o 1.vgs
    same_file 0.vgs 1.vgs
    awk '$1 == "m9" {$3 = 660} {print}' one.txt >wrong.txt
    capture vg-register --index-base 1 walk-man.obj walk-woman.obj -m wrong.txt -o w.vgs
    [ "$status" = 0 ]
    one_line
    says "warning: marker 'm9' (line 9), vertex $(awk '$1 == "m9" {print $2}' one.txt) on vertex 660, is 0." ' D from where its neighbours expect it' \
        'it is left out'
    must_warn vg-register --keep-all --index-base 1 walk-man.obj walk-woman.obj -m wrong.txt -o k.vgs
    says 'it is used all the same'
    must_warn vg-register -v walk-man.obj walk-woman.obj -m one.txt --index-base 1 -o v.vgs
    says 'round 8 of 8: ' 'the source as a whole: scale 0.95' "marker 'm1' (line 1): " \
        '1584 of 1584 faces of the target matched'
}

@test "two markers on one vertex of a side: a warning names both lines" {
    bodies
    { cat markers.txt; tail -n 1 markers.txt | awk '{print $(NF-1), $NF}'; } >twice.txt
    n=$(wc -l <twice.txt)
    must_warn vg-register walk-man.obj walk-woman.obj -m twice.txt -o t.vgs
    read -r source target < <(tail -n 1 twice.txt)
    says "the markers of lines $((n - 1)) and $n are both on vertex $source of the source" \
        "the markers of lines $((n - 1)) and $n are both on vertex $target of the target"
}

@test "without markers: aligned, texture coordinates, dense" {
    body walk-man
    cp walk-man.obj other.obj
    must vg-register --aligned walk-man.obj other.obj -o a.vgs
    [ "$(number a.vgs pairs)" = 1570 ]
    awk '$1 == "v" {n++; printf "%d %d %d %d 1 0 0\n", n - 1, n - 1, n - 1, n - 1}' walk-man.obj >dense.txt
    must vg-register --dense dense.txt walk-man.obj other.obj -o d.vgs
    [ "$(number d.vgs pairs)" = 1570 ]
    must vg-register --dense-source dense.txt walk-man.obj other.obj -o d.vgs
    [ "$(number d.vgs pairs)" = 1570 ]
    sheet 12 9 0 >s.obj
    sheet 10 7 5 >t.obj
    must vg-register --uv s.obj t.obj -o t.vgs
    [ "$(number t.vgs matched_faces)" = 70 ]
    must_warn vg-register -v --uv s.obj t.obj -o t.vgs
    says '130 vertices of the source found their texture coordinates on the target'
    must_fail 3 vg-register --uv walk-man.obj t.obj -o x.vgs
    says "'walk-man.obj' has no texture coordinates: --uv needs them in both meshes"
}

@test "usage" {
    mesh cube >a.obj
    must_fail 2 vg-register a.obj a.obj -o c.vgs
    says 'nothing says which point belongs to which: give --markers FILE, --dense FILE, --uv, or --aligned'
    must_fail 2 vg-register a.obj --aligned -o c.vgs
    says 'two meshes are needed: SOURCE and TARGET'
    must_fail 2 vg-register --dense a --dense-source b a.obj a.obj -o c.vgs
    says '--dense does not go with --dense-source'
    must_fail 2 vg-register --aligned a.obj a.obj -o c.obj
    must_fail 2 vg-register --aligned --index-base 2 a.obj a.obj -o c.vgs
    nothing_but a.obj
}

@test "input that cannot be used" {
    mesh cube >a.obj
    printf '0 0\n1 1\n' >two.txt
    must_fail 3 vg-register a.obj a.obj -m two.txt -o c.vgs
    says '2 pairs do not say how the meshes lie: give at least three that are not in line'
    one_line
    printf '0 0\nnose 1 8\n2 2\n' >out.txt
    must_fail 3 vg-register a.obj a.obj -m out.txt -o c.vgs
    says "marker 'nose' names vertex 8, but the target has 8 vertices"
    printf '0 0\n1\n' >short.txt
    must_fail 3 vg-register a.obj a.obj -m short.txt -o c.vgs
    says "'short.txt' line 2: a marker is 'SOURCE TARGET' or 'NAME SOURCE TARGET'"
    must_fail 4 vg-register a.obj a.obj -m none.txt -o c.vgs
    says "cannot read 'none.txt': No such file or directory"
    must_fail 4 vg-register a.obj none.obj --aligned -o c.vgs
    nothing_but a.obj two.txt out.txt short.txt
}

@test "--components: what explains nothing of the target is left out by default, and says so; --components overrides" {
    local horse=$DATA/horse.rest.obj n
    n=$(grep -c '^v ' "$horse")
    # the source: a horse, and another, smaller one inside of it
    awk '$1 == "v" {printf "v %.6f %.6f %.6f\n", 0.9 * $2, 0.9 * $3 + 0.05, 0.9 * $4}' "$horse" >inner
    { grep '^v ' "$horse"; cat inner; grep '^f ' "$horse"
      grep '^f ' "$horse" | awk -v n="$n" '{for (i = 2; i <= NF; i++) $i += n; print}'; } >two.obj
    awk -v n="$n" 'BEGIN {for (i = 0; i < n; i += 12) print i, i}' >markers.txt
    must_warn vg-register two.obj "$horse" --markers markers.txt -o default.vgs
    says '1 of the 2 components of the source explain nothing of the target and are left out: 1'
    must vg-register two.obj "$horse" --markers markers.txt --components 0 -o one.vgs
    must vg-register -q two.obj "$horse" --markers markers.txt --components all -o all.vgs
    # the same pairs by default as by --components 0
    cmp <(vg-decode -q default.vgs -o default.obj && cat default.obj) <(vg-decode -q one.vgs -o one.obj && cat one.obj)
    must_fail 3 vg-register two.obj "$horse" --markers markers.txt --components 7 -o none.vgs
    [ ! -e none.vgs ]
}
