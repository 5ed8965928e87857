#!/usr/bin/env bats
# vg-view -o NAME.html: what is in a page, what is lost in it, and what a browser makes of it.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# check_places PAGE OBJ...: every position of sequence 0 is as near to that of the OBJ files as the page states
check_places() {
    py "$@" <<'END'
import base64, html.parser, json, re, struct, sys, zlib

class Scripts(html.parser.HTMLParser):
    found, now = [], None
    def handle_starttag(self, tag, attributes):
        if tag == "script":
            self.now = [dict(attributes), ""]
    def handle_data(self, data):
        if self.now:
            self.now[1] += data
    def handle_endtag(self, tag):
        if tag == "script":
            self.found.append(self.now)
            self.now = None

scripts = Scripts()
scripts.feed(open(sys.argv[1], encoding="utf-8").read())
facts = json.loads(next(text for a, text in scripts.found if a.get("id") == "facts"))
about = facts["sequences"][0]
nv, frames, lists = about["vertices"], [], {}
for a, text in scripts.found:
    if a.get("data-sequence") != "0":
        continue
    data = zlib.decompress(base64.b64decode(text, validate=True))
    if "data-list" in a:
        n = len(data) // 4
        lists[a["data-list"]] = [int.from_bytes(bytes(data[k * n + i] for k in range(4)), "big") for i in range(n)]
    elif a["data-frames"] == "places":
        n, origin, step = int(a["data-count"]), [float(x) for x in a["data-origin"].split()], [float(x) for x in a["data-step"].split()]
        size, total, q = 3 * nv, n * 3 * nv, []
        assert len(data) == n + 2 * total
        for f in range(n):
            for k in range(3):
                before = 0
                for v in range(nv):
                    i = len(q)
                    rest = data[n + i] << 8 | data[n + total + i]
                    x = ~(rest >> 1) if rest & 1 else rest >> 1
                    before = x = x + (before if data[f] & 4 else 0)
                    if data[f] & 1:
                        x += q[i - size]
                    if data[f] & 2:
                        x += 2 * q[i - size] - q[i - 2 * size]
                    q.append(x & 0xFFFF)
            frames.append([[origin[k] + step[k] * q[f * size + k * nv + v] for k in range(3)] for v in range(nv)])
truths = []
for name in sys.argv[2:]:
    lines = [line.split() for line in open(name)]
    truths.append([[float(x) for x in line[1:4]] for line in lines if line[:1] == ["v"]])
    faces = [[int(x) - 1 for x in line[1:]] for line in lines if line[:1] in (["f"], ["l"])]
assert len(frames) == len(truths) == len(about["names"])
worst = max(sum((a - b) ** 2 for a, b in zip(p, q)) ** 0.5 for f, t in zip(frames, truths) for p, q in zip(f, t))
assert worst <= about["loss"] * about["diagonal"] * (1 + 1e-9) + 1e-15, (worst, about["loss"] * about["diagonal"])
assert 0 < worst < 1e-5 * max(max(abs(x) for x in q) for t in truths for q in t)
at, got = 0, []
for size in lists["sizes"]:
    face = []
    for _ in range(size):
        last = (lists["corners"][at] + (last if at else 0)) % 2 ** 32
        face.append(last)
        at += 1
    got.append(face)
assert got == faces, (got, faces)
assert len(lists["triangles"]) == 3 * sum(max(len(f) - 2, 0) for f in faces)
END
}

# browse PAGE <<END: Python with `page` open in a browser, and what page_driver.py has
browse() {
    command -v chromium >/dev/null || command -v chromium-browser >/dev/null || command -v google-chrome >/dev/null ||
        skip "needs chromium (not in debian-packages.txt: it is large)"
    { printf 'import sys\nfrom page_driver import *\nwith Page(*sys.argv[1:]) as page:\n    page.loaded()\n' && sed 's/^/    /' &&
        printf '    assert not page.trouble, page.trouble\n    assert all(r.startswith(("file:", "data:")) for r in page.requests), page.requests\n'; } >drive.py
    must env PYTHONPATH="$ROOT/tests" python3 drive.py "$@"
}

@test "a page holds the positions, within what it states, and the faces" {
    poses strip 40
    local files=()
    for ((i = 1; i <= 40; i++)); do files+=("pose$i.obj"); done
    must vg-view "${files[@]}" -o page.html
    check_places page.html "${files[@]}"
    poses two 3
    must vg-view pose1.obj pose2.obj pose3.obj -o page.html
    check_places page.html pose1.obj pose2.obj pose3.obj
}

