#!/usr/bin/env bats
# Whole command lines: what a person types works, and what goes wrong in one program is told by all behind it.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# frame_names FILE: one a line
frame_names() {
    witness --json "$1" | python3 -c 'import json, sys; print("\n".join(f["name"] for f in json.load(sys.stdin)["frames"]))'
}

# ---- the command lines ------------------------------------------------------------------------------------------------

@test "there and back: a mesh through its vectors" {
    pipe "vg-encode --vectors '$DATA/horse.rest.obj' | vg-solve | vg-decode --f64 -o again.obj"
    must vg-diff -t 1e-12 "$DATA/horse.rest.obj" again.obj
    must diff <(grep '^f' "$DATA/horse.rest.obj" | tr -d '\r') <(grep '^f' again.obj)
}

@test "there and back: faces of 5 to 21 corners, six components, selected faces, binary32" {
    for name in trex-walk woman-tanktop-jump; do
        pipe "vg-encode --vectors '$DATA/$name.tar.xz' | vg-solve | vg-diff -t 1e-12 '$DATA/$name.tar.xz' -"
        pipe "vg-encode --vectors --faces selected '$DATA/$name.tar.xz' | vg-solve | vg-diff -t 1e-12 '$DATA/$name.tar.xz' -"
        pipe "vg-encode --vectors --f32 '$DATA/$name.tar.xz' | vg-solve | vg-diff -t 1e-5 '$DATA/$name.tar.xz' -"
    done
}

@test "transfer a sequence onto its own reference: every pose comes back" {
    for name in horse-run woman-tanktop-jump; do
        rest=$DATA/${name%-*}.rest.obj
        pipe "vg-encode --reference '$rest' '$DATA/$name.tar.xz' | vg-deform --onto '$rest' | vg-solve | vg-decode --f64 -o $name.zip"
        must vg-diff -t 1e-10 "$DATA/$name.tar.xz" "$name.zip"
    done
}

@test "deformations in two steps give what one step gives" {
    poses two 4
    mesh two 0.05 2 >target.obj
    pipe "vg-encode pose*.obj | vg-deform --by pose --onto target.obj | vg-solve >one.vgs"
    pipe "vg-encode pose*.obj | vg-deform | vg-deform --onto target.obj | vg-solve >two.vgs" # deformations go by pose
    pipe "vg-encode --vectors pose*.obj | vg-deform --by pose --onto target.obj | vg-solve >three.vgs"
    must vg-diff -t 1e-12 one.vgs two.vgs
    must vg-diff -t 1e-12 one.vgs three.vgs
}

@test "an anchored vertex is met exactly" {
    poses cube 4
    pipe "vg-encode --anchor 0,6 --vectors pose*.obj | vg-solve >out.vgs"
    must vg-encode pose*.obj -o in.vgs
    py <<'END'
import read_stream
for a, b in zip(read_stream.read_stream("in.vgs").frames, read_stream.read_stream("out.vgs").frames):
    for v in (0, 6):
        assert a.values[3 * v:3 * v + 3] == b.values[3 * v:3 * v + 3], (a.name, v)
END
}

@test "a target of an other mesh is refused with what differs" {
    poses cube 2
    mesh tetra >tetra.obj
    pipe_fail 3 "vg-encode pose1.obj pose2.obj | vg-deform --onto tetra.obj | vg-solve >out.vgs"
    says "vg-deform: " tetra.obj "4 vertices" "8" "vg-solve: "
}

@test "judge: vg-diff ends with 0 for the same, 1 over a tolerance and for another mesh, 3 for no mesh" {
    poses cube 3
    must vg-encode pose*.obj -o truth.vgs
    must vg-diff -t 0 truth.vgs truth.vgs
    mesh cube 0.05 >pose3.obj
    must vg-encode pose*.obj -o result.vgs
    capture vg-diff -t 1e-3 truth.vgs result.vgs
    [ "$status" = 1 ]
    must vg-diff truth.vgs result.vgs
    must vg-diff --json truth.vgs result.vgs
    python3 -m json.tool .stdout >/dev/null
    mesh tetra >tetra.obj
    must_fail 1 vg-diff truth.vgs tetra.obj
    says tetra.obj "4 vertices" 8
    must_fail 3 vg-diff "$GOLDEN/smallest.vgs" "$CORPUS/reject/no-end.vgs"
}

