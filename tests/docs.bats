#!/usr/bin/env bats
# The manual says what the programs do: pages, options, examples, and the worked example of the stream's specification.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# page_section PAGE SECTION: its lines, as written
page_section() {
    awk -v want=".Sh $2" '/^\.Sh /{on = ($0 == want)} on && !/^\.Sh /' "$1"
}

# synopsis_of_page PAGE, synopsis_of_help PROGRAM: what follows the program's name, blanks squeezed
synopsis_of_page() {
    mandoc -Tascii -O width=200 "$1" | sed 's|.\x08||g' | awk '/^[A-Z]/{on = ($0 == "SYNOPSIS")} on && !/^[A-Z]/' |
        tr -s ' \t\n' ' ' | sed 's/^ *[a-z-]* //; s/ $//'
}
synopsis_of_help() {
    "$1" --help | sed -n '1s/^usage: [a-z-]* //p' | tr -s ' \t' ' '
}

# options_of_page PAGE, options_of_help PROGRAM: lines of "-o --output" or "--json", sorted
options_of_page() {
    page_section "$1" OPTIONS | awk '/^\.It Fl /{
        line = ""
        for (i = 2; i <= NF; i++)
            if ($i == "Fl" && $(i + 1) == "Fl") { line = line " --" $(i + 2); i += 2 }
            else if ($i == "Fl") { line = line " -" $(i + 1); i++ }
        print substr(line, 2)
    }' | LC_ALL=C sort
}
options_of_help() {
    "$1" --help | sed -n 's/^  \(-[a-zA-Z]\), \(--[a-z0-9-]*\).*/\1 \2/p; s/^      \(--[a-z0-9-]*\).*/\1/p' | LC_ALL=C sort
}

