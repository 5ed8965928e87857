# info.bats: vg-info: what it tells of a sequence, --check, --digest, --frames; and what all programs share (cli.c).
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck shell=bash disable=SC2154

load lib

# is FILE PATH JSON: exactly this value
is() {
    python3 - "$@" <<'END'
import json, sys
x = json.load(open(sys.argv[1]), parse_constant=lambda name: sys.exit("not JSON: " + name))
for key in sys.argv[2].split("."):
    x = x[int(key)] if isinstance(x, list) else x[key]
if x != json.loads(sys.argv[3]):
    sys.exit("%s is %r, not %s" % (sys.argv[2], x, sys.argv[3]))
END
}

@test "it tells what is in a stream" {
    mesh strip >a.obj
    echo 'v 9 9 9' >>a.obj # in no face
    sed 's/^v 0.000000/v 0.5/' a.obj >b.obj
    vg-encode a.obj b.obj >s.vgs
    must vg-info s.vgs
    shows "bytes      $(stat -c %s s.vgs)" "7 vertices, binary64" "frames     2: 'a' to 'b'" \
        '3: 1 of 2, 1 of 3, 1 of 4' 'components  1' 'isolated    1' 'reference   a' '  vg-encode a.obj b.obj'
    must vg-info --json s.vgs -o s.json
    is s.json kind '"vertices"'
    is s.json precision 64
    is s.json frames 2
    is s.json elements 7
    is s.json mesh.vertices 7
    is s.json mesh.faces 3
    is s.json mesh.face_sizes '[{"size": 2, "faces": 1}, {"size": 3, "faces": 1}, {"size": 4, "faces": 1}]'
    is s.json mesh.components 1
    is s.json mesh.isolated_vertices 1
    is s.json mesh.selected_faces null
    is s.json provenance.0.args '["vg-encode", "a.obj", "b.obj"]'
    is s.json provenance.0.parents '[]'
    is s.json unknown_records 0
    is s.json last '"b"'
}

@test "D is the diagonal of the reference's bounding box" {
    mesh cube >a.obj
    must vg-info --json a.obj -o a.json
    python3 -c 'import json; assert json.load(open("a.json"))["mesh"]["D"] == 3 ** 0.5'
}

@test "mesh files, archives and standard input are described as sequences" {
    must vg-info --json "$DATA/trex-walk.tar.xz" -o t.json
    is t.json frames 34
    is t.json mesh.vertices 912
    is t.json mesh.faces 838
    must vg-info "$DATA/trex-walk.tar.xz"
    shows '134 of 3, 626 of 4, 78 of 5 to 21'
    must vg-info --json "$DATA/woman-tanktop-jump.tar.xz" -o w.json
    is w.json mesh.components 6
    mesh two >a.obj
    pipe 'vg-encode a.obj | vg-info --json -o s.json'
    is s.json name '"standard input"'
    is s.json bytes null
    is s.json mesh.components 2
    vg-encode a.obj >s.vgs
    pipe 'vg-info - <s.vgs'
    shows "bytes      $(stat -c %s s.vgs)"
}

@test "vectors: their links, selection and precision" {
    mesh two >a.obj
    vg-encode --vectors --f32 a.obj >w.vgs
    must vg-info --json w.vgs -o w.json
    is w.json kind '"vectors"'
    is w.json precision 32
    is w.json mesh.links 1
    is w.json elements 38 # 6 * 4 + 4 * 3 corners, and a link of 2
    is w.json frame_bytes 456
    vg-encode --vectors --faces selected "$DATA/horse-run.tar.xz" >h.vgs
    must vg-info --json h.vgs -o h.json
    python3 -c 'import json; m = json.load(open("h.json"))["mesh"]; assert 0 < m["selected_faces"] < m["faces"]'
}

@test "--check says whole, and only that; -q not even that" {
    poses cube 2
    vg-encode pose1.obj pose2.obj >s.vgs
    must vg-info --check s.vgs
    [ "$output" = whole ]
    must vg-info --check -q s.vgs
    [ -z "$output" ]
    must vg-info --check --json s.vgs -o s.json
    is s.json whole true
    must vg-info --check "$DATA/horse-run.tar.xz"
}