@test "look: a contact sheet, plain and with errors as colours" {
    poses cube 3
    must vg-encode pose*.obj -o truth.vgs
    must vg-view truth.vgs -o sheet.png --frames 8
    must vg-view truth.vgs --against truth.vgs -o errors.png
    for file in sheet.png errors.png; do
        [ "$(head -c 8 $file | od -An -tx1 | tr -d ' \n')" = 89504e470d0a1a0a ]
        [ "$(tail -c 8 $file | od -An -tx1 | tr -d ' \n')" = 49454e44ae426082 ]
    done
    nothing_but errors.png pose1.obj pose2.obj pose3.obj sheet.png truth.vgs
}

# ---- what goes in -----------------------------------------------------------------------------------------------------

@test "a directory, a pattern, an archive and a list of files give the same poses in natural order" {
    mkdir d
    for i in 1 2 3 10 20; do mesh cube "0.0$i" >"d/pose$i.obj"; done
    echo "not a mesh" >d/notes.txt
    (cd d && python3 -m zipfile -c ../d.zip pose20.obj pose1.obj pose10.obj pose3.obj pose2.obj)
    must vg-encode --no-provenance d/pose1.obj d/pose2.obj d/pose3.obj d/pose10.obj d/pose20.obj -o list.vgs
    must vg-encode --no-provenance d -o directory.vgs
    must vg-encode --no-provenance 'd/pose*.obj' -o pattern.vgs
    must vg-encode --no-provenance d.zip -o zip.vgs
    must frame_names list.vgs
    [ "$output" = $'pose1\npose2\npose3\npose10\npose20' ]
    for name in directory pattern zip; do
        must frame_names $name.vgs
        [ "$output" = $'pose1\npose2\npose3\npose10\npose20' ]
        must vg-diff -t 0 list.vgs $name.vgs
    done
}

@test "operands are read in the order given, and may be of different kinds" {
    poses tetra 4
    must vg-encode pose2.obj -o two.vgs
    python3 -m zipfile -c four.zip pose4.obj
    must vg-encode pose3.obj two.vgs four.zip pose1.obj -o all.vgs
    must frame_names all.vgs
    [ "$output" = $'pose3\npose2\npose4\npose1' ]
}

@test "standard input may be a mesh, an archive or a stream" {
    poses tetra 2
    python3 -m zipfile -c both.zip pose1.obj pose2.obj
    must vg-encode pose1.obj pose2.obj -o both.vgs
    pipe "vg-encode <pose1.obj | vg-diff -t 0 pose1.obj -"
    pipe "cat pose1.obj | vg-encode - | vg-diff -t 0 pose1.obj -"
    pipe "cat both.zip | vg-encode | vg-diff -t 0 both.vgs -"
    pipe "cat both.vgs | vg-encode | vg-diff -t 0 both.vgs -"
    pipe "vg-encode - pose2.obj <pose1.obj | vg-diff -t 0 both.vgs -"
    must_fail 2 vg-encode - - <pose1.obj
}

@test "standard input is not read unless it is the input" {
    mesh tetra >a.obj
    must vg-encode --vectors a.obj -o a.vgs
    printf 'left alone' >text
    pipe "{ vg-encode a.obj -o 1.vgs; vg-solve a.vgs -o 2.vgs; vg-deform a.vgs -o 3.vgs; vg-info a.vgs -o 4;
            vg-decode 2.vgs -o 5.obj; vg-diff a.obj a.obj -o 6; vg-view a.obj -o 7.png; cat; } <text"
    [ "$output" = "left alone" ]
}

@test "numbers are read and written alike where the comma is the decimal point" {
    export LOCPATH=$PWD/locales
    mkdir locales
    localedef -i de_DE -f UTF-8 locales/de_DE.UTF-8 2>/dev/null || skip "there is no locale to make"
    [ "$(LC_ALL=de_DE.UTF-8 locale decimal_point)" = , ]
    mesh cube 0.3 >a.obj
    must vg-encode --no-provenance a.obj -o c.vgs
    must vg-decode --f64 c.vgs -o c.obj
    must vg-diff c.vgs a.obj -o c.txt
    LC_ALL=de_DE.UTF-8 must vg-encode --no-provenance --fps 12.5 a.obj -o timed.vgs
    LC_ALL=de_DE.UTF-8 must vg-encode --no-provenance a.obj -o d.vgs
    LC_ALL=de_DE.UTF-8 must vg-decode --f64 d.vgs -o d.obj
    LC_ALL=de_DE.UTF-8 must vg-diff d.vgs a.obj -o d.txt
    same_file c.vgs d.vgs
    same_file c.obj d.obj
    must diff <(sed s/c.vgs/d.vgs/ c.txt) d.txt
}

