#!/usr/bin/env bats
# vg-view SIGNAL -o NAME.html: the page agrees with vg-sample, before and after edits, retimings and drawn curves.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

setup_file() {
    cd "$BATS_FILE_TMPDIR" || return 1
    vg-encode --reference "$DATA/horse.rest.obj" "$DATA/horse-run.tar.xz" | vg-fitsignal -q -o horse.signal
    vg-encode --fps 25 --reference "$DATA/trex.rest.obj" "$DATA/trex-walk.tar.xz" | vg-fitsignal -q --root none --basis int16 -o trex.signal
    for name in horse trex; do vg-view -q $name.signal -o $name.html; done
}

# fetch NAME...: files that setup_file has made
fetch() { for name; do ln -s "$BATS_FILE_TMPDIR/$name" .; done; }

# browse PAGE FRAGMENT <<END: as in page.bats, with helpers to find marks of the plane and to compare saved poses with vg-sample
browse() {
    command -v chromium >/dev/null || command -v chromium-browser >/dev/null || command -v google-chrome >/dev/null ||
        skip "needs chromium (not in debian-packages.txt: it is large)"
    cat >drive.py <<'END'
import math, subprocess, sys
from page_driver import *
from read_stream import read_stream

def points(name):
    return [[float(x) for x in line.split()[1:]] for line in open(name) if line.startswith("v ")]

def sampled(*arguments):
    subprocess.run(["vg-sample", "-q", *arguments, "-o", "sampled.vgs"], check=True)
    return [list(zip(*[iter(f.values)] * 3)) for f in read_stream("sampled.vgs").frames]

# the pose that the page saves is a frame of vg-sample with these arguments, to 2e-6 D
def same(page, *arguments, frame=0):
    d = page.value("JSON.parse(document.querySelector('#facts').textContent).sequences[0].diagonal")
    p, q = points(page.saved("#pose")), sampled(*arguments)[frame]
    assert len(p) == len(q) > 100
    worst = max(math.dist(a, b) for a, b in zip(p, q)) / d
    assert worst < 2e-6, worst

with Page(*sys.argv[1:]) as page:
    page.loaded()
    data = lambda name: page.value(f"document.documentElement.dataset.{name}")
    corner = lambda at: page.value(f"(r => [r.x, r.y, r.width, r.height])(document.querySelector('{at}').getBoundingClientRect())")
    # where marks of the plane or of the speed curve are on the screen
    marks = lambda kind, at="#plane": [[corner(at)[0] + x, corner(at)[1] + y] for x, y in page.value(
        f"[...document.querySelectorAll('{at} .{kind}')].map((e) => e.tagName === 'rect' ? [+e.getAttribute('x') + 6, +e.getAttribute('y') + 6] : [+e.getAttribute('cx'), +e.getAttribute('cy')])")]
END
    { sed 's/^/    /' && printf '    assert not page.trouble, page.trouble\n    assert all(r.startswith(("file:", "data:", "blob:")) for r in page.requests), page.requests\n'; } >>drive.py
    must env PYTHONPATH="$ROOT/tests:$ROOT/examples" python3 drive.py "$@"
}

@test "browser: without edits a pose is that of vg-sample at any time, with and without a root" {
    fetch horse.signal horse.html trex.signal trex.html
    browse horse.html '#play=0&time=7.3' <<'END'
same(page, "horse.signal", "--at", "7.3")
page.key("Home")
same(page, "horse.signal", "--at", "1")
END
    browse trex.html '#play=0&time=20.75' <<'END'
same(page, "trex.signal", "--at", "20.75")
END
}

@test "browser: a control point is dragged, the mesh moves, and vg-sample makes the same of the saved text" {
    fetch horse.signal horse.html
    browse horse.html '#play=0&time=10' <<'END'
rest = points(page.saved("#pose"))
before = page.picture()
x, y = marks("control")[6]
page.drag(x, y, x + 60, y - 45)
page.settle()
assert data("changed"), "no frame is said to be changed"
assert page.picture()[2] != before[2]
text = page.saved("#save")
lines = [l.split() for l in open(text) if not l.startswith("#")]
assert len(lines) == 1 and lines[0][0] == "control", lines
same(page, "horse.signal", "--edit", text, "--at", "10")
# frames that are said to be unchanged are, to the last bit, and the others are not
flags = [False] * 21
for part in data("changed").split(", "):
    ends = [int(n) for n in part.split(" to ")]
    flags[ends[0] - 1:ends[-1]] = [True] * (ends[-1] - ends[0] + 1)
assert 0 < sum(flags) < 21
for i, (a, b) in enumerate(zip(sampled("horse.signal"), sampled("--edit", text, "horse.signal"))):
    assert (a != b) == flags[i], (i, flags)
page.click("#undo")
page.wait("document.documentElement.dataset.changed === ''")
assert points(page.saved("#pose")) == rest
page.click("#redo")
page.wait("document.documentElement.dataset.changed !== ''")
page.click("#reset-edits")
page.wait("document.documentElement.dataset.edits === '0'")
assert points(page.saved("#pose")) == rest
END
}

