#!/usr/bin/env bats
# vg-train and vg-generate: the same bytes again, resumed training, keys, other meshes, damage.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck disable=SC2086 # options in variables are words
load lib.bash
bats_require_minimum_version 1.5.0

small="--no-provenance -q --layers 1 --hidden 8 --batch 5 --frames 12 --iterations 24"

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
    must_fail 3 vg-train $small --model pca --seed 9 --resume half.net "$(horse vgs)" -o no.net
    says "cannot go on from 'half.net': it was trained with other options"
    must_fail 3 vg-train $small --model pca --resume whole.net "$(horse vgs)" -o no.net
    says "its training has ended"
    [ ! -e no.net ]
}

@test "keys go out as they came in, with poses between" {
    must vg-encode --reference "$DATA/horse.rest.obj" --take 1,9,15 "$DATA/horse-run.tar.xz" -o keys.vgs
    must vg-generate --between 4 "$(horse net)" keys.vgs -o between.vgs
    py <<'END'
from read_stream import read_stream
keys, all = read_stream("keys.vgs").frames, read_stream("between.vgs").frames
assert len(all) == 11, len(all)
for i, key in enumerate(keys):
    assert list(all[5 * i].values) == list(key.values)
END
    must_fail 3 vg-generate --between 4 "$(horse net)" "$DATA/horse.rest.obj" -o no.vgs
    says "--between needs at least two keys, the input has 1"
}

@test "any number of frames from one pose; the same with any number of threads" {
    must vg-generate -q --no-provenance --frames 70 -j 1 "$(horse net)" "$DATA/horse.rest.obj" -o one.vgs
    must vg-generate -q --no-provenance --frames 70 -j 3 "$(horse net)" "$DATA/horse.rest.obj" -o three.vgs
    must cmp one.vgs three.vgs
    must vg-info --check one.vgs
    must vg-generate -q --no-provenance --frames 70 --diversity 0.3 "$(horse net)" "$DATA/horse.rest.obj" -o other.vgs
    if cmp -s one.vgs other.vgs; then fail "random states changed nothing"; fi
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

@test "wrong usage of vg-train" {
    must_fail 2 vg-train --given 8-3 "$(horse vgs)" -o no.net
    must_fail 2 vg-train --given 32 "$(horse vgs)" -o no.net
    must_fail 2 vg-train --loss speed=1 "$(horse vgs)" -o no.net
    says "needs bidirectional=W, kl=W or l2=W"
    must_fail 2 vg-train --every 5 "$(horse vgs)" -o no.net
    must_fail 3 vg-train "$DATA/horse.rest.obj" -o no.net
    says "at least 4 are needed"
}
