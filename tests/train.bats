#!/usr/bin/env bats
# vg-train and vg-generate: the same bytes again, resumed training, keys, other meshes, damage.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck disable=SC2086 # options in variables are words
load lib.bash
bats_require_minimum_version 1.5.0

small="--no-provenance -q --hold-at end --layers 1 --hidden 8 --batch 5 --frames 12 --iterations 24"

setup_file() {
    cd "$BATS_FILE_TMPDIR" || return 1
    vg-encode --reference "$DATA/horse.rest.obj" "$DATA/horse-run.tar.xz" -o horse.vgs
    vg-train $small horse.vgs -o horse.net
}

horse() { echo "$BATS_FILE_TMPDIR/horse.$1"; }

@test "the same seed gives the same bytes with one thread and with more, of every model; another seed others" {
    for model in auto pca fc conv; do
        must vg-train $small --model $model --iterations 3 -j 1 "$(horse vgs)" -o one.net
        must vg-train $small --model $model --iterations 3 -j 3 "$(horse vgs)" -o three.net
        must cmp one.net three.net
    done
    must vg-train $small --model pca --iterations 3 --seed 2 "$(horse vgs)" -o other.net
    must vg-train $small --model pca --iterations 3 "$(horse vgs)" -o first.net
    if cmp -s first.net other.net; then fail "another seed learned the same"; fi
}

@test "training that is resumed ends as training that was not interrupted, to the last bit" {
    must vg-train $small --model pca --checkpoint half.net --every 17 --log log.tsv "$(horse vgs)" -o whole.net
    must vg-train $small --model pca --resume half.net "$(horse vgs)" -o resumed.net
    must cmp whole.net resumed.net
    [ "$(head -1 log.tsv)" = $'phase\titeration\tloss\tgradient\tvalidation' ]
    [ "$(wc -l <log.tsv)" = 25 ]
    cp log.tsv long.tsv
    must vg-train $small --model pca --resume half.net --log long.tsv "$(horse vgs)" -o resumed.net
    must cmp log.tsv long.tsv
    must_fail 3 vg-train $small --model pca --seed 9 --resume half.net "$(horse vgs)" -o no.net
    says "cannot resume from 'half.net': it was trained with other options"
    must_fail 3 vg-train $small --model pca --resume whole.net "$(horse vgs)" -o no.net
    says "its training has ended"
    [ ! -e no.net ]
}

@test "states of a large mesh that are computed again: the same bytes with any number of threads, and resumed" {
    large="--no-provenance -q --hold-at end --layers 1 --hidden 4 --batch 5 --frames 32 --iterations 3 --model conv"
    wide=75 # states of eight chains of 32 frames take more than 64 MiB
    [ $((wide * wide * 12 * 32 * 32)) -gt $((64 << 20)) ]
    for t in {100..150}; do
        awk -v n=$wide -v t=$t 'BEGIN {
            for (i = 0; i < n; i++) for (k = 0; k < n; k++)
                printf "v %.5f %.5f %.5f\n", i / n, k / n, 0.2 * sin(5 * i / n + t / 3) * cos(4 * k / n - t / 7)
            for (i = 1; i < n; i++) for (k = 1; k < n; k++) {
                at = n * (i - 1) + k
                printf "f %d %d %d %d\n", at, at + n, at + n + 1, at + 1
            }
        }' >pose.$t.obj
    done
    must vg-encode -q pose.*.obj -o large.vgs
    must vg-train $large -j 1 --checkpoint half.net --every 2 large.vgs -o one.net
    must vg-train $large -j 2 --resume half.net large.vgs -o resumed.net
    must cmp one.net resumed.net
}