@test "browser: points are added and removed, a frame is pinned and moved, sites change, by keys" {
    fetch horse.signal horse.html
    browse horse.html '#play=0&time=8.5' <<'END'
k = len(marks("control"))
page.click("#add-point")
assert len(marks("control")) == k + 1
page.value("document.querySelector('#plane').focus()")
page.key("ArrowUp"), page.key("ArrowUp")
page.click("#site")
page.click("#pin")
x, y = marks("frame.pinned")[0]
page.drag(x, y, x + 30, y + 25)
page.value("document.querySelector('#plane').focus()")
for _ in range(4):
    page.key("n")
page.key("Delete")
assert len(marks("control")) == k
text = page.saved("#save")
verbs = [l.split()[0] for l in open(text) if not l.startswith("#")]
assert verbs == ["insert", "control", "site", "frame", "remove"], verbs
same(page, "horse.signal", "--edit", text, "--at", data("time"))
END
}

@test "browser: edits load and are refused with their line; the speed curve retimes as vg-sample does" {
    fetch horse.signal horse.html
    printf '# by hand\ntime 1 1\ntime 12 6.5\ntime 21 30\ncontrol 5 0.25 -0.5\n' >by-hand.txt
    printf 'control 5 0.25 -0.5\ncontrol 99 0 0\n' >wrong.txt
    browse horse.html '#play=0' <<'END'
def load(name):
    root = page.call("DOM.getDocument")["root"]["nodeId"]
    node = page.call("DOM.querySelector", nodeId=root, selector="#file")["nodeId"]
    page.call("DOM.setFileInputFiles", files=[str(pathlib.Path(name).resolve())], nodeId=node)
page.call("DOM.enable")
load("wrong.txt")
page.wait("document.querySelector('#status').textContent.includes('line 2: there is no control point 99')")
assert data("edits") == "0"
load("by-hand.txt")
page.wait("document.documentElement.dataset.edits === '4'")
page.key("End")
for _ in range(23):
    page.key("ArrowLeft")
assert data("time") == "7"
same(page, "horse.signal", "--edit", "by-hand.txt", frame=6)
x, y = marks("time", "#speed-curve")[1]
page.drag(x, y, x + 80, y + 12)
text = page.saved("#save")
lines = [l.split() for l in open(text) if l.startswith("time")]
assert len(lines) == 3 and lines[0] == ["time", "1", "1"] and lines[1][1:] != ["12", "6.5"], lines
page.value("document.querySelector('#canvas').focus()")
page.key("Home")
for _ in range(9):
    page.key("ArrowRight")
same(page, "horse.signal", "--edit", text, frame=9)
END
}

@test "browser: a curve is drawn, and vg-sample --curve makes the same poses" {
    fetch trex.signal trex.html
    browse trex.html '#play=0&time=1' <<'END'
page.key("d")
b = corner("#plane")
at = lambda u, v: dict(x=b[0] + u * b[2], y=b[1] + v * b[3])
page.call("Input.dispatchMouseEvent", type="mousePressed", button="left", buttons=1, clickCount=1, **at(0.25, 0.5))
for i in range(1, 25):
    page.call("Input.dispatchMouseEvent", type="mouseMoved", button="left", buttons=1, **at(0.25 + 0.02 * i, 0.5 + 0.2 * math.sin(i / 4)))
page.call("Input.dispatchMouseEvent", type="mouseReleased", button="left", clickCount=1, **at(0.73, 0.44))
page.wait("!document.querySelector('#save-curve').hidden")
text = page.saved("#save-curve")
assert 3 < len(open(text).readlines()) < 20
page.value("document.querySelector('#canvas').focus()")
for _ in range(9):
    page.key("ArrowRight")
assert data("time") == "10"
same(page, "trex.signal", "--curve", text, frame=9)
page.click("#drop-curve")
page.wait("document.querySelector('#save-curve').hidden")
same(page, "trex.signal", "--at", "10")
END
}

@test "browser: Shift explores the plane and warns outside of the frames, and without it the pose is back" {
    fetch horse.html
    browse horse.html '#play=0&time=4' <<'END'
before = page.picture()
b = corner("#plane")
move = lambda u, v, keys: page.call("Input.dispatchMouseEvent", type="mouseMoved", x=b[0] + u * b[2], y=b[1] + v * b[3], modifiers=keys)
move(0.5, 0.5, 8)
page.settle()
assert page.picture()[2] != before[2] and page.value("document.querySelector('#outside').hidden")
move(0.02, 0.97, 8)
page.wait("!document.querySelector('#outside').hidden")
move(0.5, 0.45, 0)
page.wait("document.querySelector('#outside').hidden")
assert page.picture()[2] == before[2]
END
}