@test "-v states the loss; the same input gives the same bytes, through a pipe too" {
    poses cube 3
    must_warn vg-view -v pose*.obj -o page.html
    says "3 frames in" "positions are within" "D of the input"
    pipe 'vg-encode pose1.obj pose2.obj pose3.obj | vg-view --format html --title pipe >pipe.html'
    [ "$(grep -c '<title>pipe</title>' pipe.html)" = 1 ]
    grep -q '<title>pose1.obj to pose3.obj</title>' page.html
    must vg-view pose*.obj -o again.html
    same_file page.html again.html
    grep -q 'vg-encode pose1.obj pose2.obj pose3.obj' pipe.html
}

@test "a page loads nothing from outside" {
    poses cube 2
    must vg-view pose1.obj --against pose2.obj --beside pose2.obj -o page.html
    if grep -E -i 'https?://|src=|@import|[^a-z]url\(|\bfetch\(|XMLHttpRequest|WebSocket' page.html; then fail 'the page looks outside'; fi
    [ "$(grep -o 'href="[^"]*"' page.html)" = 'href="data:,"' ]
    grep -q "default-src 'none'" page.html
}

@test "nothing that the input says becomes markup" {
    poses cube 1
    cp pose1.obj '<b>&"x.obj'
    must vg-view '<b>&"x.obj' --title '</title><script>alert(1)</script>' -o page.html
    if grep -q -e '<script>alert' -e '<b>' page.html; then fail 'a title became markup'; fi
    grep -qF '&lt;/title&gt;&lt;script&gt;alert(1)' page.html
}

@test "errors: numbers are those of vg-diff, the colours end where --scale says" {
    poses cube 3
    mkdir truth
    cp pose*.obj truth
    for i in 1 2 3; do mesh cube 0.2 0.01 >"pose$i.obj"; done
    must vg-view pose*.obj --against truth -o page.html
    must vg-view pose*.obj --against truth --scale 0.25 -o scaled.html
    py page.html scaled.html <<'END'
import json, re, sys
facts, scaled = (json.loads(re.search(r'id="facts">(.*?)</script>', open(p).read()).group(1)) for p in sys.argv[1:])
means, maxima = facts["sequences"][0]["means"], facts["sequences"][0]["maxima"]
assert len(means) == len(maxima) == 3 and all(m <= x for m, x in zip(means, maxima))
import math
points = lambda name: [[float(x) for x in l.split()[1:]] for l in open(name) if l.startswith("v ")]
D = math.dist((0, 0, 0), (1, 1, 1))
for i in range(3):
    errors = [math.dist(a, b) / D for a, b in zip(points(f"pose{i+1}.obj"), points(f"truth/pose{i+1}.obj"))]
    assert abs(sum(errors) / 8 - means[i]) < 1e-6 and abs(max(errors) - maxima[i]) < 1e-6
assert facts["max"] <= facts["scale"] <= 1.5 * facts["max"] and scaled["scale"] == 0.25
END
}

@test "a page takes its name when it is whole, and an older one stays when it fails" {
    poses cube 3
    must vg-view pose1.obj -o page.html
    cp page.html before.html
    pipe 'vg-encode pose1.obj pose2.obj pose3.obj >whole.vgs'
    head -c $(($(wc -c <whole.vgs) - 40)) whole.vgs >cut.vgs
    must_fail 3 vg-view cut.vgs -o page.html
    one_line
    must_fail 3 vg-view pose*.obj --against pose1.obj -o page.html
    says "has 3 frames where 'pose1.obj' has 1"
    must_fail 4 vg-view pose1.obj --format html -o /dev/full
    same_file page.html before.html
    nothing_but pose1.obj pose2.obj pose3.obj page.html before.html whole.vgs cut.vgs
}

@test "options of the other kind, and what cannot be read twice, are refused before the input is read" {
    local arguments
    for arguments in '--frames 3' '--columns 2' '--size 64x64' '--silhouettes' '--format gif'; do
        # shellcheck disable=SC2086
        must_fail 2 vg-view missing.obj -o out.html $arguments
        says "option '"
    done
    must_fail 2 vg-view missing.obj -o out.png --title x
    must_fail 2 vg-view - --beside - -o out.html
    must_fail 2 vg-view missing.obj --against - --beside - -o out.html
    must_fail 4 vg-view missing.obj -o out.html
    says "'missing.obj'"
    mesh cube >cube.obj
    must_fail 4 vg-view cube.obj --beside missing.obj -o out.html
    mesh tetra >tetra.obj
    must_fail 3 vg-view cube.obj --against tetra.obj -o out.html
    must vg-view cube.obj --beside tetra.obj -o out.html
}

@test "browser: a page shows the mesh, and another picture for another frame" {
    poses two 4
    must vg-view pose*.obj -o page.html
    browse page.html '#frame=2&view=20,10' <<'END'
assert page.value("document.documentElement.dataset.frame") == "2"
assert page.value("document.querySelector('#message').hidden")
assert "pose3" in page.value("document.querySelector('#frame').textContent")
pictures = [page.picture()]
assert 0.02 < share_drawn(pictures[0]) < 0.9, share_drawn(pictures[0])
page.key("ArrowRight")
pictures.append(page.picture())
page.value("location.hash = '#frame=0'")
page.wait("document.documentElement.dataset.drawn === '0'")
pictures.append(page.picture())
assert pictures[0][2] != pictures[1][2] and pictures[1][2] != pictures[2][2] and pictures[0][2] != pictures[2][2]
page.value("location.hash = '#frame=2'")
page.wait("document.documentElement.dataset.drawn === '2'")
assert page.picture()[2] == pictures[0][2]
END
}

@test "browser: keys, mouse and slider do what they say" {
    poses cube 6
    must vg-view pose*.obj -o page.html
    browse page.html <<'END'
data = lambda name: page.value(f"document.documentElement.dataset.{name}")
assert data("playing") == "true"  # a page opens playing
page.wait("document.documentElement.dataset.drawn > '1'")
page.key(" ")
assert data("playing") == "false"
page.key(" ")
assert data("playing") == "true"
page.key(" ")
page.key("Home")
assert data("frame") == "0"
plain = page.picture()
page.key("w")
over = page.picture()
page.key("w")
alone = page.picture()
assert plain[2] != over[2] != alone[2] and share_drawn(alone) < share_drawn(over)
page.key("w")
assert page.picture()[2] == plain[2]
page.drag(400, 300, 500, 330)
assert page.picture()[2] != plain[2]
page.key("r")
assert page.picture()[2] == plain[2]
page.key("g")
assert share_drawn(page.picture()) > share_drawn(plain)
page.key("g")
page.key("+")
assert share_drawn(page.picture()) > share_drawn(plain)
page.click("#scrub")
assert data("frame") in "23", data("frame")
page.click("#forth")
page.key("End")
assert data("frame") == "5"
page.key("?")
assert page.value("document.querySelector('#help').open")
END
}

@test "browser: between two frames the figure is between them" {
    poses cube 3
    must vg-view pose*.obj -o page.html
    browse page.html '#frame=0' <<'END'
first = page.picture()
page.key("ArrowRight")
second = page.picture()
page.key("Home")
for _ in range(3):
    page.key("<")
for _ in range(30):  # until it stops between two frames
    page.key(" ")
    page.settle()
    page.key(" ")
    page.settle()
    part = float(page.value("document.documentElement.dataset.part"))
    if 0.02 < part < 0.98:
        break
between = page.picture()
assert 0 < part < 1 and between[2] != first[2] and between[2] != second[2], part
END
}

@test "browser: what is under the pointer is read out, and a click pins it with its path" {
    poses cube 3
    must vg-view pose*.obj -o page.html
    browse page.html '#frame=0' <<'END'
data = lambda name: page.value(f"document.documentElement.dataset.{name}")
box = page.value("(r => [r.x, r.y, r.width, r.height])(document.querySelector('#canvas').getBoundingClientRect())")
x, y = box[0] + box[2] / 2, box[1] + box[3] / 2
before = page.picture()
page.call("Input.dispatchMouseEvent", type="mouseMoved", x=x, y=y)
page.wait("document.documentElement.dataset.hovered")
text = page.value("document.querySelector('#readout').innerText")
assert text.startswith("vertex " + data("hovered")) and "face" in text and "at " in text, text
page.call("Input.dispatchMouseEvent", type="mousePressed", x=x, y=y, button="left", buttons=1, clickCount=1)
page.call("Input.dispatchMouseEvent", type="mouseReleased", x=x, y=y, button="left", clickCount=1)
page.wait("document.documentElement.dataset.pinned")
page.call("Input.dispatchMouseEvent", type="mouseMoved", x=box[0] + 3, y=box[1] + 3)
assert not data("hovered") and page.value("!document.querySelector('#readout').hidden")
page.settle()
assert page.picture()[2] != before[2]  # the path and the point
page.key("Escape")
page.wait("document.querySelector('#readout').hidden")
END
}

@test "browser: two sequences one over another, and with a line to wipe" {
    poses cube 2
    mesh tetra >other.obj
    must vg-view pose*.obj --beside other.obj -o page.html
    browse page.html '#frame=0' <<'END'
beside = page.picture()
page.key("l")
over = page.picture()
assert over[2] != beside[2] and share_drawn(over) > 0.02
page.key("l")
page.wait("!document.querySelector('#wipe').hidden")
wiped = page.picture()
assert wiped[2] != over[2]
page.value("document.querySelector('#wipe').focus()")
for _ in range(10):
    page.key("ArrowRight")
assert page.value("document.querySelector('#wipe').getAttribute('aria-valuenow')") == "70"
assert page.picture()[2] != wiped[2]
page.wait("location.hash.includes('layout=wipe')")
END
}

@test "browser: a character has the colours and the picture of its materials, tells them, and keeps them when graphics are lost" {
    PYTHONPATH="$ROOT/tests" python3 -c 'import make_character; make_character.main("c.glb")'
    pipe 'vg-encode -q c.glb | vg-view -o page.html'
    pipe 'vg-encode -q c.glb | vg-view --plain -o plain.html'
    grep -q 'data-list="materials"' page.html
    py <<'END'
import base64, json, make_character, re
text = open("page.html").read()
facts = json.loads(re.search(r'<script type="application/json" id="facts">(.*?)</script>', text, re.S).group(1))
cloth, skin = facts["sequences"][0]["materials"]
assert (cloth["name"], cloth["picture"], skin["name"], skin.get("picture")) == ("Cloth", 0, "Skin", None)
head, data = facts["sequences"][0]["pictures"][0].split(",")
assert head == "data:image/png;base64" and base64.b64decode(data) == make_character.picture()
END
    browse page.html '#frame=0&view=20,10' <<'END'
def vivid(picture): # pixels whose colour is far from any grey
    return sum(max(row[3 * x:3 * x + 3]) - min(row[3 * x:3 * x + 3]) > 110 for row in picture[2] for x in range(picture[0]))
assert page.value("document.querySelector('#colour').value") == "materials"
before = page.picture()
page.value("location.hash = '#frame=0&view=20,10&colour=plain'")
page.wait("document.querySelector('#colour').value === 'plain'")
plain = page.picture()
assert vivid(before) > 500 and vivid(before) > 20 * vivid(plain), (vivid(before), vivid(plain))
page.value("location.hash = '#frame=0&view=20,10&colour=materials'")
page.wait("document.querySelector('#colour').value === 'materials'")
assert page.picture()[2] == before[2]
box = page.value("(r => [r.x, r.y, r.width, r.height])(document.querySelector('#canvas').getBoundingClientRect())")
told = set()
for k in range(1, 10):
    for j in range(1, 10):
        page.call("Input.dispatchMouseEvent", type="mouseMoved", x=box[0] + box[2] * k / 10, y=box[1] + box[3] * j / 10)
        told |= {n for n in ("Cloth", "Skin") if n in (page.value("document.querySelector('#readout').innerText") or "")}
assert told == {"Cloth", "Skin"}, told
page.call("Input.dispatchMouseEvent", type="mouseMoved", x=box[0] + 2, y=box[1] + 2)
page.value("window.lose = document.querySelector('#canvas').getContext('webgl2').getExtension('WEBGL_lose_context'), window.lose.loseContext()")
page.wait("document.querySelector('#message').innerText.includes('reset')")
page.value("window.lose.restoreContext()")
page.wait("document.querySelector('#message').hidden")
page.settle()
assert page.picture()[2] == before[2]
page.trouble = [t for t in page.trouble if "CONTEXT_LOST" not in str(t)]
END
    browse plain.html <<'END'
assert page.value("document.querySelector('#colour').value") != "materials"
END
}

@test "browser: graphics that are lost come back" {
    poses cube 2
    must vg-view pose*.obj -o page.html
    browse page.html '#frame=1' <<'END'
before = page.picture()
page.value("window.lose = document.querySelector('#canvas').getContext('webgl2').getExtension('WEBGL_lose_context'), window.lose.loseContext()")
page.wait("document.querySelector('#message').innerText.includes('reset')")
page.value("window.lose.restoreContext()")
page.wait("document.querySelector('#message').hidden")
page.settle()
assert page.picture()[2] == before[2]
page.trouble = [t for t in page.trouble if "CONTEXT_LOST" not in str(t)]
END
}

@test "browser: on a phone nothing lies over the figure, and nothing is wider than the screen" {
    poses cube 3
    mkdir truth
    cp pose*.obj truth
    for i in 1 2 3; do mesh cube 0.4 0.1 >"pose$i.obj"; done
    must vg-view pose*.obj --against truth -o page.html
    browse page.html '#frame=1' <<'END'
page.call("Emulation.setDeviceMetricsOverride", width=320, height=640, deviceScaleFactor=1, mobile=True)
page.settle()
assert page.value("document.documentElement.scrollWidth") <= 320
over = page.value("(a => (b => a.bottom > b.top + 1 && a.top < b.bottom - 1)(document.querySelector('#legend').getBoundingClientRect()))(document.querySelector('#canvas').getBoundingClientRect())")
assert over is False
assert page.value("document.querySelector('#canvas').clientHeight") > 150
END
}

@test "browser: two sequences side by side, errors with a legend, and each can be picked" {
    poses cube 3
    mkdir truth
    cp pose*.obj truth
    for i in 1 2 3; do mesh cube 0.4 0.1 >"pose$i.obj"; done
    mesh tetra >other.obj
    must vg-view pose*.obj --against truth --beside other.obj -o page.html
    browse page.html '#frame=1' <<'END'
shown = lambda: page.value("document.documentElement.dataset.shown")
text = lambda at: page.value(f"document.querySelector('{at}').textContent")
assert shown() == "1,2,3"
picture = page.picture()
assert all(share_drawn(picture, i / 3, (i + 1) / 3) > 0.01 for i in range(3))
assert "mean error" in text("#captions") and "truth" in text("#captions") and "other.obj" in text("#captions")
assert page.value("document.querySelector('#legend').offsetHeight") > 20 and "truth" in text("#legend")
assert page.value("document.querySelector('#graph').getBoundingClientRect().height") > 10
page.key("c")
assert page.picture()[2] != picture[2] and page.value("document.querySelector('#legend').offsetHeight") == 0
page.key("1")
page.click("#shown button:nth-child(3)")
assert shown() == "2"
assert share_drawn(page.picture()) > 0.02
page.key("2")
assert shown() == "2" # one stays
page.key("0")
assert shown() == "1,2,3"
END
}

@test "patches are colours: those of the stream, or others that fit it" {
    poses cube 3
    mesh tetra >tetra.obj
    pipe 'vg-encode pose1.obj pose2.obj pose3.obj | vg-segment --patches 3 -o cube.patches'
    must vg-view cube.patches -o reference.html
    must vg-view pose*.obj --patches cube.patches -o page.html
    grep -q '"patches":3' reference.html
    grep -q 'data-list="patches"' page.html
    must_fail 3 vg-view pose1.obj --patches pose2.obj -o none.html
    says "'pose2.obj' holds no patches: make them with vg-segment"
    must_fail 3 vg-view tetra.obj --patches cube.patches -o none.html
    [ ! -e none.html ]
    browse page.html <<'END'
assert page.value("document.querySelector('#legend-text').textContent") == "3 patches, a colour each"
coloured = page.picture()
page.key("c")
assert page.picture()[2] != coloured[2]
END
}

@test "browser: a rig without frames is shown in its reference pose, with its bones and their names; as a picture, too" {
    must vg-encode --reference "$DATA/trex.rest.obj" --take 0-28/4 "$DATA/trex-attack.tar.xz" -o poses.vgs
    must vg-fitmap -q --skeleton "$DATA/trex.skeleton.txt" poses.vgs -o trex.rig
    must vg-view trex.rig -o rig.html
    must vg-view trex.rig --look-at Head --zoom 2 -o rig.png
    must_fail 2 vg-view trex.rig --look-at Nose -o no.png
    browse rig.html '#view=60,10' <<'END'
facts = page.value("JSON.parse(document.querySelector('#facts').textContent).sequences[0]")
assert "Head" in facts["joints"] and len(facts["jointsAt"]) == 3 * len(facts["joints"]) and len(facts["names"]) == 1
box = page.value("(r => [r.x, r.y, r.width, r.height])(document.querySelector('#canvas').getBoundingClientRect())")
with_bones = page.picture()
page.key("j")
assert page.picture()[2] != with_bones[2]
page.key("j")
assert page.picture()[2] == with_bones[2]
assert 0.02 < share_drawn(with_bones) < 0.9
END
}

@test "browser: bones, points, no extent, and a page that is cut short" {
    printf 'v 0 0 0\nv 0 1 0\nv 1 1 0\nl 1 2\nl 2 3\n' >bones.obj
    printf 'v 0 0 0\nv 1 2 3\nv 1 0 0\n' >points.obj
    printf 'v 1 1 1\nv 1 1 1\nv 1 1 1\nf 1 2 3\n' >same.obj
    local name
    for name in bones points; do
        must vg-view "$name.obj" -o "$name.html"
        browse "$name.html" <<<'assert 0.0001 < share_drawn(page.picture()) < 0.3'
    done
    printf 'v 0 0 0\nv 0 1 0\nv 1 1.3 0\nl 1 2\nl 2 3\n' >moved.obj
    must vg-view bones.obj --against moved.obj -o compared.html
    browse compared.html '#show=1&view=0,0' <<'END'
def yellow():  # above the legend
    width, height, rows = page.picture()
    return sum(row[i + 1] > 180 and row[i] > 150 and row[i + 2] < 110 for row in rows[:height // 2] for i in range(0, 3 * width, 3))
assert yellow() > 20, yellow()
page.key("c")
assert yellow() == 0
END
    must vg-view same.obj -o same.html
    browse same.html <<<'page.picture()'
    head -c 20000 bones.html >cut.html
    must env PYTHONPATH="$ROOT/tests" python3 - cut.html <<'END'
import sys
from page_driver import *
with Page(sys.argv[1]) as page:
    page.wait("document.body && document.querySelector('#message')")
    assert "not whole" in page.value("document.querySelector('#message').innerText")
END
}

@test "scales and heat: the numbers of a page are those that Python finds, and the ends of the colours fit them" {
    poses strip 4
    mkdir truth
    for i in 1 2 3 4; do mesh strip "0.0$i" 0.5 >"truth/t$i.obj"; done
    must vg-view pose*.obj --scales --beside truth -o scales.html
    must vg-encode pose1.obj pose2.obj pose3.obj pose4.obj -o poses.vgs
    pipe 'vg-diff truth poses.vgs --heat - | vg-view -o heat.html'
    must vg-view poses.vgs --against truth -o against.html
    py scales.html heat.html against.html <<'END'
import json, math, re, sys
scales, heat, against = (json.loads(re.search(r'id="facts">(.*?)</script>', open(p).read()).group(1)) for p in sys.argv[1:])
def load(name):
    lines = [l.split() for l in open(name)]
    return [[float(x) for x in l[1:]] for l in lines if l[0] == "v"], [[int(x) - 1 for x in l[1:]] for l in lines if l[0] in "fl"]
def lengths(points, faces):
    out = []
    for face in faces:
        mean = [sum(points[v][k] for v in face) / len(face) for k in range(3)]
        out += [(v, math.dist(points[v], mean)) for v in face]
    return out
assert scales["tint"]["kind"] == "scales" and scales["tint"]["low"] == -scales["tint"]["high"]
beyond, far = scales["scale"] - 1, max(scales["max"], 1 / scales["least"]) - 1  # the 99th percentile, to two digits
assert 0.5 * far < beyond < 1.11 * far, (beyond, far)
for number, name in ((0, "pose%d.obj"), (1, "truth/t%d.obj")):
    about, (rest, faces) = scales["sequences"][number], load(name % 1)
    reference = lengths(rest, faces)
    for i in range(4):
        ratios = {}
        for (v, a), (_, b) in zip(reference, lengths(load(name % (i + 1))[0], faces)):
            ratios.setdefault(v, []).append(b / a)
        mean = lambda x: math.exp(sum(map(math.log, x)) / len(x))
        each = [mean(r) for r in ratios.values()]
        for key, want in (("means", mean(each)), ("minima", min(each)), ("maxima", max(each))):
            assert abs(about[key][i] - want) < 1e-6, (name, i, key, about[key][i], want)
assert scales["least"] < 1 < scales["max"]
tint = heat["tint"]
assert (tint["kind"], tint["unit"], tint["low"], tint["diverging"]) == ("scalars", "D", 0, False) and tint["title"].startswith("error")
assert heat["sequences"][0]["means"] == against["sequences"][0]["means"] and heat["scale"] == against["scale"] == tint["high"]
assert "tint" in against and len(heat["sequences"]) == 1
END
}

@test "browser: heat and scales as colours with their legends; they can be switched off" {
    poses cube 3
    mkdir truth
    for i in 1 2 3; do mesh cube "0.2$i" "0.0$i" >"truth/t$i.obj"; done
    pipe 'vg-encode pose1.obj pose2.obj pose3.obj | vg-diff truth - --heat heat.vgs -o report'
    must vg-view heat.vgs -o heat.html
    browse heat.html '#frame=2' <<'END'
text = lambda at: page.value(f"document.querySelector('{at}').textContent")
assert text("#legend-text").startswith("error in units of D") and page.value("document.querySelector('#legend').offsetHeight") > 20
assert text("#captions").startswith("mean ") and " D, max " in text("#captions")
assert page.value("document.querySelector('#colour').value") == "scalars"
coloured = page.picture()
page.key("c")
assert page.picture()[2] != coloured[2] and page.value("document.querySelector('#legend').offsetHeight") == 0
page.key("c")
assert page.picture()[2] == coloured[2]
END
    must vg-view heat.vgs --scales --beside truth --zoom 1.5 -o scales.html
    browse scales.html '#frame=2&colour=scales' <<'END'
text = lambda at: page.value(f"document.querySelector('{at}').textContent")
assert text("#legend-text").startswith("length of vectors")
numbers = page.value("[...document.querySelector('#legend-numbers').children].map((x) => x.textContent).join(' ')")
ends = page.value("(f => [f.least, f.max, f.scale])(JSON.parse(document.querySelector('#facts').textContent))")
first, last = (float(numbers.split(" ")[i].strip("\u2264\u2265\u00d7")) for i in (0, -1)) if "\u2264" not in numbers and "\u2265" not in numbers else (None, None)
assert first is None or abs(first / min(ends[0], 1) - 1) < 0.01 and abs(last / max(ends[1], 1) - 1) < 0.01, (numbers, ends)
assert text("#captions").count(" to ") == 2
coloured = page.picture()
page.key("c")
plain = page.picture()
assert plain[2] != coloured[2]
END
    must vg-view heat.vgs --plain -o plain.html
    browse plain.html <<'END'
assert page.value("document.querySelector('#legend').offsetHeight") == 0
assert page.value("document.querySelector('#colour').options.length") == 1
END
}

@test "names and titles that are no UTF-8, or long, are text all the same" {
    mesh cube >$'n\xff.obj'
    long=$(printf 'é%.0s' {1..70}).obj
    mesh cube 0.1 >"$long"
    must vg-view $'n\xff.obj' --beside "$long" --title $'t\xff<é' -o out.html
    py <<'END'
import json, re
page = open("out.html", "rb").read().decode()
facts = json.loads(re.search(r'id="facts">(.*?)</script>', page).group(1))
assert [s["label"] for s in facts["sequences"]] == ["n?.obj", "é" * 60], facts["sequences"]
assert facts["title"] == "t?<??" and "<title>t?&lt;??</title>" in page
END
}

@test "times that do not grow are no times to play by" {
    py <<'END'
import make_corpus as m
for name, times in ("grow", (0, 0.5)), ("same", (1, 1)):
    m.write(name + ".vgs", m.whole(m.content(frames=[m.pose("p%d" % i, m.POINTS[:4], time=t) for i, t in enumerate(times)])))
END
    for name in grow same; do must vg-view $name.vgs -o $name.html; done
    py <<'END'
import json, re
facts = [json.loads(re.search(r'id="facts">(.*?)</script>', open(p + ".html").read()).group(1)) for p in ("grow", "same")]
grow, same = (f["sequences"][0] for f in facts)
assert grow["times"] == [0, 0.5] and "times" not in same
END
}