@test "every way to describe a stream fails when it is cut short or changed" {
    poses cube 2
    vg-encode pose1.obj pose2.obj >s.vgs
    size=$(stat -c %s s.vgs)
    for n in 0 1 8 16 40 200 $((size / 2)) $((size - 33)) $((size - 1)); do
        head -c "$n" s.vgs >cut.vgs
        for option in --check --digest --frames --json -v; do
            must_fail 3 vg-info $option cut.vgs
            one_line
            [ -z "$output" ]
        done
    done
    for at in 3 20 100 $((size / 2)) $((size - 4)); do
        python3 - "$at" <<'END'
import sys
b = bytearray(open("s.vgs", "rb").read())
b[int(sys.argv[1])] ^= 0x40
open("bad.vgs", "wb").write(b)
END
        must_fail 3 vg-info --check bad.vgs
        one_line
        says bad.vgs
    done
    cat s.vgs s.vgs >twice.vgs
    must_fail 3 vg-info --check twice.vgs
}

@test "missing, empty and foreign input" {
    must_fail 4 vg-info missing.vgs
    says "'missing.vgs'"
    must_fail 3 vg-info - </dev/null
    says empty
    must_fail 3 bash -c 'vg-info </dev/null'
    printf 'hello\n' >text
    must_fail 3 vg-info text
    one_line
    must_fail 4 bash -c 'vg-info <&-'
}

@test "--digest: one number for one content, whoever made it and however exactly it is written" {
    poses cube 3
    vg-encode pose1.obj pose2.obj pose3.obj >a.vgs
    vg-encode --no-provenance pose1.obj pose2.obj pose3.obj >b.vgs
    must vg-info --digest a.vgs
    [[ $output =~ ^[0-9a-f]{16}$ ]]
    d=$output
    [ "$(vg-info --digest b.vgs)" = "$d" ]
    [ "$(vg-info --digest <b.vgs)" = "$d" ]
    mkdir poses && mv pose?.obj poses
    [ "$(vg-info --digest poses)" = "$d" ]
    # coordinates that are binary32 numbers
    mesh cube >flat.obj
    sed 's/^v 1.000000/v 1.5/' flat.obj >wide.obj
    must vg-encode --f32 flat.obj wide.obj -o single.vgs
    must vg-encode flat.obj wide.obj -o double.vgs
    must vg-info --digest single.vgs
    d=$output
    must vg-info --digest double.vgs
    [ "$output" = "$d" ]
}

@test "--digest: other content, another number" {
    poses cube 3
    cp pose2.obj other.obj
    {
        vg-encode pose1.obj pose2.obj pose3.obj | vg-info --digest
        vg-encode pose1.obj pose2.obj | vg-info --digest
        vg-encode pose1.obj pose3.obj pose2.obj | vg-info --digest            # order
        vg-encode pose1.obj other.obj pose3.obj | vg-info --digest            # a name
        vg-encode --vectors pose1.obj pose2.obj pose3.obj | vg-info --digest  # a kind
        sed -i 's/^f 1 4 3 2/f 4 3 2 1/' pose1.obj pose2.obj pose3.obj
        vg-encode pose1.obj pose2.obj pose3.obj | vg-info --digest            # a face
        sed -i '1s/.*/v 0 0 1e-9/' pose3.obj
        vg-encode pose1.obj pose2.obj pose3.obj | vg-info --digest            # a number
    } >digests
    [ "$(grep -c '^[0-9a-f]\{16\}$' digests)" = 7 ]
    [ "$(sort -u digests | wc -l)" = 7 ]
}

@test "--frames lists every frame with its centroid" {
    mesh cube >first.obj
    mesh cube 0 2 >second.obj
    vg-encode first.obj second.obj >s.vgs
    must vg-info --frames --json s.vgs -o s.json
    is s.json frame_list '[{"frame": 0, "name": "first", "time": null, "x": 0.5, "y": 0.5, "z": 0.5},
                           {"frame": 1, "name": "second", "time": null, "x": 2.5, "y": 0.5, "z": 0.5}]'
    is s.json frames 2
    must vg-info --frames s.vgs
    [ "$(printf '%s\n' "$output" | wc -l)" = 3 ]
    shows 'centroid x' '1  second'
    must vg-encode --vectors first.obj second.obj -o w.vgs
    must vg-info --frames --json w.vgs -o w.json
    is w.json frame_list.1.least -0.5
    is w.json frame_list.1.most 0.5
}

