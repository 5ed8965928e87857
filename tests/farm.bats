#!/usr/bin/env bats
# examples/farm: one command file, run by make, by GNU parallel and by Slurm; shots that fail, that hang and are killed, that are whole.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

FARM=$ROOT/examples/farm

# job: three bodies, two actions of six poses: six shots in the file job; the second action is damaged
job() {
    local scale
    must vg-decode "$DATA/velociraptor.rest.obj" --f64 -o rest.obj
    for scale in 1 1.2 0.7; do
        vg-encode --scale $scale "$DATA/trex.rest.obj" | vg-decode --f64 -o "trex${scale/./_}.obj" || return 1
    done
    must vg-encode --take 0-5 "$DATA/velociraptor-walk.tar.xz" -o walk.vgs
    must vg-encode --take 0-5 "$DATA/velociraptor-run.tar.xz" -o whole.vgs
    head -c 100000 whole.vgs >run.vgs
    must "$FARM/plan" rest.obj "$DATA/velociraptor-trex.markers.txt" out walk.vgs run.vgs -- trex1.obj trex1_2.obj trex0_7.obj
    printf '%s\n' "$output" >job
    [ "$(wc -l <job)" = 6 ]
}

# stall: the next vg-view hangs, as on a node that does not answer, and makes the file hung
stall() {
    mkdir -p bin
    {
        echo '#!/bin/sh'
        echo "if mv '$PWD/stall' '$PWD/hung' 2>/dev/null; then echo \$\$ >'$PWD/hung'; exec sleep 600; fi"
        echo "exec '$BUILD/bin/vg-view' \"\$@\""
    } >bin/vg-view
    chmod +x bin/vg-view
    PATH=$PWD/bin:$PATH
    touch stall
}

# wait_for CONDITION...: a minute or ten, the machine may be busy
wait_for() {
    local i
    for ((i = 0; i < 3000; i++)); do
        ! "$@" || return 0
        sleep 0.2
    done
    fail "this did not come about: $*"
}

all_whole() {
    must "$FARM/report" job
    shows "6 shots: 6 whole" "0 failed, 0 missing"
    [ "$(find out -name '.trex*.*' ! -name '*.lock' | wc -l)" = 0 ] || fail "temporary files: $(ls -A out)"
}

@test "make: what fails is tried again and named, the others go on; a second run does what is left" {
    job
    capture make -s -k -j2 -f "$FARM/Makefile" COMMANDS=job TRIES=2
    [ "$status" = 2 ]
    [ "$(grep -c '^trex1-run: transfer: vg-solve' <<<"$stderr")" = 2 ] # twice tried
    capture "$FARM/report" job
    [ "$status" = 1 ]
    shows "failed      4  trex1-run: transfer: vg-solve:" "cut short" "6 shots: 3 whole" "3 failed, 0 missing"
    must find out -name '*-run.glb'
    [ -z "$output" ]
    must stat -c %Y%i out/trex1-walk.glb out/trex1.pairs.vgs
    before=$output
    cp whole.vgs run.vgs
    must make -s -k -j2 -f "$FARM/Makefile" COMMANDS=job
    all_whole
    must stat -c %Y%i out/trex1-walk.glb out/trex1.pairs.vgs
    [ "$output" = "$before" ]
    # the digests: the result is that of the commands as one would type them; damage is seen, and made good
    vg-encode --reference rest.obj --fps 24 run.vgs | vg-deform --onto trex1.obj --correspondence out/trex1.pairs.vgs |
        vg-solve -q | vg-decode -q -o typed.glb
    same_file typed.glb out/trex1-run.glb
    printf x >>out/trex1-run.glb
    capture "$FARM/report" job
    [ "$status" = 1 ]
    shows "5 whole" "1 missing"
    must make -s -f "$FARM/Makefile" COMMANDS=job
    all_whole
    same_file typed.glb out/trex1-run.glb
    # another input: its shots are made again
    cp whole.vgs walk.vgs
    capture "$FARM/report" job
    shows "3 whole" "3 missing"
}

@test "plan: names keep what tells files apart, and two files of one name are refused" {
    mkdir -p other
    touch rest.obj markers.txt walk.v1.vgs walk.v2.vgs run.tar.xz other/run.zip "a b.obj" other/c.obj c.obj
    must "$FARM/plan" rest.obj markers.txt out walk.v1.vgs walk.v2.vgs run.tar.xz -- "a b.obj" c.obj
    printf '%s\n' "$output" >job
    capture "$FARM/report" job
    [ "$status" = 1 ]
    local name
    for name in 'a b-walk.v1' 'c-walk.v1' 'a b-walk.v2' 'c-walk.v2' 'a b-run' 'c-run'; do shows "$name: not begun"; done
    capture "$FARM/plan" rest.obj markers.txt out run.tar.xz other/run.zip -- c.obj
    [ "$status" = 2 ] && [ -z "$output" ]
    says "two files are called 'run'"
    capture "$FARM/plan" rest.obj markers.txt out run.tar.xz -- c.obj other/c.obj
    [ "$status" = 2 ] && [ -z "$output" ]
    says "two files are called 'c'"
}

@test "GNU parallel: a log of jobs, retries, a task that is killed, and resuming" {
    command -v parallel >/dev/null || skip "GNU parallel is not installed"
    job
    cp whole.vgs run.vgs
    stall
    parallel --will-cite -j2 --joblog log --resume-failed --retries 1 <job 3>&- &
    wait_for test -s hung
    kill -9 "$(cat hung)" # the picture's program, as when memory is short
    wait $! || true
    capture "$FARM/report" job
    [ "$status" = 1 ]
    shows "picture:" "status 137" "5 whole" "1 failed"
    [ "$(awk 'NR > 1 && $7 != 0' log | wc -l)" = 1 ]
    must parallel --will-cite -j2 --joblog log --resume-failed --retries 3 <job
    all_whole
    # with --retries the same in one go
    rm -rf out log hung
    touch stall
    parallel --will-cite -j2 --joblog log --retries 3 <job 3>&- &
    wait_for test -s hung
    kill -9 "$(cat hung)"
    wait $!
    all_whole
}

