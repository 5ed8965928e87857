#!/usr/bin/env bats
# vg-view --pick: a page on which pairs of points are picked, driven in Chromium.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# write_pair: a.obj, a man; b.obj, the same turned by 20 degrees about y, twice as large, elsewhere, its vertices in reverse order
write_pair() {
    xz -dc "$DATA/walk-man.rest.obj.xz" >a.obj
    py <<'END'
import math
points = [[float(x) for x in line.split()[1:]] for line in open("a.obj") if line.startswith("v ")]
faces = [[int(x) for x in line.split()[1:]] for line in open("a.obj") if line.startswith("f ")]
n, c, s = len(points), 2 * math.cos(math.radians(20)), 2 * math.sin(math.radians(20))
with open("b.obj", "w") as out:
    for x, y, z in points[::-1]:
        out.write(f"v {c * x + s * z + 3:.7f} {2 * y - 1:.7f} {c * z - s * x:.7f}\n")
    for face in faces:
        out.write("f " + " ".join(str(n + 1 - v) for v in face) + "\n")
END
}

# browse CODE: with Page, json and the points of a.obj as `points`, a page of both as `page`
browse() {
    command -v chromium >/dev/null || command -v google-chrome >/dev/null || skip "no browser to look with"
    PYTHONPATH=$ROOT/tests py "$@" 3>&-
}

@test "--pick: clicks, suggestions, undo, mirror, load, save; vg-register takes what is saved" {
    write_pair
    must vg-view a.obj --beside b.obj --pick -o pick.html
    cp a.obj c.obj
    must vg-view a.obj --beside c.obj --pick -o mirror.html
    browse <<'END'
import json
from page_driver import Page
points = [[float(x) for x in line.split()[1:]] for line in open("a.obj") if line.startswith("v ")]
n = len(points)
with Page("pick.html", seconds=240) as page:
    page.loaded()
    data = lambda name: page.value(f"document.documentElement.dataset.{name}")
    pairs = lambda: [p.split(":") for p in data("pairs").split()]

    def load(text):
        page.value(f"""(() => {{ const d = new DataTransfer(); d.items.add(new File([{json.dumps(text)}], "m.txt"));
            const f = document.querySelector("#pair-file"); f.files = d.files; f.dispatchEvent(new Event("change")); }})()""")
        page.settle()

    def under(x, y):
        """The vertex under a place of the canvas, as the page says it when the mouse is there."""
        left, top = page.value("(r => [r.x, r.y])(document.querySelector('#canvas').getBoundingClientRect())")
        page.call("Input.dispatchMouseEvent", type="mouseMoved", x=left + x, y=top + y)
        page.settle()
        return data("hovered"), left + x, top + y

    def find(share):
        """A place on the figure in the panel at a share of the width."""
        w, h = page.value("(c => [c.clientWidth, c.clientHeight])(document.querySelector('#canvas'))")
        for dy in range(0, 200, 20):
            for dx in (0, 15, -15, 30, -30):
                v, x, y = under(share * w + dx, h / 2 - 60 + dy)
                if v:
                    return int(v), x, y
        raise AssertionError("nothing under the mouse")

    def click(x, y):
        for kind in ("mousePressed", "mouseReleased"):
            page.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)
        page.settle()

    # a click on each side is a pair; a click on the side that is there corrects it
    a, x, y = find(0.25)
    click(x, y)
    assert pairs() == [["p1", str(a), ""]], pairs()
    assert data("suggested") == ""
    b, x, y = find(0.75)
    click(x, y)
    assert pairs() == [["p1", str(a), str(b)]], pairs()
    page.click("#pair-undo")
    page.settle()
    assert pairs() == [["p1", str(a), ""]], pairs()
    page.click("#pair-undo")
    page.settle()
    assert pairs() == []

    # what is no file of markers changes nothing
    load("x 1 99999999\n")
    page.wait("document.querySelector('#message').textContent.includes('line 1')")
    assert pairs() == []

    # three pairs that are right, one in the middle of the body: the partner of any other point is known
    spread = sorted(range(n), key=lambda i: points[i][0])[5], sorted(range(n), key=lambda i: points[i][1])[-5], sorted(range(n), key=lambda i: points[i][1])[5]
    load("".join(f"m{i} {i} {n - 1 - i}\n" for i in spread))
    page.wait("document.documentElement.dataset.pairs.startsWith('m')")
    assert "mean 0.0 %" in page.value("document.querySelector('#pair-fit').textContent")
    for probe in (300, 700, 1111):
        load("".join(f"m{i} {i} {n - 1 - i}\n" for i in spread) + f"probe {probe}\n")
        page.wait(f"document.documentElement.dataset.pairs.includes('probe:{probe}:')")
        assert data("suggested")[:1] == "b", data("suggested")
        got = n - 1 - int(data("suggested")[1:])
        away = sum((p - q) ** 2 for p, q in zip(points[got], points[probe])) ** 0.5
        assert away < 2e-4, (probe, got, away)  # some vertices of the body coincide with others; positions are quantised
    page.value("document.querySelector('#canvas').focus()")
    page.key("Enter", "\r")
    page.settle()
    assert pairs()[-1] == ["probe", "1111", str(n - 1 - got)], pairs()

    # a wrong pair stands out
    wrong = "".join(f"m{i} {i} {n - 1 - i}\n" for i in (*spread, 300, 700)) + f"wrong 1111 {n - 1 - 20}\n"
    load(wrong)
    page.wait("document.documentElement.dataset.pairs.includes('wrong')")
    rows = page.value("[...document.querySelectorAll('#pair-list .name')].map((x) => x.textContent)")
    left = {row.split()[1]: float(row.split()[2]) for row in rows}
    assert max(left, key=left.get) == "wrong", left

    far = sorted(range(n), key=lambda i: points[i][0])[-5]
    # the colours of what is left over, and the file
    load("".join(f"m{i} {i} {n - 1 - i}\n" for i in (*spread, far)))
    page.wait(f"document.documentElement.dataset.pairs.includes('m{far}')")
    before = page.picture()
    page.click("#pair-colours")
    page.settle()
    assert data("leftOver") == "shown"
    after = page.picture()
    assert before != after
    saved = open(page.saved("#pair-save")).read()
    lines = [line.split() for line in saved.splitlines() if not line.startswith("#")]
    assert lines == [[f"m{i}", str(i), str(n - 1 - i)] for i in (*spread, far)], saved
    open("markers.txt", "w").write(saved)
    assert page.trouble == [], page.trouble