@test "the processes that made it, as a tree of commands that can be typed again" {
    mesh cube >"a b.obj"
    mesh cube 0.2 >"it's.obj"
    vg-encode "a b.obj" "it's.obj" | vg-deform --onto "a b.obj" >s.vgs
    must vg-info s.vgs
    shows "made by
  vg-deform --onto 'a b.obj'
    vg-encode 'a b.obj' 'it'\\''s.obj'"
    must vg-info --json s.vgs -o s.json
    is s.json provenance.0.args.2 "\"it's.obj\""
    is s.json provenance.1.parents '[0]'
    is s.json provenance.1.program '"vg-deform"'
}

@test "names are shown, not obeyed" {
    mesh cube >a.obj
    name=$(printf 'x\033[31mred')
    cp a.obj "$name.obj"
    must vg-info "$name.obj"
    [[ $output != *$'\033'* ]]
    shows 'x?[31mred'
    must_fail 4 vg-info "$name"
    [[ $stderr != *$'\033'* ]]
    latin=$(printf 'caf\351.obj')
    cp a.obj "$latin"
    must vg-info --json "$latin" -o n.json
    is n.json name '"caf?.obj"'
}

@test "wrong usage of vg-info" {
    mesh cube >a.obj
    must_fail 2 vg-info a.obj a.obj
    says 'one operand too many' 'usage: vg-info [options] [FILE]'
    must_fail 2 vg-info --check --digest a.obj
    must_fail 2 vg-info --no-such-option
    says "'--no-such-option'"
    must_fail 2 vg-info -x
    says "'-x'"
    must_fail 2 vg-info --check=yes a.obj
    says 'takes no value'
    must_fail 2 vg-info a.obj -o
    must_fail 2 vg-info a.obj -o ''
    [ -z "$output" ]
}

@test "options may stand behind operands, and -- ends them" {
    mesh cube >-a.obj
    must vg-info ./-a.obj --digest
    d=$output
    must vg-info --digest -- -a.obj
    [ "$output" = "$d" ]
    must_fail 2 vg-info --digest -a.obj
}