# ---- what comes out -----------------------------------------------------------------------------------------------------

@test "frame names become file names; a pattern numbers the frames" {
    mkdir in
    for name in happy sad very-sad; do mesh tetra 0.1 >in/$name.obj; done
    pipe "vg-encode in | vg-decode -o out/"
    must ls out
    [ "$output" = $'happy.obj\nsad.obj\nvery-sad.obj' ]
    pipe "vg-encode in | vg-decode -o out.zip"
    must python3 -m zipfile -l out.zip
    shows happy.obj sad.obj very-sad.obj
    pipe "vg-encode in | vg-decode -o 'n-%04d.obj'"
    nothing_but in out out.zip n-0000.obj n-0001.obj n-0002.obj
    must vg-diff -t 1e-7 in out
    must vg-diff -t 1e-7 in out.zip
    must vg-diff -t 1e-7 in 'n-*.obj'
}

@test "'-' is standard output, and an output may be a device or a pipe" {
    mesh tetra >a.obj
    pipe "vg-encode a.obj -o - | vg-solve - -o - | vg-decode -o - --format obj >b.obj"
    must vg-diff -t 1e-7 a.obj b.obj
    must vg-encode a.obj -o /dev/null
    mkfifo fifo
    cat fifo >copy.vgs &
    must vg-encode a.obj -o fifo
    wait $!
    must vg-info --check copy.vgs
    [ -p fifo ]
}

@test "a stream is not written to a terminal" {
    needs_terminal
    mesh tetra >a.obj
    must python3 - <<'END'
import os, pty, sys
pid, fd = pty.fork()
if pid == 0:
    os.execvp("vg-encode", ["vg-encode", "a.obj"])
said = b""
try:
    while part := os.read(fd, 4096):
        said += part
except OSError:  # how Linux says that the other side of a terminal is closed
    pass
_, status = os.waitpid(pid, 0)
assert os.WEXITSTATUS(status) == 2 and b"terminal" in said and b"\x89VGS" not in said, (status, said)
END
}

@test "a name of an output that nobody can write is refused before any work" {
    mesh tetra >a.obj
    must_fail 2 vg-decode a.obj -o out.xyz
    says out.xyz
    must_fail 2 vg-decode a.obj
    says "-o"
    must_fail 2 vg-encode a.obj -o out.obj
    must_fail 4 vg-encode a.obj -o nowhere/out.vgs
    says nowhere
    mkdir d
    must_fail 4 vg-encode a.obj -o d
    must_fail 4 vg-info a.obj -o d
    nothing_but a.obj d
}

# ---- what goes wrong ------------------------------------------------------------------------------------------------------

@test "a missing file: status 4, and its name" {
    mesh tetra >a.obj
    for program in vg-encode vg-solve vg-deform vg-info; do
        must_fail 4 $program nowhere.vgs -o out
        says "$program: " nowhere.vgs "No such file"
        one_line
    done
    must_fail 4 vg-decode nowhere.vgs -o out.obj
    says nowhere.vgs
    must_fail 4 vg-view nowhere.vgs -o out.png
    says nowhere.vgs
    must_fail 4 vg-diff a.obj nowhere.obj
    says nowhere.obj
    must_fail 4 vg-deform --onto nowhere.obj a.obj -o out
    says nowhere.obj
    must_fail 4 vg-encode --reference nowhere.obj a.obj -o out
    says nowhere.obj
    must_fail 4 vg-encode 'no*.obj' -o out
    says 'no*.obj'
    nothing_but a.obj
}