# mirror: across the middle, with left and right exchanged in the name; points in the middle stay alone
with Page("mirror.html", seconds=240) as page:
    page.loaded()
    middle = min(range(n), key=lambda i: abs(points[i][0]))
    load(f"handLeft {far} {far}\nnose {middle} {middle}\n")
    page.wait("document.documentElement.dataset.pairs.startsWith('handLeft')")
    page.click("#pair-mirror")
    page.settle()
    made = pairs()
    assert [p[0] for p in made] == ["handLeft", "nose", "handRight"] and made[2][1] == made[2][2], made
    a = int(made[2][1])
    assert max(abs(s * p - q) for s, p, q in zip((-1, 1, 1), points[far], points[a])) < 1e-3, (points[far], points[a])
    # a pair that was clicked beside the place across is that place's pair
    beside = min((i for i in range(n) if points[i] != points[a]), key=lambda i: sum((p - q) ** 2 for p, q in zip(points[i], points[a])))
    load(f"handLeft {far} {far}\nother {beside} {beside}\n")
    page.wait("document.documentElement.dataset.pairs.includes('other')")
    page.click("#pair-mirror")
    page.settle()
    assert len(pairs()) == 2, pairs()
END
    must vg-register -q a.obj b.obj --markers markers.txt -o pairs.vgs
}

@test "--pick: two meshes and a page; the first frame of each" {
    write_pair
    must_fail 2 vg-view a.obj --pick -o pick.html
    must_fail 2 vg-view a.obj --beside b.obj --pick -o pick.png
    says "'--pick' applies to a page"
    must_fail 2 vg-view a.obj --beside b.obj --beside a.obj --pick -o pick.html
    says 'give --beside once'
    must_fail 2 vg-view a.obj --beside b.obj --pick --scales -o pick.html
    must vg-view "$DATA/horse-run.tar.xz" --beside b.obj --pick -o pick.html
    [ "$(grep -c 'data-frames="places"' pick.html)" = 2 ]
    grep -o '"names":\[[^]]*\]' pick.html >names
    [ "$(grep -o '"names":\[\("[^"]*"\)\]' pick.html | wc -l)" = 2 ]
}
