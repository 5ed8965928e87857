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
    says " of the 838 faces of the target's component 0 have no counterpart: they follow those beside them"
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
    says 'it is used anyway'
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
    says 'there are no pairs of points: give --markers FILE, --dense FILE, --uv, or --aligned'
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
    says '2 pairs do not determine the alignment: give at least three that are not collinear'
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
    says '1 of the 2 components of the source match no part of the target and are left out: 1'
    must vg-register two.obj "$horse" --markers markers.txt --components 0 -o one.vgs
    must vg-register -q two.obj "$horse" --markers markers.txt --components all -o all.vgs
    # the same pairs by default as by --components 0
    cmp <(vg-decode -q default.vgs -o default.obj && cat default.obj) <(vg-decode -q one.vgs -o one.obj && cat one.obj)
    must_fail 3 vg-register two.obj "$horse" --markers markers.txt --components 7 -o none.vgs
    [ ! -e none.vgs ]
}

@test "--bind: what rides on a body turns with it, stays on it, and keeps its distance where that bends" {
    must vg-encode --take 0-/4 "$DATA/human-man-poses.tar.xz" -o man.vgs
    must vg-encode --take 0 man.vgs -o first.vgs
    must vg-decode first.vgs --f64 -o rest.obj
    # on itself: every vertex stays on its point
    must vg-register --bind rest.obj rest.obj -o self.vgs
    must vg-deform --onto rest.obj --correspondence self.vgs man.vgs -o on-itself.vgs
    must vg-diff -t 1e-14 man.vgs on-itself.vgs
    # a sheet that is rolled to a cylinder, and a finer one above it: rolled too, by the height less of radius
    py <<'END'
import math
def sheet(name, nx, ny, z, radius=None, turn=0):
    with open(name, "w") as o:
        for j in range(ny + 1):
            for i in range(nx + 1):
                x, y, h = 6 * i / nx - 3, 2 * j / ny - 1, z
                if radius:
                    x, h = (radius - z) * math.sin(x / radius), radius - (radius - z) * math.cos(x / radius)
                c, s = math.cos(turn), math.sin(turn)
                print("v", repr(c * x - s * h + turn), repr(y - 3 * turn), repr(s * x + c * h), file=o)
        for j in range(ny):
            for i in range(nx):
                a = j * (nx + 1) + i + 1
                print("f", a, a + 1, a + nx + 2, a + nx + 1, file=o)
sheet("body.obj", 60, 10, 0)
sheet("rolled.obj", 60, 10, 0, 2)
sheet("turned.obj", 60, 10, 0, None, 1.1)
sheet("shirt.obj", 83, 17, 0.1)
sheet("shirt-rolled.obj", 83, 17, 0.1, 2)
sheet("shirt-turned.obj", 83, 17, 0.1, None, 1.1)
END
    must vg-register --bind body.obj shirt.obj -o bound.vgs
    must vg-info bound.vgs
    shows "1411 faces"
    must vg-encode --reference body.obj rolled.obj turned.obj -o poses.vgs
    must vg-deform --onto shirt.obj --correspondence bound.vgs poses.vgs -o worn.vgs
    must vg-encode --reference shirt.obj shirt-rolled.obj shirt-turned.obj -o truth.vgs
    must vg-encode --take 1 truth.vgs -o truth1.vgs
    must vg-encode --take 1 worn.vgs -o worn1.vgs
    must vg-diff -t 1e-14 truth1.vgs worn1.vgs
    # faces of 0.1 on a radius of 2 lie up to 0.1^2 / 16 = 1e-4 D inside of it, two thirds of that on average; at the border the
    # faces that carry lie on one side, on average 0.06 away, and half a face: 0.1 above them is up to 0.1 (0.06 + 0.05) / 2 = 9e-4 D off
    must vg-diff --of mean -t 6.6e-5 truth.vgs worn.vgs
    must vg-diff -t 9e-4 truth.vgs worn.vgs
    must vg-deform -j 3 --onto shirt.obj --correspondence bound.vgs --no-provenance poses.vgs -o a.vgs
    must vg-deform -j 1 --onto shirt.obj --correspondence bound.vgs --no-provenance poses.vgs -o b.vgs
    same_file a.vgs b.vgs
    # concave faces and loose vertices
    printf 'v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 0.1 0\nv 0 1 0\nf 1 2 3 4 5\n' >concave.obj
    printf 'v 0.5 0.2 0.5\nv 1.5 0.2 0.5\nv 1 0.2 0.6\nv 1 5 5\nf 1 2 3\n' >prop.obj
    LC_ALL=C awk '$1 == "v" {print "v", -$3 + 4, $2, $4; next} {print}' concave.obj >unused.obj
    LC_ALL=C awk '$1 == "v" {print "v", -$3 + 4, $2 + 1, $4 - 2; next} {print}' concave.obj >moved.obj
    LC_ALL=C awk '$1 == "v" {print "v", -$3 + 4, $2 + 1, $4 - 2; next} {print}' prop.obj >prop-moved.obj
    must vg-register --bind concave.obj prop.obj -o bound.vgs
    must vg-encode --reference concave.obj moved.obj -o poses.vgs
    must vg-deform --onto prop.obj --correspondence bound.vgs poses.vgs -o out.vgs
    must vg-diff -t 1e-14 prop-moved.obj out.vgs
    # what does not fit
    must_fail 2 vg-deform --root stay --onto prop.obj --correspondence bound.vgs poses.vgs -o no.vgs
    must_fail 3 vg-deform --onto concave.obj --correspondence bound.vgs poses.vgs -o no.vgs
    says "another target"
    must_fail 3 vg-deform --onto prop.obj --correspondence bound.vgs man.vgs -o no.vgs
    says "another source"
    must_fail 2 vg-register --bind --aligned concave.obj prop.obj -o no.vgs
    printf 'v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n' >flat.obj
    must_fail 3 vg-register --bind flat.obj prop.obj -o no.vgs
    says "area"
    [ ! -e no.vgs ]
}