# start_slurm: one node of two slots, by whoever runs the tests, on ports of its own; skips when it cannot be had
start_slurm() {
    local program port d=$PWD/slurm
    for program in munged slurmctld slurmd sbatch; do
        PATH=$PATH:/usr/sbin
        command -v $program >/dev/null || skip "$program is not installed (Debian: munge, slurmctld, slurmd, slurm-client)"
    done
    [ ${#d} -lt 80 ] || d=$(mktemp -d)
    mkdir -p "$d/state" "$d/spool"
    chmod 755 "$d"
    head -c 32 /dev/urandom >"$d/munge.key"
    chmod 600 "$d/munge.key"
    port=$((20000 + RANDOM % 20000))
    cat >"$d/slurm.conf" <<END
ClusterName=test
SlurmctldHost=$(hostname)(127.0.0.1)
SlurmctldPort=$port
SlurmdPort=$((port + 1))
AuthType=auth/munge
AuthInfo=socket=$d/munge.socket
CryptoType=crypto/munge
SlurmUser=$(id -un)
SlurmdUser=$(id -un)
StateSaveLocation=$d/state
SlurmdSpoolDir=$d/spool
SlurmctldPidFile=$d/slurmctld.pid
SlurmdPidFile=$d/slurmd.pid
SlurmctldLogFile=$d/slurmctld.log
SlurmdLogFile=$d/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_min_interval=100000
ReturnToService=2
SlurmdParameters=config_overrides
NodeName=$(hostname) NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
END
    export SLURM_CONF=$d/slurm.conf
    munged --force --socket="$d/munge.socket" --key-file="$d/munge.key" --pid-file="$d/munged.pid" --log-file="$d/munged.log" \
        --seed-file="$d/munge.seed" 3>&- >/dev/null 2>&1 || skip "munged does not start: $(tail -n 1 "$d/munged.log")"
    daemons=$d
    slurmctld -c 3>&- >/dev/null 2>&1 || skip "slurmctld does not start: $(tail -n 1 "$d/slurmctld.log")"
    slurmd -c 3>&- >/dev/null 2>&1 || skip "slurmd does not start: $(tail -n 1 "$d/slurmd.log")"
    for program in {1..100}; do
        sinfo -h -o %t 2>/dev/null | grep -q idle && return
        sleep 0.2
    done
    skip "Slurm's node does not come up: $(tail -n 1 "$d/slurmd.log")"
}

teardown() {
    local name
    [ -n "${daemons-}" ] || return 0
    for name in slurmd slurmctld munged; do
        [ ! -s "$daemons/$name.pid" ] || kill "$(cat "$daemons/$name.pid")" 2>/dev/null || true
    done
}

@test "Slurm: a job array of the same file; a task that is killed in the middle is run again" {
    start_slurm
    job
    cp whole.vgs run.vgs
    stall
    "$FARM/slurm" job >said 2>&1 3>&- &
    wait_for test -s hung
    task=$(squeue -h -t RUNNING -o %A --sort=S | head -n 1)
    squeue -h -t RUNNING -o '%A %K' >running
    [ -n "$task" ]
    # the whole task, as when its node goes: the shot and all its children
    parent=$(ps -o ppid= -p "$(cat hung)" | tr -d ' ')
    kill -9 "$parent" "$(cat hung)"
    wait $! || fail "$(cat said)"
    [ "$(grep -c '^round' said)" = 2 ] || fail "$(cat said)"
    grep -q '^round 2: lines [1-6]$' said
    grep -q '6 shots: 6 whole' said
    rm -rf out/.trex*[A-Za-z0-9][A-Za-z0-9][A-Za-z0-9] # what the killed shot could not clear away
    all_whole
    # the same bytes as one by one
    must sha256sum out/*.glb
    of_slurm=$output
    rm -rf out
    must sh job
    must sha256sum out/*.glb
    [ "$output" = "$of_slurm" ]
}

@test "split by frames, joined: the whole again, by its digest" {
    must vg-encode "$DATA/velociraptor-walk.tar.xz" -o whole.vgs
    frames=$(vg-info --json whole.vgs | python3 -c 'import json, sys; print(json.load(sys.stdin)["frames"])')
    must vg-encode --take 0-3 whole.vgs -o a.vgs
    must vg-encode --take 4-8 whole.vgs -o b.vgs
    must vg-encode --take 9- whole.vgs -o c.vgs
    must vg-encode a.vgs b.vgs c.vgs -o joined.vgs
    must vg-info --digest whole.vgs
    whole=$output
    must vg-info --digest joined.vgs
    [ "$output" = "$whole" ]
    must vg-encode b.vgs a.vgs c.vgs -o mixed.vgs
    must vg-info --digest mixed.vgs
    [ "$output" != "$whole" ]
    # what is done to the parts is what is done to the whole
    for part in whole a b c; do
        pipe "vg-deform -j1 --onto '$DATA/velociraptor.rest.obj' $part.vgs | vg-solve -j1 -o $part-solved.vgs"
    done
    must vg-encode a-solved.vgs b-solved.vgs c-solved.vgs -o joined.vgs
    must vg-diff -t 1e-12 whole-solved.vgs joined.vgs
    [ "$frames" -gt 9 ]
}