@test "wrong usage: status 2, the program's name, and a word on what would be right" {
    mesh tetra >a.obj
    for program in $(each_program); do
        must_fail 2 "$program" --no-such-option </dev/null
        says "$program: " "no-such-option"
        must_fail 2 "$program" --output </dev/null
        says "output"
    done
    must_fail 2 vg-solve a.obj a.obj
    must_fail 2 vg-solve -j 0 a.obj
    must_fail 2 vg-solve -j 2x a.obj
    must_fail 2 vg-encode --faces some a.obj -o out.vgs
    must_fail 2 vg-encode --anchor 4 a.obj -o out.vgs
    must_fail 2 vg-encode --anchor 1, a.obj -o out.vgs
    must_fail 2 vg-encode --fps nan a.obj -o out.vgs
    must_fail 2 vg-deform --root 4 --onto a.obj a.obj -o out.vgs
    must_fail 2 vg-diff -t x a.obj a.obj
    must_fail 2 vg-diff a.obj
    nothing_but a.obj
}

@test "input that is no mesh names the file: text, binary, an empty directory, an empty file" {
    echo "hello" >text.obj
    head -c 300 /dev/zero >zeros
    mkdir empty
    : >nothing.obj
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 nan\nf 1 2 3\n' >nan.obj
    printf 'v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n' >index.obj
    for name in text.obj zeros empty nothing.obj nan.obj index.obj; do
        must_fail 3 vg-encode $name -o out.vgs
        says "vg-encode: " "$name"
        one_line
        [ ! -e out.vgs ]
    done
}

@test "input without end that is nothing at all is refused at its start, not after it has filled the disk" {
    for device in /dev/zero /dev/urandom; do
        must_fail 3 timeout 300 vg-info $device
        says "cannot tell what '$device' is"
        must_fail 3 timeout 300 bash -c "vg-encode <$device -o out.vgs"
        says "cannot tell what 'standard input' is"
    done
    must_fail 3 timeout 300 bash -c 'yes | vg-decode -o out.zip'
    must_fail 3 timeout 300 bash -c 'yes | vg-deform --onto /dev/stdin "$GOLDEN/smallest.vgs" -o out.vgs'
    nothing_but
    poses cube 2
    for format in v7 ustar pax; do # the first of these has no magic number
        pipe "tar --format=$format -cf - pose1.obj pose2.obj | vg-info"
        shows "2: 'pose1' to 'pose2'"
    done
}

@test "poses that do not fit one another: which, and what differs" {
    mesh cube >a1.obj
    mesh tetra >a2.obj
    sed 's/^f 1 4 3 2/f 4 3 2 1/' a1.obj >a3.obj
    sed '$d' a1.obj >a4.obj
    must_fail 3 vg-encode a1.obj a2.obj -o out.vgs
    says a2.obj "4 vertices" 8
    must_fail 3 vg-encode a1.obj a3.obj -o out.vgs
    says a3.obj "face 0"
    must_fail 3 vg-encode a1.obj a4.obj -o out.vgs
    says a4.obj "5 faces" 6
    python3 -m zipfile -c a.zip a1.obj a2.obj
    must_fail 3 vg-encode a.zip -o out.vgs
    says a.zip a2.obj
    nothing_but a1.obj a2.obj a3.obj a4.obj a.zip
}

@test "a program that is killed: the ones behind it fail with 3 and leave nothing" {
    poses cube 9
    must vg-encode --vectors pose*.obj -o all.vgs
    rm pose*.obj
    for bytes in 10 400 1500; do
        pipe_fail 3 "{ head -c $bytes all.vgs; } | vg-solve -o out.vgs"
        says "vg-solve: " "standard input"
        pipe_fail 3 "{ head -c $bytes all.vgs; } | vg-solve | vg-decode -o out.zip"
        says "vg-solve: " "vg-decode: "
        pipe_fail 3 "{ head -c $bytes all.vgs; } | vg-solve | vg-decode -o 'out-%d.obj'"
        pipe_fail 3 "{ head -c $bytes all.vgs; } | vg-solve | vg-decode -o out/"
    done
    mkfifo fifo
    vg-solve fifo -o out.vgs 2>message &
    reader=$!
    # a program in the middle of its work, killed
    sh -c 'exec >fifo; head -c 700 all.vgs; kill -9 $$' || true
    status=0
    wait $reader || status=$?
    [ "$status" = 3 ]
    nothing_but all.vgs fifo message
}