# examples_of PAGE FILE: each literal block of EXAMPLES as a script FILE.1, FILE.2, ...; a block that has lines with "$ " in
# front shows output too, and only these lines are commands
examples_of() {
    page_section "$1" EXAMPLES | awk -v file="$2" '
        function unescape(s) {
            gsub(/\\\(aq/, "\047", s); gsub(/\\\(dq/, "\"", s); gsub(/\\\(ha/, "^", s); gsub(/\\\(ti/, "~", s)
            gsub(/\\-/, "-", s); gsub(/\\&/, "", s); gsub(/\\e/, "\\", s)
            return s
        }
        /^\.Bd /{n++; on = 1; prompt = 0; next}
        /^\.Ed/{on = 0; next}
        on {
            line = unescape($0)
            if (line ~ /^\$ /) { prompt = 1; line = substr(line, 3) }
            else if (prompt && !more) next
            more = line ~ /[\\|]$/
            print line >(file "." n)
        }'
}

# what the examples of all pages find: two bodies of one topology (two components), and what is made of them
prepare_examples() {
    local i
    mkdir walk shapes
    for ((i = 1; i <= 9; i++)); do mesh two "0.$i" >"walk/walk$i.obj"; done
    mesh two >a.obj
    mesh two 0.4 >b.obj
    mesh two 0.2 >c.obj
    for name in horse heavy head neutral rest walk.rest pose1; do cp a.obj $name.obj; done
    LC_ALL=C awk '$1 == "v" {printf "v %.6f %.6f %.6f\n", 1.5 * $2, 0.9 * $3, $4; next} {print}' a.obj >woman.obj
    cp woman.obj target.obj
    cp b.obj pose2.obj
    cp c.obj pose3.obj
    cp b.obj shapes/happy.obj
    cp c.obj shapes/sad.obj
    (cd walk && python3 -m zipfile -c ../walk.zip ./*.obj)
    for name in truth result poses dance; do cp walk.zip $name.zip; done
    vg-encode walk.zip -o result.vgs
    for name in walk poses truth; do cp result.vgs $name.vgs; done
    # the skeleton that twists the cube as walk.zip does, pose by pose
    twisting_skeleton 9 5.7295780 >man.bvh
    twisting_skeleton 4 10 >dance.bvh
}

# twisting_skeleton FRAMES DEGREES: BVH whose upper joint turns by so much more about y in each frame
twisting_skeleton() {
    local i
    printf '%s\n' HIERARCHY 'ROOT spine' '{' 'OFFSET 0 0 0' \
        'CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation' 'JOINT elbow.L' '{' 'OFFSET 0 1 0' \
        'CHANNELS 3 Zrotation Xrotation Yrotation' 'End Site' '{' 'OFFSET 0 1 0' '}' '}' '}' \
        MOTION "Frames: $1" 'Frame Time: 0.04'
    for ((i = 1; i <= $1; i++)); do echo "0 0 0 0 0 0 0 0 $(LC_ALL=C awk "BEGIN { print $i * $2 }")"; done
}

@test "every program has a page, and every page of section 1 a program" {
    must diff <(each_program) <(cd "$ROOT/man" && ls ./*.1 | sed 's/^..//; s/\.1$//')
    for page in vg-stream.5 vg.7; do [ -s "$ROOT/man/$page" ]; done
}

@test "the README has a row for every program, and shows the commands that .ci/run calls" {
    local file
    for file in "$ROOT"/cmd/vg-*.c; do must grep -qF "| \`$(basename "$file" .c)\` |" "$ROOT/README.md"; done
    while IFS= read -r line; do must grep -qF "    $line" "$ROOT/README.md"; done < <(grep '^make ' "$ROOT/.ci/run")
}

@test "pages are without warnings, also of man with 80 columns" {
    for page in "$ROOT"/man/*.[1-9]; do must mandoc -Tlint -W warning "$page"; done
    command -v groff >/dev/null || skip "groff is not installed"
    for page in "$ROOT"/man/*.[1-9]; do must groff -mandoc -Tutf8 -rLL=78n "$page"; done
}

@test "pages have their sections, in order" {
    for page in "$ROOT"/man/*.1; do
        sections=$(sed -n 's/^\.Sh //p' "$page" | grep -v -x -e NUMERICS -e FORMATS -e ENVIRONMENT -e FILES -e CAVEATS -e BUGS)
        [ "$sections" = $'NAME\nSYNOPSIS\nDESCRIPTION\nOPTIONS\nSTREAM\nEXIT STATUS\nEXAMPLES\nSEE ALSO' ] ||
            fail "$page has: $sections"
        grep -q "^\.Nm $(basename "$page" .1)\$" "$page"
    done
}

@test "a page that is referred to exists" {
    grep -ho '^\.Xr vg[a-z-]* [1-9]' "$ROOT"/man/*.[1-9] | sort -u | while read -r _ name section; do
        [ -s "$ROOT/man/$name.$section" ] || fail "there is no $name($section)"
    done
}

@test "-h and the page have the same synopsis" {
    for program in $(each_program); do
        page=$(synopsis_of_page "$ROOT/man/$program.1")
        help=$(synopsis_of_help "$program")
        [ -n "$help" ] && [ "$page" = "$help" ] || fail "$program -h: '$help'" "page: '$page'"
    done
}

@test "-h and the page have the same options" {
    for program in $(each_program); do
        options_of_help "$program" >help
        options_of_page "$ROOT/man/$program.1" >page
        [ "$(wc -l <help)" -ge 4 ]
        diff help page || fail "$program: options of -h (<) and of the page (>) differ"
    done
}

@test "-h and -V: standard output, status 0, the version of the library" {
    version=$(sed -n 's/^#define VG_VERSION "\(.*\)"/\1/p' "$ROOT/lib/vg.h")
    for program in $(each_program); do
        must "$program" -h
        shows "usage: $program "
        same=$output
        must "$program" --help
        [ "$output" = "$same" ]
        must "$program" -V
        shows "$program" "$version"
    done
}

@test "the options that programs share are those of vg(7)" {
    page=$(awk '/^\.Ss What the programs share/{on = 1; next} /^\.Ss/{on = 0} on' "$ROOT/man/vg.7")
    shared=$(printf '%s\n' "$page" | sed -n 's/^\.It Fl . , Fl Fl \([a-z-]*\).*/\1/p; s/^\.It Fl Fl \([a-z-]*\).*/\1/p' | sort)
    [ "$shared" = $'help\njson\nno-provenance\noutput\nquiet\nthreads\nverbose\nversion' ]
    for program in $(each_program); do
        for option in help version quiet verbose output; do
            options_of_help "$program" | grep -q -e "--$option\$" || fail "$program has no --$option"
        done
        grep -q "vg-[a-z]*" <<<"$program"
        grep -q "^\.It Xr $program 1\$" "$ROOT/man/vg.7" || fail "vg(7) does not know $program"
    done
}

@test "the examples of every page run" {
    mkdir scripts files
    for page in "$ROOT"/man/*.[1-9]; do
        name=$(basename "$page")
        examples_of "$page" "scripts/$name"
        [ -e "scripts/$name.1" ] || fail "$page has no example"
    done
    (cd files && prepare_examples)
    for page in "$ROOT"/man/*.[1-9]; do
        name=$(basename "$page")
        cp -r files run
        for script in scripts/"$name".*; do
            must env -C run bash -e -u -o pipefail "$PWD/$script" || fail "an example of $page does not run:" "$(cat "$script")"
        done
        rm -rf run
    done
}

@test "STREAM.md takes the golden stream apart byte by byte" {
    must python3 - "$ROOT/fmt/STREAM.md" "$GOLDEN/smallest.vgs" <<'END'
import re, sys
text = open(sys.argv[1], encoding="utf-8").read()
shown = b""
for offset, data in re.findall(r"^([0-9A-F]{4})  ((?:[0-9A-F]{2} ?){1,8})(?: |$)", text, re.M):
    assert int(offset, 16) == len(shown), offset
    shown += bytes.fromhex(data)
assert shown == open(sys.argv[2], "rb").read()
END
}

@test "the checksums of STREAM.md's test vectors are right" {
    py "$ROOT/fmt/STREAM.md" <<'END'
import re, sys, make_corpus, read_stream
text = open(sys.argv[1], encoding="utf-8").read()
rows = re.findall(r"^\| (no bytes|`\w+`) \| `([0-9A-F]{16})` \| `([0-9A-F ]{23})` \|$", text, re.M)
assert len(rows) == 3
for name, value, shown in rows:
    data = b"" if name == "no bytes" else name.strip("`").encode()
    for function in (make_corpus.xxh64, read_stream.xxh64):
        assert function(data) == int(value, 16)
    assert bytes.fromhex(shown) == int(value, 16).to_bytes(8, "little")
words, value = re.search(r"the ten words ([0-9 ]*), and the digest is `([0-9A-F]{16})`", text).groups()
assert make_corpus.digest(make_corpus.content()["mesh"]) == int(value, 16)
assert make_corpus.xxh64(make_corpus.u64(*map(int, words.split()))) == int(value, 16)
END
}

@test "vg-stream.ksy names every record" {
    for tag in PROV MESH TEXC LABL ASST SELE LINK ANCH REFP SKEL CORR PTCH 'RIG ' SKIN 'MAP ' SIGN NETW FORM FRAM FAIL 'END '; do
        for file in fmt/vg-stream.ksy fmt/STREAM.md man/vg-stream.5; do
            grep -q -e "\"$tag\"" -e "\`$tag\`" -e "^\.It ${tag% }\$" "$ROOT/$file" || fail "$file does not have $tag"
        done
    done
}

# blocks_of FILE: the blocks of shell commands of a text in Markdown, one after the other
blocks_of() {
    awk '/^```sh$/{on = 1; next} /^```$/{on = 0} on' "$1"
}

@test "every key of a report as JSON is in its page" {
    for name in every-header-record asset signal scalars turns rig map coordinates correspondence patches transforms unknown-records vectors; do
        must vg-info --json --frames "$GOLDEN/$name.vgs" -o "vg-info.$name.json"
    done
    must vg-info --json --check "$GOLDEN/smallest.vgs" -o vg-info.check.json
    must vg-info --json --digest "$GOLDEN/smallest.vgs" -o vg-info.digest.json
    must vg-diff --json --frames -t 1 "$GOLDEN/times.vgs" "$GOLDEN/times.vgs" -o vg-diff.all.json
    must_fail 1 vg-diff --json "$GOLDEN/times.vgs" "$GOLDEN/turns.vgs" -o vg-diff.other.json
    py "$ROOT" <<'END'
import glob, json, re, sys
def keys(value):
    if isinstance(value, dict):
        for key, inside in value.items():
            yield key
            yield from keys(inside)
    elif isinstance(value, list):
        for inside in value:
            yield from keys(inside)
for program in "vg-info", "vg-diff":
    with open(f"{sys.argv[1]}/man/{program}.1", encoding="utf-8") as f:
        section = f.read().split(".Ss Report as JSON")[1].split(".Sh ")[0]
    words = set(re.findall(r"[A-Za-z0-9_]+", section))
    said = {key for name in glob.glob(program + ".*.json") for key in keys(json.load(open(name, encoding="utf-8")))}
    assert len(said) > 20 and said <= words, (program, sorted(said - words))
END
}

@test "the tutorial: every command runs, every picture is there and is one that it makes" {
    blocks_of "$ROOT/examples/tutorial.md" >script
    [ "$(grep -c '^vg-' script)" -ge 15 ]
    mkdir work
    must env -C work data="$DATA" bash -e -u -o pipefail ../script
    for picture in $(grep -o '](pictures/[^)]*)' "$ROOT/examples/tutorial.md" | sed 's/](//; s/)//'); do
        [ -s "$ROOT/examples/$picture" ] || fail "there is no $picture"
        made=work/$(basename "$picture" | sed 's/^tutorial-//')
        [ "$(head -c 24 "$made" | tail -c 8 | od -An -tx1)" = "$(head -c 24 "$ROOT/examples/$picture" | tail -c 8 | od -An -tx1)" ] ||
            fail "$picture has another size than what the tutorial makes"
    done
}

# commands_of_readme: its indented lines that begin with a program
commands_of_readme() {
    sed -n 's/^    \(vg-.*\)/\1/p' "$ROOT/README.md"
}

@test "the commands of the README run as they stand, in order, on the files that examples/files.sh makes" {
    commands_of_readme >script
    [ "$(wc -l <script)" -ge 40 ]
    must env BUILD="$BUILD" sh "$ROOT/examples/files.sh" try
    cd try
    while IFS= read -r line; do
        capture bash -e -u -o pipefail -c "$line"
        [ "$status" = 0 ] || fail "status $status: $line" "$stderr"
    done <../script
    # the names in them are those of files, and what the first lines promise is there
    [ -s trex.glb ] && [ -s head.glb ] && [ -s man.glb ]
    must vg-info --frames head.glb
    for shape in shapes/*.obj; do shows "$(basename "$shape" .obj)"; done
}

@test "every format that is known is in vg(7), in the help of vg-decode, and completed" {
    must_fail 2 vg-decode --format nonsense -o out x
    known=$(sed -n "s/.*known are //p" <<<"$stderr" | tr -d ' ' | tr ',' '\n')
    [ "$(wc -l <<<"$known")" -ge 15 ]
    [ "$(LC_ALL=C sort <<<"$known")" = "$(vg-decode --help | sed -n 's/^ *--format //p' | tr '|' '\n' | LC_ALL=C sort)" ]
    table=$(awk '/^\.Ss Formats/{on = 1; next} /^\.S[sh]/{on = 0} on' "$ROOT/man/vg.7")
    for format in $(sed 's/-.*//' <<<"$known" | sort -u); do
        grep -q -i "^\.It .*\<$format\>" <<<"$table" || fail "vg(7) does not have $format"
    done
}