@test "keys go out as they came in, with poses between: by the mean of both ways, by the best found, by ways that meet" {
    must vg-encode --reference "$DATA/horse.rest.obj" --take 1,9,15 "$DATA/horse-run.tar.xz" -o keys.vgs
    for options in "" "--optimise" "--merge 5%" "--seed 7" "--root stay"; do
        must vg-generate -q --no-provenance -j 1 --between 4 $options "$(horse net)" keys.vgs -o between.vgs
        must vg-generate -q --no-provenance -j 3 --between 4 $options "$(horse net)" keys.vgs -o again.vgs
        must cmp between.vgs again.vgs
        py <<'END'
from read_stream import read_stream
keys, all = read_stream("keys.vgs").frames, read_stream("between.vgs").frames
assert len(all) == 11, len(all)
for i, key in enumerate(keys):
    assert list(all[5 * i].values) == list(key.values)
END
        cp between.vgs "way$options.vgs"
    done
    cmp -s way.vgs "way--seed 7.vgs" && fail "a seed changed nothing"
    must_fail 3 vg-generate --between 4 "$(horse net)" "$DATA/horse.rest.obj" -o no.vgs
    says "--between needs at least two keys, the input has 1"
    run vg-generate -v --between 4 --optimise "$(horse net)" keys.vgs -o no.vgs
    grep -q "to key 3: after [0-9]* rounds of optimisation the run .*missed it by" <<<"$output" || fail "$output"
    must_fail 2 vg-generate --optimise "$(horse net)" keys.vgs -o no2.vgs
    must_fail 2 vg-generate --between 4 --merge 5% --optimise "$(horse net)" keys.vgs -o no2.vgs
    must_fail 2 vg-generate --between 4 --merge 200% "$(horse net)" keys.vgs -o no2.vgs
    says "needs a share of the training range such as 5%"
}

@test "a search ends nearer to the key than the plain way" {
    must vg-encode --reference "$DATA/horse.rest.obj" --take 1,12 "$DATA/horse-run.tar.xz" -o keys.vgs
    must vg-train $small --direction forward --model pca --iterations 60 "$(horse vgs)" -o forward.net
    miss() { vg-generate -v --between 10 "$@" forward.net keys.vgs -o way.vgs 2>&1 | sed -n 's/.*missed it by \([0-9.e+-]*\) %.*/\1/p'; }
    plain=$(miss)
    best=$(miss --optimise)
    awk -v a="$best" -v b="$plain" 'BEGIN { exit !(a > 0 && b > 0 && a < b) }' || fail "miss $best after the search, $plain before"
}

@test "ways that meet take chains in both directions" {
    must vg-encode --reference "$DATA/horse.rest.obj" --take 1,12 "$DATA/horse-run.tar.xz" -o keys.vgs
    must vg-train $small --direction forward "$(horse vgs)" -o forward.net
    must_fail 3 vg-generate --between 10 --merge 5% forward.net keys.vgs -o no.vgs
    says "the network runs forward only"
}