@test "the status that a pipe's first failure had is told by all behind it" {
    vg-encode --vectors "$DATA/horse-run.tar.xz" -o v.vgs
    pipe_fail 3 'vg-solve --planar --planar-weights 1e-13,1 v.vgs | vg-encode | vg-encode --f32 | vg-info --check'
    reason="is not planar yet after 1000 steps: choose --planar-weights that are less far apart"
    [ "$(grep -c "standard input' was cut short: vg-solve failed with status 1: .*$reason" <<<"$stderr")" = 3 ] || fail "$stderr"
}

@test "a failure leaves the old file as it was, and nothing beside it" {
    mesh cube >a1.obj
    mesh tetra >a2.obj
    for name in out.vgs out.obj out.zip; do echo "the old one" >$name; done
    must_fail 3 vg-encode a1.obj a2.obj -o out.vgs
    pipe_fail 3 "vg-encode a1.obj a2.obj | vg-decode -o out.obj"
    pipe_fail 3 "vg-encode a1.obj a2.obj | vg-decode -o out.zip"
    must_fail 3 vg-info "$CORPUS/reject/no-end.vgs" -o out.vgs
    for name in out.vgs out.obj out.zip; do [ "$(cat $name)" = "the old one" ]; done
    nothing_but a1.obj a2.obj out.obj out.vgs out.zip
}

@test "an input may be its own output" {
    poses tetra 2
    must vg-encode --vectors pose1.obj pose2.obj -o a.vgs
    must vg-encode a.vgs -o a.vgs
    must vg-solve a.vgs -o a.vgs
    must vg-info --check a.vgs
    must frame_names a.vgs
    [ "$output" = $'pose1\npose2' ]
}

@test "a full device: status 4, whoever writes" {
    poses cube 9
    must vg-encode --vectors pose*.obj -o all.vgs
    for command in 'vg-encode all.vgs' 'vg-solve all.vgs' 'vg-deform all.vgs' 'vg-info all.vgs' 'vg-diff pose1.obj pose1.obj' \
        'vg-info --json all.vgs' 'vg-solve -h' 'vg-solve -V'; do
        must_fail 4 bash -c "$command >/dev/full"
        says "${command%% *}: " "No space left"
    done
    must_fail 4 vg-encode all.vgs -o /dev/full
    must_fail 4 bash -c "vg-decode pose1.obj -o - --format obj >/dev/full"
    says "vg-decode: "
    must_fail 4 bash -c "vg-view pose1.obj >/dev/full"
    says "vg-view: "
}

@test "a full disk: status 4, and no part of a file under its name" {
    must vg-encode "$DATA/horse-run.tar.xz" -o all.vgs
    mkdir out
    for command in 'vg-encode all.vgs -o out/a.vgs' 'vg-decode all.vgs -o out/a.zip' "vg-decode all.vgs -o 'out/a-%d.obj'" \
        'vg-view all.vgs -o out/a.png'; do
        must_fail 4 bash -c "ulimit -f 1; $command" # a file may have 1 KiB: enough for the message only
        says "${command%% *}: "
        must find out -mindepth 1
        [ -z "$output" ]
    done
}

@test "a closed standard output: status 4" {
    mesh tetra >a.obj
    for command in 'vg-encode a.obj' 'vg-solve a.obj' 'vg-info a.obj' 'vg-diff a.obj a.obj' 'vg-solve -h'; do
        must_fail 4 bash -c "$command >&-"
        says "${command%% *}: "
    done
    must bash -c 'vg-encode a.obj -o out.vgs >&- <&-'
    must vg-info --check out.vgs
}

@test "a closed standard input: status 4; a closed standard error changes nothing" {
    mesh tetra >a.obj
    must_fail 4 bash -c 'vg-encode -o out.vgs <&-'
    must bash -c 'vg-encode a.obj -o out.vgs 2>&-'
    must vg-info --check out.vgs
    capture bash -c 'vg-encode nowhere.obj -o x.vgs 2>&-'
    [ "$status" = 4 ]
}

@test "when the reader has gone, the writer ends by SIGPIPE, even if a parent ignores it" {
    many=()
    for ((i = 0; i < 30; i++)); do many+=("$DATA/horse-run.tar.xz"); done
    must bash -c 'vg-encode "$@" | head -c 10 >/dev/null; [ "${PIPESTATUS[0]}" = 141 ]' bash "${many[@]}"
    must bash -c 'trap "" PIPE; vg-encode "$@" | head -c 10 >/dev/null; [ "${PIPESTATUS[0]}" = 141 ]' bash "${many[@]}"
}

@test "filters read to the end, so that upstream is not killed" {
    poses cube 3
    pipe "vg-encode pose*.obj | vg-info"
    pipe "vg-encode pose*.obj | vg-info --json"
    pipe "vg-encode pose*.obj | vg-view --frames 1 -o a.png"
    pipe "vg-encode pose*.obj | vg-deform --onto pose1.obj >/dev/null"
}

@test "control characters of the input do not reach the terminal" {
    printf 'v 0 0 0\nv 1 0 0\nf 1 \033]0;owned\007 2\n' >a.obj
    must_fail 3 vg-encode a.obj -o out.vgs
    says "not '?]0;owned?'"
    [[ $stderr != *$'\033'* ]]
    mesh tetra >$'b\033[31m.obj'
    must vg-encode $'b\033[31m.obj' -o b.vgs
    must vg-info b.vgs
    [[ $output != *$'\033'* ]]
}

# ---- ends that come early, and sequences that do not end ----------------------------------------------------------------

@test "any stage killed at any time: all others fail, soon, and no file is left under its name" {
    py <<'END'
import os, signal, subprocess, time
import make_corpus

frames = [make_corpus.pose(f"p{i}", make_corpus.BENT[:4] if i % 2 else make_corpus.POINTS[:4]) for i in range(3000)]
records = make_corpus.records_of(make_corpus.content(frames=frames))  # no END: there is always more
head, more = make_corpus.assemble(records[:-len(frames)]), b"".join(r.bytes() for r in records[-len(frames):])
with open("pose1.obj", "w") as f:
    f.writelines("v %g %g %g\n" % tuple(point) for point in make_corpus.POINTS[:4])
    f.write("f 1 2 3\nf 1 3 4\n")

def start(commands):
    """A pipe; its input stays open, so that no stage ends by itself before it is told."""
    before, stages = subprocess.PIPE, []
    for i, c in enumerate(commands):
        last = i + 1 == len(commands)
        stages.append(subprocess.Popen(c, stdin=before, stdout=None if last else subprocess.PIPE, stderr=subprocess.PIPE))
        if i:
            before.close()
        before = stages[-1].stdout
    return stages

COMMANDS = [["vg-encode", "--vectors"], ["vg-deform", "--onto", "pose1.obj"], ["vg-solve"],
            ["vg-poisson", "--first", "pose1.obj"]]
here = sorted(os.listdir("."))
for out in (["vg-decode", "-q", "-o", "out.zip"], ["vg-decode", "-q", "-o", "out-%d.obj"], ["vg-decode", "-q", "-o", "out/"],
            ["vg-view", "-o", "out.html"], ["vg-info", "-o", "out.txt"], ["vg-encode", "-o", "out.vgs"]):
    for victim in range(len(COMMANDS) + 1):
        for number in (signal.SIGKILL, signal.SIGTERM):
            stages = start(COMMANDS + [out])
            try:
                stages[0].stdin.write(head + more[:len(more) * (victim + 1) // 7])
                stages[0].stdin.flush()
                time.sleep(0.02 * victim)
                stages[victim].send_signal(number)
                stages[victim].wait()
                stages[0].stdin.write(more[len(more) * (victim + 1) // 7:])
                while True:  # a writer that nobody reads from any more is told so when it writes
                    stages[0].stdin.write(more)
            except BrokenPipeError:
                pass
            began = time.monotonic()
            for i, stage in enumerate(stages):
                said = stage.stderr.read().decode()
                status = stage.wait(timeout=20)
                want = (-number,) if i == victim else (-signal.SIGPIPE,) if i < victim else (3,)
                assert status in want, (out, victim, number, i, status, said)
                assert i <= victim or (said.startswith("vg-") and said.count("\n") == 1), (out, victim, i, said)
                try:
                    stage.stdin and stage.stdin.close()
                except BrokenPipeError:
                    pass
            assert time.monotonic() - began < 10, (out, victim)
            left = sorted(os.listdir("."))
            if number == signal.SIGKILL and victim == len(COMMANDS):  # who is killed like this cannot clean up
                for name in set(left) - set(here):
                    assert name.startswith(".") or name == "out", left
                    os.rmdir(name) if name == "out" and not os.listdir(name) else None
                for name in os.listdir("."):
                    if name.startswith(".") and name not in here:
                        os.remove(name)
                if os.path.isdir("out"):
                    assert all(name.startswith(".") for name in os.listdir("out")), os.listdir("out")
                    subprocess.run(["rm", "-r", "out"], check=True)
                left = sorted(os.listdir("."))
            assert left == here, (out, victim, number, left, os.path.isdir("out") and os.listdir("out"))
END
}

@test "a disk that is full at any byte: status 4, and nothing under the final name" {
    poses cube 3
    must vg-encode --vectors pose*.obj -o v.vgs
    must vg-encode pose*.obj -o p.vgs
    must vg-register -q pose1.obj pose2.obj --markers <(printf '0 0\n1 1\n3 3\n4 4\n') -o c.vgs
    py <<'END'
import os, resource, subprocess
COMMANDS = ["vg-encode p.vgs -o out.vgs", "vg-solve v.vgs -o out.vgs", "vg-deform p.vgs -o out.vgs",
            "vg-poisson --first pose2.obj p.vgs -o out.vgs", "vg-smooth p.vgs -o out.vgs", "vg-segment -k 2 p.vgs -o out.vgs",
            "vg-info p.vgs -o out.txt", "vg-diff p.vgs p.vgs -o out.txt", "vg-view p.vgs -o out.png",
            "vg-view p.vgs -o out.html", "vg-decode -q p.vgs -o out.zip", "vg-decode -q p.vgs -o out.tar.gz",
            "vg-decode -q p.vgs -o out.npz", "vg-decode -q p.vgs -o out.npy", "vg-decode -q p.vgs -o out.glb",
            "vg-decode -q p.vgs -o out.gltf", "vg-decode -q p.vgs -o out.usda", "vg-decode -q --no-mesh p.vgs -o out.pc2",
            "vg-decode -q p.vgs -o out.mdd", "vg-decode -q p.vgs -o out-%d.obj"]
here = set(os.listdir("."))
for command in COMMANDS:
    words = command.split()
    subprocess.run(words, check=True, capture_output=True)
    made = set(os.listdir(".")) - here
    size = max(os.path.getsize(name) for name in made)
    for name in made:
        os.remove(name)
    for limit in sorted({0, 1, 7, 16, 100, size // 3, size // 2, size - 8, size - 1} & set(range(size))):
        run = subprocess.run(words, capture_output=True,
                             preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit)))
        said = run.stderr.decode()
        assert run.returncode == 4, (command, limit, size, run.returncode, said)
        assert said.startswith(words[0] + ": ") and said.count("\n") == 1, (command, limit, said)
        assert set(os.listdir(".")) == here, (command, limit, set(os.listdir(".")) - here)
END
}

@test "100,000 frames through the whole pipe take no more memory than 1,000" {
    [ -n "${VG_LONG:-}" ] || skip "takes a minute: set VG_LONG=1"
    poses cube 4
    must vg-encode --no-provenance pose*.obj -o four.vgs
    for frames in 1000 100000; do
        many=()
        for ((i = 0; i < frames; i += 4)); do many+=(four.vgs); done
        must vg-encode --no-provenance "${many[@]}" -o many.vgs
        for stage in 'vg-encode --vectors' 'vg-deform --onto pose2.obj' vg-solve 'vg-poisson --first pose2.obj' \
            'vg-decode -q --no-mesh --format pc2 -o out.pc2'; do
            # shellcheck disable=SC2086 # words
            python3 -c '
import resource, subprocess, sys
subprocess.run(sys.argv[2:], check=True, stdin=open("many.vgs"), stdout=open("next.vgs", "w"))
print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)' "$stage" $stage >>kilobytes.$frames
            [ ! -s next.vgs ] || mv next.vgs many.vgs
        done
    done
    must paste kilobytes.1000 kilobytes.100000
    echo "$output" | awk '$2 > $1 + 4096 { exit 1 }' || fail "kB at 1,000 and 100,000 frames:" "$output"
}
