#!/usr/bin/env python3
"""make bench-train: how well networks go on, beside the bounds of doc/MATH.md 12, on the kit of real animations.

VG_DATA names the folder of the kit. ONLY="walk dance": these parts alone; of: walk dance trex cow keys long ablation speed bodies,
and, some minutes to an hour each: full mesh memory.
Prints a table in Markdown; a row ends with its bound and "missed" when it is not met; then the exit status is 1.
SPDX-License-Identifier: GPL-3.0-or-later
"""
import array
import ctypes
import json
import math
import os
import re
import resource
import subprocess
import sys
import tempfile
import time

KIT = os.environ.get("VG_DATA", "")
ONLY = os.environ.get("ONLY", "").split()
SEEDS = (1, 2, 3)
missed = 0


def run(command):
    """stderr of a shell command that must succeed"""
    done = subprocess.run(["bash", "-o", "pipefail", "-c", command], stderr=subprocess.PIPE, text=True, check=False)
    if done.returncode:
        sys.exit(f"train.py: '{command}' ended with status {done.returncode}: {done.stderr}")
    return done.stderr


def sequence(name, folder, times=1):
    """a stream of a sequence of the kit, so many times behind itself"""
    body = "trex" if name.startswith("trex") else name.split("-")[0] if folder == "hybrid" else name
    out = f"{name}.{times}.vgs"
    if not os.path.exists(out):
        files = " ".join([f"{KIT}/{folder}/{name}.tar.gz"] * times)
        run(f"vg-encode -q --reference {KIT}/{folder}/{body}.rest.obj {files} -o {out}")
    return out


def train(poses, options, out="x.net"):
    """errors by (method, given), and seconds"""
    began = time.monotonic()
    told = run(f"vg-train -v {options} {poses} -o {out}")
    learned = float(re.search(r"learned in ([0-9.]+) s", told).group(1))
    table = json.loads(subprocess.check_output(["vg-info", "--json", out]))["network"].get("errors", [])
    errors = {(r["method"], r["given"]): [r["frame_5"], r["frame_10"], r["frame_15"]] for r in table}
    return errors, learned, time.monotonic() - began


def row(what, values, bound=None, least=None):
    """one line of the table; bound: none of the values may be above its own; least: nor below"""
    global missed
    text = " ".join("-" if v is None else f"{v:.2f}" for v in values)
    over = bound and any(v is not None and v > b for v, b in zip(values, bound))
    under = least and any(v < b for v, b in zip(values, least))
    missed += bool(over or under)
    limits = ("" if not bound else " ".join(f"{b:g}" for b in bound)) + ("" if not least else f" (at least {least[0]:g})")
    print(f"| {what} | {text} | {limits}{' **missed**' if over or under else ''} |", flush=True)


def walk():
    poses = sequence("walk-man", "human")
    for seed in SEEDS:
        errors, learned, _ = train(poses, f"--hold 0.2326 --hold-at end --seed {seed}", f"walk.{seed}.net")
        if seed == 1:
            for method in ("repeat", "linear", "damped"):
                row(f"walk-man, {method}, 3 given", errors[method, 3])
            row("walk-man, regression, 1 given", errors["regression", 1])
            row("walk-man, regression, 3 given", errors["regression", 3], (1.1, 1.7, 1.9))
        row(f"walk-man, network, seed {seed}, 1 given", errors["network", 1], (1.9, 1.8, 1.9))
        row(f"walk-man, network, seed {seed}, 3 given", errors["network", 3], (1.0, 1.1, 1.7))
        row(f"walk-man, seed {seed}, seconds", [learned], (10,))
    errors, _, _ = train(poses, "--hold 0.2 --hold-at end")
    row("walk-man, 17 frames held out, regression, 3 given", errors["regression", 3])
    row("walk-man, 17 frames held out, network, 3 given", errors["network", 3])


def dance():
    errors, learned, _ = train(sequence("dance-man", "human"), "--hold 0.2 --hold-at end", "dance.net")
    row("dance-man, damped, 3 given", errors["damped", 3])
    row("dance-man, regression, 3 given", errors["regression", 3])
    row("dance-man, network, 3 given", errors["network", 3], (1.2, 2.5, 3.7))
    row("dance-man, seconds", [learned])