@test "a cycle leads back to its first pose: between keys, and behind given poses" {
    must vg-encode --reference "$DATA/horse.rest.obj" --take 1,9 "$DATA/horse-run.tar.xz" -o keys.vgs
    must vg-generate -q --between 6 --loop "$(horse net)" keys.vgs -o cycle.vgs
    must vg-generate -q --frames 6 --loop "$(horse net)" keys.vgs -o round.vgs
    py <<'END'
from read_stream import read_stream
keys, cycle = read_stream("keys.vgs").frames, read_stream("cycle.vgs").frames
assert len(cycle) == 14 and list(cycle[0].values) == list(keys[0].values) and list(cycle[7].values) == list(keys[1].values)
around = read_stream("round.vgs").frames
assert len(around) == 8 and list(around[1].values) == list(keys[1].values)
def centred(f):
    v = f.values
    m = [sum(v[k::3]) / (len(v) // 3) for k in range(3)]
    return [x - m[i % 3] for i, x in enumerate(v)]
def apart(a, b):
    return max(abs(x - y) for x, y in zip(centred(a), centred(b)))
steps = [apart(a, b) for a, b in zip(cycle[7:], cycle[8:])]
# the step that closes the cycle is one like the others
assert apart(cycle[-1], cycle[0]) < 2 * max(steps), (apart(cycle[-1], cycle[0]), steps)
END
}

@test "any number of frames from one pose or from the first few; the same with any number of threads" {
    must vg-generate -q --no-provenance --frames 70 -j 1 "$(horse net)" "$DATA/horse.rest.obj" -o one.vgs
    must vg-generate -q --no-provenance --frames 70 -j 3 "$(horse net)" "$DATA/horse.rest.obj" -o three.vgs
    must cmp one.vgs three.vgs
    must vg-info --check one.vgs
    must vg-generate -q --no-provenance --frames 70 --diversity 0.3 "$(horse net)" "$DATA/horse.rest.obj" -o other.vgs
    if cmp -s one.vgs other.vgs; then fail "random states changed nothing"; fi
    must vg-generate -q --given 3 --frames 5 "$(horse net)" "$(horse vgs)" -o given.vgs
    py <<END
from read_stream import read_stream
came, out = read_stream("$(horse vgs)").frames, read_stream("given.vgs").frames
assert len(out) == 8 and [f.name for f in out[3:]] == ["frame%d" % i for i in range(4, 9)]
for a, b in zip(came[:3], out):
    assert a.name == b.name and list(a.values) == list(b.values)
END
    must_fail 3 vg-generate --given 300 "$(horse net)" "$(horse vgs)" -o no.vgs
    says "--given 300 needs as many poses, the input has"
    must_fail 2 vg-generate --given 3 --between 3 "$(horse net)" "$(horse vgs)" -o no.vgs
}

# Poses of one number, the length of a sheet, which grows from 1 to 1.6 and at the end would grow on.
@test "after 24 frames a run keeps to the range of the training data, whatever its network would do" {
    for t in {10..69}; do
        awk -v t=$((t - 10)) 'BEGIN {
            for (i = 0; i < 4; i++) for (k = 0; k < 4; k++) printf "v %.9f %.9f 0\n", i * (1 + t / 59 * 0.6) / 3, k / 3
            for (i = 0; i < 3; i++) for (k = 1; k < 4; k++) printf "f %d %d %d %d\n", 4 * i + k, 4 * i + k + 4, 4 * i + k + 5, 4 * i + k + 1
        }' >grow.$t.obj
    done
    must vg-encode -q grow.*.obj -o grow.vgs
    must vg-train $small --hold 0 grow.vgs -o grow.net
    for first in 50 69; do
        must vg-generate -q --frames 80 grow.net grow.$first.obj -o run.vgs
        py <<'END'
from read_stream import read_stream
length = [f.values[3 * 12] - f.values[0] for f in read_stream("run.vgs").frames]
assert len(length) == 81
assert max(length[1:25]) > 1.62, max(length) # there is something to stop
# the network holds its range in binary32: half a unit in the last place of 1.6 is 6e-8
assert 1 - 6e-8 <= min(length[25:]) and max(length[25:]) <= 1.6 + 6e-8, (min(length[25:]), max(length[25:]) - 1.6)
END
    done
}

@test "a network of every other frame keeps the speed of the motion, and meets its keys" {
    must vg-train $small --model pca --iterations 60 --frames 6 --given 1-3 --hold 0 --step 2 "$(horse vgs)" -o step.net
    must vg-generate -q --given 6 --frames 4 step.net "$(horse vgs)" -o on.vgs
    must vg-encode --reference "$DATA/horse.rest.obj" --take 1,8,15 "$DATA/horse-run.tar.xz" -o keys.vgs
    must vg-generate -q --between 6 step.net keys.vgs -o way.vgs
    py <<'END'
from read_stream import read_stream
v = [list(f.values) for f in read_stream("on.vgs").frames]
assert len(v) == 10
def apart(a, b):
    return max(abs(x - y) for x, y in zip(a, b))
# frames of the network are 7 and 9; 6 and 8 are the poses between, close to the middle of their neighbours
for i in (6, 8):
    middle = [(x + y) / 2 for x, y in zip(v[i - 1], v[i + 1])]
    assert apart(v[i], middle) < 0.2 * apart(v[i - 1], v[i + 1]), i
    assert 0.3 < apart(v[i - 1], v[i]) / apart(v[i], v[i + 1]) < 3, i
way, keys = read_stream("way.vgs").frames, read_stream("keys.vgs").frames
assert len(way) == 15
for i, key in enumerate(keys):
    assert list(way[7 * i].values) == list(key.values)
END
}

@test "a frame is out before the next is computed: a run without end is read from as it comes" {
    run timeout 20 bash -c "vg-generate -q --frames 1000000000 '$(horse net)' '$DATA/horse.rest.obj' | head -c 300000 | wc -c"
    [ "$output" = 300000 ]
}

@test "a network is refused on another mesh, what is no network, and a damaged one" {
    must_fail 3 vg-generate "$(horse net)" "$DATA/trex.rest.obj" -o no.vgs
    says "has 912 vertices where the network has 347"
    must_fail 3 vg-generate "$(horse vgs)" "$DATA/horse.rest.obj" -o no.vgs
    says "holds no network: make one with vg-train"
    head -c 20000 "$(horse net)" >cut.net
    must_fail 3 vg-generate cut.net "$DATA/horse.rest.obj" -o no.vgs
    [ ! -e no.vgs ]
}

@test "vg-info says what a network is; a checkpoint is not finished" {
    must vg-train $small --model pca --checkpoint half.net --every 7 "$(horse vgs)" -o whole.net
    must vg-info whole.net
    shows "network " "pca" "their digest"
    must bash -c 'for n in whole half; do vg-info --json $n.net >$n.json; done'
    py <<'END'
import json
whole, half = (json.load(open(n + ".json"))["network"] for n in ("whole", "half"))
assert whole["finished"] and not half["finished"]
assert (whole["layers"], whole["hidden"], whole["width"]) == (1, 8, 12)
k, h = whole["coordinates"], 8
assert whole["parameters"] == 4 * h * (k + h + 1) + h * k + k, whole["parameters"]  # gates, output, biases
assert whole["training"] == half["training"] and len(whole["training"]) == 16
END
}

@test "the curves of a training are in the network, the numbers of its log, also when it was resumed; vg-view draws them" {
    must vg-encode "$(horse vgs)" "$(horse vgs)" -o twice.vgs
    must vg-train $small --iterations 60 --checkpoint half.net --every 50 --log log.tsv twice.vgs -o whole.net
    must vg-train $small --iterations 60 --resume half.net twice.vgs -o resumed.net
    must cmp whole.net resumed.net
    py <<'END'
from read_stream import read_stream
n = read_stream("whole.net").network
rows = [line.split("\t") for line in open("log.tsv").read().splitlines()[1:]]
c = n.counts
assert len(rows) == c["curve_length"] == len(n.curve) // 3, (len(rows), c)
assert sum(r[0] == "0" for r in rows) == c["curve_block"] == 60
for i, (phase, iteration, loss, gradient, validation) in enumerate(rows):
    x, g, v = n.curve[3 * i:3 * i + 3]
    assert abs(x - float(loss)) <= 1e-5 * x and abs(g - float(gradient)) <= 1e-5 * g, (i, x, g)
    # measured behind each 20th iteration of the first phase
    assert (v == -1) == (validation == "") == (phase == "1" or int(iteration) % 20 != 0), (i, v, validation)
    assert v == -1 or abs(v - float(validation)) <= 1e-5 * v, (i, v, validation)
assert n.numbers[1] > 0
END
    must vg-view whole.net -o curves.svg
    must vg-view whole.net -o curves.png
    must vg-view --format svg whole.net
    [ "$output" = "$(cat curves.svg)" ]
    for text in "whole.net: what it learns from (auto, seed 1)" "all frames" "validation block: least after"; do
        grep -qF "$text" curves.svg || fail "no '$text'"
    done
    py <<'END'
import xml.etree.ElementTree as x
lines = [e.get("d") for e in x.parse("curves.svg").iter() if e.tag.endswith("path")]
assert len(lines) > 60, len(lines)
assert open("curves.png", "rb").read(4) == b"\x89PNG"
END
    must vg-view whole.net -o mesh.html
    must_fail 2 vg-view "$(horse vgs)" -o no.svg
    says "an SVG is made of the curves of a network"
    must_fail 2 vg-view --zoom 2 whole.net -o no.png
    says "option '--zoom' applies to a sequence: of a network its curves are drawn"
    [ ! -e no.svg ] && [ ! -e no.png ]
}

@test "frames that are held out are not learned from, whatever the step" {
    must vg-encode "$(horse vgs)" --take 6 -o six.vgs
    must vg-encode "$(horse vgs)" --take 7 -o seven.vgs
    must vg-encode "$(horse vgs)" --take 8 -o eight.vgs
    must vg-encode "$(horse vgs)" --take 0-5 -o before.vgs
    must vg-encode "$(horse vgs)" --take 9-15 -o behind.vgs
    must vg-encode before.vgs six.vgs seven.vgs eight.vgs behind.vgs -o one.vgs
    must vg-encode before.vgs eight.vgs seven.vgs six.vgs behind.vgs -o two.vgs
    for step in 1 2; do
        for which in one two; do
            must vg-train -q --model pca --layers 1 --hidden 8 --frames 4 --given 1 --iterations 9 --step $step --hold 0.2 --hold-at 6 $which.vgs -o $which.net
        done
        py <<'END'
from read_stream import read_stream
one, two = (read_stream(n + ".net").network for n in ("one", "two"))
assert one.counts["data_digest"] != two.counts["data_digest"]
for name in ("mean", "range", "basis", "parameters"):
    assert getattr(one, name) == getattr(two, name), name
END
    done
}

@test "wrong usage of vg-train" {
    must_fail 2 vg-train --given 8-3 "$(horse vgs)" -o no.net
    must_fail 2 vg-train --given 32 "$(horse vgs)" -o no.net
    must_fail 2 vg-train --loss speed=1 "$(horse vgs)" -o no.net
    says "needs bidirectional=W, kl=W or l2=W"
    must_fail 2 vg-train --every 5 "$(horse vgs)" -o no.net
    must_fail 3 vg-train "$DATA/horse.rest.obj" -o no.net
    says "at least 4 are needed"
}

@test "the block that is held out is where the seed says, at the end, or where it is told to be" {
    held() { vg-train $small --model pca --iterations 1 "$@" "$(horse vgs)" -o held.net; }
    digest() { sha256sum <held.net; }
    must held --hold-at end
    end=$(digest)
    must held --hold-at 1000
    [ "$(digest)" = "$end" ] || fail "a block beyond the end is not the one at the end"
    must held --hold-at 4
    [ "$(digest)" != "$end" ] || fail "--hold-at changed nothing"
    must_fail 2 vg-train $small --hold-at middle "$(horse vgs)" -o held.net
    says "needs the number of a frame or end, not 'middle'"
}

@test "killed at any moment, training leaves a whole checkpoint, from which it goes on" {
    must vg-train $small --model pca --iterations 60 "$(horse vgs)" -o whole.net
    for delay in 0.05 0.1 0.2 0.3; do
        vg-train $small --model pca --iterations 60 --checkpoint kept.net --every 1 "$(horse vgs)" -o killed.net &
        sleep "$delay"
        kill -KILL $! 2>/dev/null || :
        wait $! || :
        if [ -e kept.net ]; then
            must vg-info --check kept.net
            must vg-train $small --model pca --iterations 60 --resume kept.net "$(horse vgs)" -o resumed.net
            must cmp whole.net resumed.net
        fi
    done
    rm -f kept.net
    vg-train $small --iterations 100000 --rate 0.0001 --checkpoint kept.net --every 1 "$(horse vgs)" -o killed.net &
    while [ ! -e kept.net ]; do sleep 0.05; done
    kill -INT $!
    status=0
    wait $! || status=$?
    [ "$status" = 4 ] || fail "ended with status $status"
    must vg-info --check kept.net
    [ ! -e killed2.net ]
}

@test "a full disk and numbers that run away leave what was there" {
    must vg-train $small --model pca --iterations 5 "$(horse vgs)" -o there.net
    cp there.net before.net
    must_fail 4 vg-train $small --model pca --iterations 5 --log /dev/full "$(horse vgs)" -o there.net
    must_fail 3 vg-train $small --model pca --iterations 5 --loss l2=1e38 "$(horse vgs)" -o there.net
    says "training diverges at iteration 0: choose a smaller --rate"
    must_fail 2 vg-train $small --checkpoint there.net "$(horse vgs)" -o there.net
    says "'there.net' would be written twice"
    must cmp there.net before.net
    must bash -c 'vg-encode --take 0-9 "$1" | python3 -c "
import sys, struct
b = bytearray(sys.stdin.buffer.read())
sys.stdout.buffer.write(b[:-40])" >cut.vgs' _ "$(horse vgs)"
    must_fail 3 vg-train $small cut.vgs -o there.net
    must cmp there.net before.net
}

@test "of several processes each runs some of the chains: the same bytes (MPI=1)" {
    ldd "$(command -v vg-train)" | grep -q libmpi || skip "built without MPI=1"
    command -v mpirun >/dev/null || skip "needs mpirun"
    export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
    for model in auto conv; do
        must vg-train $small --batch 13 --model $model --iterations 6 -j 1 "$(horse vgs)" -o one.net
        for n in 2 4; do
            must mpirun -q --oversubscribe -n $n vg-train $small --batch 13 --model $model --iterations 6 -j 1 "$(horse vgs)" -o two.net
            must cmp one.net two.net
        done
    done
}