@test "every program: -h, -V, and no writing to a full device unseen" {
    for p in $(each_program); do
        must "$p" -h
        shows "usage: $p " '--help' '--version' '--quiet' '--verbose' '--output'
        must "$p" --version
        [ "$output" = "$p (vg) $(sed -n 's/^#define VG_VERSION "\(.*\)"/\1/p' "$ROOT/lib/vg.h")
stream 1.0" ]
        must_fail 4 bash -c "$p -h >/dev/full"
    done
}

@test "a stream has its own names: mesh names are refused before any work, with advice" {
    mesh cube >a.obj
    for name in out.obj out.PLY out.tar.gz out.zip:ply out.glb; do
        must_fail 2 vg-encode missing.obj -o "$name"
        says "vg-encode: the output is a stream: pipe it into 'vg-decode -o $name'"
    done
    must_fail 2 vg-encode missing.obj -o look.html
    says "pipe it into 'vg-view -o look.html'"
    nothing_but a.obj
}

@test "no stream goes to a terminal, and no program waits for one" {
    needs_terminal
    mesh cube >a.obj
    cat >term.py <<'END'
import os, pty, sys
status = pty.spawn(sys.argv[1:], lambda fd: os.read(fd, 65536), lambda fd: b"")
sys.exit(os.waitstatus_to_exitcode(status))
END
    status=0
    python3 term.py vg-encode a.obj >out </dev/null || status=$?
    [ $status = 2 ]
    grep -q 'a stream is not written to a terminal: use -o FILE or pipe it into' out
    status=0
    timeout 300 python3 term.py vg-info >out </dev/null || status=$?
    [ $status = 2 ]
    grep -q 'no input: name a stream' out
}

@test "output through a link, to a pipe, and with the mode it had" {
    mesh cube >a.obj
    : >real.txt
    chmod 640 real.txt
    ln -s real.txt link.txt
    must vg-info a.obj -o link.txt
    [ -L link.txt ]
    [ "$(stat -c %a real.txt)" = 640 ]
    grep -q '^vertices    8$' real.txt
    mkfifo pipe
    cat pipe >copy.txt &
    must vg-info a.obj -o pipe
    wait $!
    same_file copy.txt real.txt
    [ -p pipe ]
    mkdir dir
    must_fail 4 vg-info a.obj -o dir
    must_fail 4 vg-info a.obj -o real.txt/x
    nothing_but a.obj copy.txt dir link.txt pipe real.txt
}

@test "a file that is replaced keeps its permissions, whatever writes it" {
    poses cube 2
    vg-encode pose1.obj pose2.obj -o walk.vgs
    mkdir out
    for name in out.vgs out.txt out.png out.obj out.ply out.zip out.pc2 out.glb p0.obj p1.obj out/pose1.obj; do
        : >$name
        chmod 640 $name
    done
    must vg-encode walk.vgs -o out.vgs
    must vg-info walk.vgs -o out.txt
    must vg-view walk.vgs -o out.png
    must vg-decode pose1.obj -o out.obj
    must vg-decode -q walk.vgs -o out.zip
    must vg-decode -q walk.vgs -o out.glb
    must vg-decode -q --mesh out.ply walk.vgs -o out.pc2
    must vg-decode --replace walk.vgs -o 'p%d.obj'
    must vg-decode --replace walk.vgs -o out/
    for name in out.vgs out.txt out.png out.obj out.ply out.zip out.pc2 out.glb p0.obj p1.obj out/pose1.obj; do
        [ -s $name ] && [ "$(stat -c %a $name)" = 640 ] || fail "$name has mode $(stat -c %a $name), not 640"
    done
    (umask 027 && vg-decode pose1.obj -o new.obj)
    [ "$(stat -c %a new.obj)" = 640 ] # a new file follows the umask
}

@test "a link that leads nowhere, or to itself, is neither followed nor replaced" {
    mesh cube >a.obj
    mkdir d
    ln -s nowhere dangling
    ln -s loop loop
    ln -s nowhere d/a.obj
    for link in dangling loop; do
        for command in "vg-info a.obj" "vg-encode a.obj" "vg-view a.obj --format png" "vg-decode a.obj --format ply"; do
            # shellcheck disable=SC2086 # words
            must_fail 4 $command -o $link
            says "'$link'"
            one_line
        done
    done
    must_fail 4 vg-decode a.obj -o d/
    says "'d/a.obj': it is a link to a file that does not exist"
    [ -L dangling ] && [ -L loop ] && [ -L d/a.obj ]
    nothing_but a.obj d dangling loop
}

@test "a signal leaves no temporary file, and is what the process ends by" {
    vg-encode "$DATA/horse-run.tar.xz" >one.vgs
    mkfifo in
    for signal in TERM HUP XCPU; do
        # it has the head, and waits for the rest; whoever runs the tests may ignore signals (nohup)
        env --default-signal vg-encode - -o late.vgs <in &
        waiting=$!
        exec 7>in
        head -c 60000 one.vgs >&7
        for _ in $(seq 100); do
            compgen -G '.vg-*.tmp' >/dev/null && break
            sleep 0.05
        done
        compgen -G '.vg-*.tmp'
        kill -$signal $waiting
        status=0
        wait $waiting || status=$?
        exec 7>&-
        [ $status = $((128 + $(kill -l $signal))) ]
        nothing_but in one.vgs
    done
}

@test "the joints of a skeleton are shown as a tree, and in how many frames their turns are known" {
    must vg-info "$GOLDEN/turns.vgs"
    [[ $output == *$'\n'"skeleton  4 joints, 3 of them turn"$'\n'"  Hips: position xyz, rotation zxy"$'\n'"    Spine: rotation zxy, end"$'\n'"    Küken: rotation x"$'\n'* ]] ||
        fail "$output"
    [[ $output == *"known in 1 of 1 frames"* ]] || fail "$output"
    must vg-info "$CORPUS/accept/turns-in-one-frame.vgs"
    [[ $output == *"known in 1 of 2 frames"* ]] || fail "$output"
    vg-info --json "$GOLDEN/turns.vgs" >turns.json
    py "$GOLDEN/turns.json" <<'END'
import json, sys
got, want = json.load(open("turns.json"))["skeleton"], json.load(open(sys.argv[1]))["skeleton"]
assert (got["joints"], got["bones"], got["ends"], got["channels"], got["turned_frames"]) == (4, 3, 1, 10, 1)
names = [None, "Xposition", "Yposition", "Zposition", "Xrotation", "Yrotation", "Zrotation"]
assert got["tree"] == [dict(j, channels=[names[c] for c in j["channels"]]) for j in want]
END
}

@test "a correspondence's source may claim any number of faces" {
    py <<'END'
import make_corpus as m
open("many.vgs", "wb").write(m.patched(m.register_content(), "CORR", 8, m.u64(1 << 61)))
END
    must vg-info --json many.vgs -o many.json
    is many.json correspondence.source_faces 2305843009213693952
    is many.json correspondence.source_faces_used 2
}

@test "numbers of no vertices have no range" {
    must vg-info "$CORPUS/accept/scalars-of-nothing.vgs"
    shows "'x' of each vertex in 1 of the frames"
    [[ $output != *nan* ]]
    must vg-info --json "$CORPUS/accept/scalars-of-nothing.vgs" -o s.json
    is s.json channels.0.least null
}

@test "a rig and its map are described, and its weights printed" {
    must vg-info "$GOLDEN/rig.vgs"
    [[ $output == *"rig  4 joints, 3 of them turn"* && $output == *"3 bones, 2 for each corner"* ]] || fail "$output"
    must vg-info "$CORPUS/accept/map-of-bones-without-corners.vgs"
    [[ $output == *"3 bones, by linear blend skinning alone"* ]] || fail "$output"
    must vg-info "$GOLDEN/map.vgs"
    [[ $output == *"2 patches"* ]] || fail "$output"
    must vg-info --weights "$GOLDEN/rig.vgs" -o weights.txt
    vg-info --json "$GOLDEN/rig.vgs" >rig.json
    py "$GOLDEN/rig.json" <<'END'
import json, sys
truth, told = json.load(open(sys.argv[1])), json.load(open("rig.json"))
assert told["rig"]["skinned"] is True and told["map"]["kind"] == "bones" and told["map"]["per_corner"] == 2
names = [j["name"] for j in truth["rig"]["joints"] if j["channels"]]
skin = truth["rig"]["skin"]
lines = [line.split() for line in open("weights.txt") if not line.startswith("#")]
assert len(lines) == 4
for v, (number, *pairs) in enumerate(lines):
    want = [(names[b], w) for b, w in zip(skin["bones"][v], skin["weights"][v]) if w > 0]
    assert int(number) == v and list(zip(pairs[::2], map(float, pairs[1::2]))) == want
END
    must_fail 3 vg-info --weights "$CORPUS/accept/rig-without-skin.vgs"
    must_fail 3 vg-info --weights "$GOLDEN/smallest.vgs"
    must_fail 2 vg-info --weights --json "$GOLDEN/rig.vgs"
    must_fail 2 vg-info --weights --digest "$GOLDEN/rig.vgs"
}

@test "times and numbers of vertices: from the first, over all frames" {
    poses cube 3
    must vg-encode --fps 4 pose*.obj -o timed.vgs
    must vg-info timed.vgs
    shows '0 s to 0.5 s'
    must vg-info --json timed.vgs -o timed.json
    py <<'END'
import json, make_corpus as m
told = json.load(open("timed.json"))
assert (told["first_time"], told["last_time"], told["first"], told["last"]) == (0, 0.5, "pose1", "pose3"), told
numbers = [[0, 0.25, -1, 0.125], [0.5, -2, 0, 0], [0, 0.25, -1, 0]]
frames = [dict(m.pose("p%d" % i, m.POINTS[:4]), scalars={"name": "load", "unit": "N", "numbers": x}) for i, x in enumerate(numbers)]
m.write("load.vgs", m.whole(m.content(frames=frames)))
END
    must vg-info load.vgs
    shows "'load' of each vertex in 3 of the frames: -2 to 0.5 N"
}