@test "browser: names of frames are shown as they are, whatever is in them" {
    python3 - <<'END'
for i, name in enumerate(('a "quoted" one', "tab\there", "</title><b>größe 日本語".replace("/", "∕"), "back\\slash & <i>", "$(id)")):
    with open(f"{i}{name}.obj", "w") as f:
        for v in range(120):
            f.write(f"v {v % 2 + i * i / 10} {v // 2 % 2 - i / 7 + v / 50} {v * i / 500}\n")
        for v in range(0, 118, 2):
            f.write(f"f {v + 1} {v + 2} {v + 3}\n")
END
    must vg-encode ./*.obj -o poses.vgs
    must vg-fitsignal -q poses.vgs -o hostile.signal
    must vg-view hostile.signal -o hostile.html
    browse hostile.html '#play=0&time=1' <<'END'
import glob
for name in sorted(glob.glob("[0-9]*.obj")):
    assert page.value("document.querySelector('#frame').textContent").endswith(": " + name[:-4]), name
    page.key("ArrowRight")
page.key("Home")
x, y = marks("control")[1]
page.drag(x, y, x + 30, y - 20)
text = page.saved("#save")
same(page, "hostile.signal", "--edit", text, "--at", "1")
END
}

@test "browser: a pose of 13,380 vertices with its normals is made in a sixtieth of a second" {
    vg-encode "$DATA/human-man-poses.tar.xz" | vg-fitsignal -q --tolerance 1e-3 -o man.signal
    must vg-view man.signal -o man.html
    browse man.html '#play=0&time=1' <<'END'
assert page.value("document.querySelector('#about').textContent").endswith("13380 vertices")
spent = []
for _ in range(12):  # the first ones wait for the compiler of the browser
    page.key("ArrowRight")
    page.settle()
    spent.append(float(data("spent")))
assert min(spent) < 1000 / 60, spent
END
}

@test "browser: on a phone nothing is wider than the screen, and a finger moves a control point" {
    fetch horse.html
    browse horse.html '#play=0&time=4' <<'END'
page.call("Emulation.setDeviceMetricsOverride", width=360, height=700, deviceScaleFactor=1, mobile=True)
page.call("Emulation.setTouchEmulationEnabled", enabled=True)
page.wait("document.querySelector('#plane').clientWidth <= 360")
page.settle()
assert page.value("document.documentElement.scrollWidth") <= 360
for width, height in ((320, 640), (640, 320)):  # upright and on its side
    page.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=True)
    page.settle()
    assert page.value("document.documentElement.scrollWidth") <= width
    assert all(page.value(f"document.querySelector('{at}').clientHeight") >= 200 for at in ("#plane", "#canvas"))
page.call("Emulation.setDeviceMetricsOverride", width=360, height=700, deviceScaleFactor=1, mobile=True)
page.settle()
assert page.value("document.querySelector('#plane').clientHeight") > 200 and page.value("document.querySelector('#canvas').clientHeight") > 200
x, y = marks("control")[5]
page.call("Input.dispatchTouchEvent", type="touchStart", touchPoints=[dict(x=x + 2, y=y)])
for i in range(1, 6):
    page.call("Input.dispatchTouchEvent", type="touchMove", touchPoints=[dict(x=x + 2 + 6 * i, y=y - 5 * i)])
page.call("Input.dispatchTouchEvent", type="touchEnd", touchPoints=[])
page.wait("document.documentElement.dataset.edits === '1'")
END
}

@test "browser: everything that can be used has a name" {
    fetch horse.html
    browse horse.html '#play=0' <<'END'
page.call("Accessibility.enable")
roles = ("button", "slider", "combobox", "application", "image")
nodes = [n for n in page.call("Accessibility.getFullAXTree")["nodes"] if not n.get("ignored") and n.get("role", {}).get("value") in roles]
assert len(nodes) > 20
assert not [n for n in nodes if not n.get("name", {}).get("value")]
END
}

@test "a page of a signal: other options are refused, the same input gives the same bytes, nothing comes from outside" {
    fetch horse.signal
    for option in '--beside horse.signal' '--fps 3' '--scales'; do
        # shellcheck disable=SC2086
        must_fail 2 vg-view horse.signal -o out.html $option
        says "of a signal the pose plane is shown"
    done
    must vg-view horse.signal -o one.html
    must vg-view horse.signal -o two.html
    same_file one.html two.html
    if grep -E -i 'https?://[^w]|src=|@import|\bfetch\(|XMLHttpRequest|WebSocket' one.html; then fail 'the page looks outside'; fi
}