def trex():
    errors, learned, _ = train(sequence("trex-walk", "hybrid", 5),
                               "--model pca --given 1 --iterations 800 --hold-at end", "trex.net")
    row("trex-walk five times, pca, 1 given", errors["network", 1], (0.3, 0.2, 0.2))
    row("trex-walk five times, pca, seconds", [learned])


def cow():
    errors, learned, _ = train(sequence("cow-run", "hybrid", 5),
                               "--model conv --iterations 350 --rate 0.002 --hold-at end", "cow.net")
    row("cow-run five times, conv, 1 given", errors["network", 1], (2.1, 1.4, 1.3))
    row("cow-run five times, conv, seconds", [learned])


def gaps(poses, net, first, frames, options):
    """mean errors between keys 10, 17 and 33 frames apart"""
    means = []
    for gap in (10, 17, 33):
        room = frames - first - gap
        starts = [first - 1 + room * k // 2 for k in range(3)] if gap < 20 else [frames - 1 - gap - 4 * k for k in range(3)]
        total = 0
        for at in starts:
            run(f"vg-encode -q --take {at},{at + gap} {poses} -o keys.vgs")
            run(f"vg-encode -q --take {at + 1}-{at + gap - 1} {poses} -o truth.vgs")
            run(f"vg-generate -q --between {gap - 1} {options} {net} keys.vgs | vg-encode -q --take 1-{gap - 1} - -o way.vgs")
            total += 100 * apart("truth.vgs", "way.vgs") / len(starts)
        means.append(total)
    return means


def apart(truth, result):
    """mean distance of a vertex, centred, as a share of D"""
    report = json.loads(subprocess.check_output(["vg-diff", "-q", "-c", "--json", truth, result]))
    return report["vertex_error"]["mean"]["D"]


def keys():
    poses = sequence("walk-man", "human")
    if not os.path.exists("walk.1.net"):
        train(poses, "--hold 0.2326 --hold-at end", "walk.1.net")
    for name, options in (("the mean of both ways", ""), ("optimised", "--optimise"), ("merged", "--merge 5%")):
        row(f"walk-man, keys 10, 17, 33 apart, {name}", gaps(poses, "walk.1.net", 66, 86, options))
    poses = sequence("trex-walk", "hybrid", 5)
    if not os.path.exists("trex.net"):
        train(poses, "--model pca --given 1 --iterations 800 --hold-at end", "trex.net")
    count = json.loads(subprocess.check_output(["vg-info", "--json", poses]))["frames"]
    row("trex-walk, keys 10, 17, 33 apart, the mean of both ways", gaps(poses, "trex.net", count - 34, count, ""), (0.45, 0.35, 0.30))
    row("trex-walk, keys 10, 17, 33 apart, merged", gaps(poses, "trex.net", count - 34, count, "--merge 5%"))


def liveliness(stream, take):
    """mean length of a vertex' step, centred, frame by frame"""
    first, last = take
    run(f"vg-encode -q --take {first}-{last - 1} {stream} -o one.vgs; vg-encode -q --take {first + 1}-{last} {stream} -o two.vgs")
    return apart("one.vgs", "two.vgs")


def long_run():
    poses = sequence("walk-man", "human")
    if not os.path.exists("walk.1.net"):
        train(poses, "--hold 0.2326 --hold-at end", "walk.1.net")
    run(f"vg-encode -q --take 65 {poses} | vg-generate -q --frames 300 walk.1.net -o long.vgs")

    truth = liveliness(poses, (0, 85))
    for first, last in ((0, 50), (100, 150), (250, 299)):
        row(f"walk-man, 300 frames from one, change at {first} to {last} over the truth's",
            [liveliness("long.vgs", (first + 1, last)) / truth], (1.1,), (0.9,))


def ablation():
    poses = sequence("walk-man", "human")
    for name, options in (("shared", ""), ("separate", "--direction separate"), ("forward", "--direction forward"),
                          ("no distance between chains", "--loss bidirectional=0")):
        errors, _, _ = train(poses, f"--model pca --iterations 500 --hold 0.2326 --hold-at end {options}")
        row(f"walk-man, pca, {name}, 1 given", errors["network", 1])
        row(f"walk-man, pca, {name}, 3 given", errors["network", 3])


def vertices_of(poses):
    """frames of numbers of a stream, the centroid of each at 0"""
    data = subprocess.check_output(["bash", "-c", f"vg-decode -q {poses} -o all.npy && cat all.npy"])
    head = 10 + int.from_bytes(data[8:10], "little")
    kind = "f" if b"<f4" in data[:head] else "d"
    frames, count, _ = (int(n) for n in re.search(rb"shape': \((\d+), (\d+), (\d+)", data[:head]).groups())
    numbers = array.array(kind, data[head:])
    out = []
    for i in range(frames):
        one = numbers[3 * count * i:3 * count * (i + 1)]
        middle = [sum(one[k::3]) / count for k in range(3)]
        out.append([x - middle[k % 3] for k, x in enumerate(one)])
    return out


def vertex_line(poses, held):
    """errors of linear and damped continuation of vertices instead of features, in the windows of vg-train's table"""
    frames = vertices_of(poses)
    extent = json.loads(subprocess.check_output(["vg-info", "--json", poses]))["mesh"]["D"]
    ahead, starts = (5, 10, 15), range(len(frames) - held, len(frames) - 14)
    sums = {}
    for at in starts:
        last, before = frames[at - 1], frames[at - 2]
        for i, n in enumerate(ahead):
            for name, far in (("linear", n), ("damped", 9 * (1 - 0.9 ** n))):
                step = [x + far * (x - y) - z for x, y, z in zip(last, before, frames[at + n - 1])]
                error = sum(math.sqrt(sum(d * d for d in step[k:k + 3])) for k in range(0, len(step), 3)) / (len(step) // 3)
                sums.setdefault(name, [0, 0, 0])[i] += 100 * error / extent / len(starts)
    return sums


def changes(net, poses, name):
    """Figure 2 by the mended measure: how much 300 frames from one change from frame to frame, over the truth's"""
    run(f"vg-encode -q --take 65 {poses} | vg-generate -q --frames 300 {net} -o long.vgs")
    count = json.loads(subprocess.check_output(["vg-info", "--json", poses]))["frames"]
    truth = liveliness(poses, (0, count - 1))
    row(f"{name}, change at 0-50, 50-100, 100-150, 150-200, 200-250, 250-299 over the truth's",
        [liveliness("long.vgs", (a + 1, b)) / truth for a, b in ((0, 50), (50, 100), (100, 150), (150, 200), (200, 250), (250, 299))])


def as_printed(model, iterations):
    """Tables 1 and 2 and Figure 2 of a network as printed: trained from one frame"""
    poses = sequence("walk-man", "human")
    for name, options in (("", ""), (", no KL", "--loss kl=0"), (", no L2", "--loss l2=0")):
        net = f"{model}.net"
        errors, learned, _ = train(poses, f"--model {model} --iterations {iterations} --hold 0.2326 --hold-at end {options}", net)
        for given in (1, 3):
            row(f"walk-man, {model}{name}, {given} given", errors["network", given])
        row(f"walk-man, {model}{name}, seconds", [learned])
        changes(net, poses, f"walk-man, {model}{name}")


def full():
    for name, errors in vertex_line(sequence("walk-man", "human"), 20).items():
        row(f"walk-man, vertices, {name}, 3 given", errors)
    as_printed("fc", int(os.environ.get("ITERATIONS", "600")))


def mesh():
    as_printed("conv", int(os.environ.get("ITERATIONS", "600")))


def sgemm_speed():
    """operations a second of one thread: products of 512 x 512 matrices by the BLAS of the system"""
    n, times = 512, 8
    blas = ctypes.CDLL("libblas.so.3")
    a, b, c = ((ctypes.c_float * (n * n))(*([0.5] * (n * n))) for _ in range(3))
    one, zero = ctypes.c_float(1), ctypes.c_float(0)
    best = 0
    for _ in range(5):
        began = time.process_time()
        for _ in range(times):
            blas.cblas_sgemm(101, 111, 111, n, n, n, one, a, n, b, n, zero, c, n)
        best = max(best, times * 2 * n**3 / (time.process_time() - began))
    return best


def products(model, vertices, rank):
    """operations of an iteration in products of matrices, 16 chains of 31 steps, forward and twice backward"""
    chains, steps, hidden = 16, 31, 128
    numbers = rank if model == "pca" else 12 * vertices
    latent = rank if model == "pca" else hidden
    one = 2 * chains * 4 * hidden * (latent + hidden + 2 * 2 * hidden)                # three recurrent layers
    one += 2 * chains * hidden * numbers * (1 if model == "pca" else 3)               # in, variance, out
    one += 6 * 4 * chains * vertices * 12 * 12 if model == "conv" else 0              # a vertex and its neighbours' mean
    return 3 * steps * one


def processor_seconds(command):
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    run(command)
    return resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def speed():
    """processor time of one thread, which a busy machine disturbs less than the clock: by iterations beyond the first two"""
    poses = sequence("dance-man", "human")  # of 741 vertices, as in MATH 12
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    vertices = json.loads(subprocess.check_output(["vg-info", "--json", poses]))["mesh"]["vertices"]
    for model, more, bound in (("pca", 40, 35), ("fc", 10, 250), ("conv", 6, 500)):
        few, many = (processor_seconds(f"vg-train -q -j 1 --model {model} --iterations {n} --hold 0.01 {poses} -o x.net")
                     for n in (2, 2 + more))
        rank = json.loads(subprocess.check_output(["vg-info", "--json", "x.net"]))["network"]["coordinates"]
        row(f"{model}, ms an iteration, one thread", [1000 * (many - few) / more], (bound,))
        row(f"{model}, its products at the speed of sgemm", [1000 * products(model, vertices, rank) / sgemm_speed()])


def bodies():
    """several bodies, or several actions of one, in one training, beside each alone"""
    man, heavy = sequence("walk-man", "human"), sequence("walk-heavy", "human")
    acts = [sequence(f"trex-{act}", "hybrid") for act in ("walk", "run", "attack")]
    for name, poses in (("walk-man", man), ("walk-heavy", heavy), ("walk-man and walk-heavy", f"{man} {heavy}"),
                        ("three actions of trex", " ".join(acts))):
        errors, _, _ = train(poses, "--hold-at end")
        for method in ("damped", "regression", "network"):
            for given in (1, 3):
                if (method, given) in errors:
                    row(f"{name}, {method}, {given} given", errors[method, given])


def torus(around, across, frames):
    """a stream of a moving torus"""
    faces = [(i * across + k, (i + 1) % around * across + k, (i + 1) % around * across + (k + 1) % across,
              i * across + (k + 1) % across) for i in range(around) for k in range(across)]
    quads = "".join("f {} {} {} {}\n".format(*(v + 1 for v in face)) for face in faces)
    for t in range(frames):
        with open(f"torus.{t:03d}.obj", "w", encoding="ascii") as file:
            for i in range(around):
                u, phase = 2 * math.pi * i / around, 2 * math.pi * t / 17
                thick = 0.3 + 0.05 * math.sin(3 * u + phase)
                for k in range(across):
                    v = 2 * math.pi * k / across
                    far = 1 + 0.1 * math.sin(phase + 2 * u) + thick * math.cos(v)
                    high = thick * math.sin(v) + 0.2 * math.sin(2 * u + phase) + 0.05 * math.sin(0.7 * phase) * math.cos(3 * u)
                    file.write(f"v {far * math.cos(u):.6f} {far * math.sin(u):.6f} {high:.6f}\n")
            file.write(quads)
    run("vg-encode -q torus.*.obj -o torus.vgs")
    return "torus.vgs"


def memory():
    """the most that conv as printed holds at 13,380 vertices, one thread"""
    poses = torus(223, 60, 48)
    for name, options in (("", ""), (", no KL", "--loss kl=0")):
        with subprocess.Popen(f"exec vg-train -q -j 1 --model conv --iterations 2 {options} {poses} -o x.net", shell=True) as process:
            _, status, used = os.wait4(process.pid, 0)
        if status:
            sys.exit("train.py: vg-train failed")
        row(f"conv{name}, 13,380 vertices, GB", [used.ru_maxrss / 1e6], (1,))


def main():
    if not os.path.isdir(f"{KIT}/human"):
        sys.exit("train.py: VG_DATA must name the folder of the kit")
    print("| what | mean error, % of D, 5 10 15 frames ahead (or as it says) | bound |\n|---|---|---|", flush=True)
    parts = {"walk": walk, "dance": dance, "trex": trex, "cow": cow, "keys": keys, "long": long_run,
             "ablation": ablation, "speed": speed, "bodies": bodies, "full": full, "mesh": mesh, "memory": memory}
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        for name, part in parts.items():
            if name in ONLY or (not ONLY and name not in ("full", "mesh", "memory")):
                part()
    sys.exit(1 if missed else 0)


main()
