#!/usr/bin/env bats
# Completion for bash: the function is called as bash calls it, with the words of a command line cut at '='.
# SPDX-License-Identifier: GPL-3.0-or-later
load lib.bash

# complete_line WORD...: what is offered for the last word, sorted, one a line, in $offered
complete_line() {
    # shellcheck source=/dev/null
    source "$ROOT/completion/vg.bash"
    COMP_WORDS=("$@") COMP_CWORD=$(($# - 1)) COMPREPLY=()
    _vg "$1" "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD - 1]}"
    offered=$(printf '%s\n' "${COMPREPLY[@]}" | LC_ALL=C sort)
}

offers() {
    [ "$offered" = "$(printf '%s\n' "$@")" ] || fail "offered: $offered" "expected: $*"
}

@test "every program is completed" {
    # shellcheck source=/dev/null
    source "$ROOT/completion/vg.bash"
    must diff <(each_program) <(complete -p | sed -n 's/^complete .* -F _vg //p' | LC_ALL=C sort)
}

@test "all options of a program, and those that begin alike" {
    for program in $(each_program); do
        complete_line "$program" --
        [ "$offered" = "$("$program" --help | grep -o '^  \(-., \|    \)--[a-z0-9-]*' | sed 's/.*--/--/' | LC_ALL=C sort)" ]
        [ "$(wc -l <<<"$offered")" -ge 5 ]
    done
    complete_line vg-play --in
    offers --interpolate
    complete_line vg-solve walk.vgs --no
    offers --no-provenance
    complete_line vg-solve --nonsense
    offers ''
}

@test "values of fixed choice" {
    complete_line vg-deform --by ''
    offers auto blend gradient offset pose shape
    complete_line vg-deform --onto woman.obj --by g
    offers gradient
    complete_line vg-deform --by =
    offers auto blend gradient offset pose shape
    complete_line vg-deform --by = s
    offers shape
    complete_line vg-deform --root ''
    offers centroid stay
    complete_line vg-segment -k ''
    offers auto
    complete_line vg-diff --of p
    offers p95
    complete_line vg-solve --weights ''
    offers area uniform
    complete_line vg-decode --format g
    offers glb gltf
    complete_line vg-play man.map --interpolate ''
    offers ''
}

@test "files by their kind" {
    mkdir poses
    touch man.obj walk.zip run.tar.xz man.map man.patches marks.txt notes.md 'two words.OBJ' sheet.png
    complete_line vg-encode ''
    offers man.map man.obj man.patches poses run.tar.xz 'two words.OBJ' walk.zip
    complete_line vg-encode --json m # a flag takes no value
    offers man.map man.obj man.patches
    complete_line vg-play ''
    offers man.map poses
    complete_line vg-play --live ''
    offers man.map poses
    complete_line vg-play --at 0,1 man.map ''
    offers man.map man.obj man.patches poses run.tar.xz 'two words.OBJ' walk.zip
    complete_line vg-retarget --onto man.obj ''
    offers man.map poses
    complete_line vg-segment man.obj --onto '' # no option of this program
    offers man.map man.obj man.patches poses run.tar.xz 'two words.OBJ' walk.zip
    complete_line vg-register a.obj b.obj -m ''
    offers marks.txt poses
    complete_line vg-view --patches = ''
    offers man.patches poses
    complete_line vg-poisson --key walk = m
    offers man.map man.obj man.patches
    complete_line vg-solve -o s
    offers sheet.png
    complete_line vg-solve n # nothing that fits: then whatever there is
    offers notes.md
    complete_line vg-diff -- m
    offers man.map man.obj man.patches
}

@test "every program is completed by zsh and fish, too" {
    must diff <(each_program) <(head -n 1 "$ROOT/completion/_vg" | tr ' ' '\n' | grep ^vg- | LC_ALL=C sort)
    must diff <(each_program) <(grep -A 2 '^for program in' "$ROOT/completion/vg.fish" | grep -o 'vg-[a-z]*' | LC_ALL=C sort)
}

@test "fish: options with their help, values of fixed choice" {
    command -v fish >/dev/null || skip "fish is not installed"
    export HOME=$PWD XDG_CONFIG_HOME=$PWD XDG_DATA_HOME=$PWD
    must fish --no-config -c "source '$ROOT/completion/vg.fish'; complete --do-complete 'vg-solve --no-p'"
    [[ $output == --no-provenance$'\t'?* ]]
    must fish --no-config -c "source '$ROOT/completion/vg.fish'; complete --do-complete 'vg-deform --by '"
    [ "$(cut -f 1 <<<"$output" | LC_ALL=C sort | tr '\n' ' ')" = 'auto blend gradient offset pose shape ' ]
    for program in vg-encode vg-diff; do
        must fish --no-config -c "source '$ROOT/completion/vg.fish'; complete --do-complete '$program --'"
        diff <(cut -f 1 <<<"$output" | sed 's/=$//' | LC_ALL=C sort) \
            <("$program" --help | grep -o '^  \(-., \|    \)--[a-z0-9-]*' | sed 's/.*--/--/' | LC_ALL=C sort)
    done
}

@test "zsh: the options that it hands to _arguments are those of the program" {
    command -v zsh >/dev/null || skip "zsh is not installed"
    for program in vg-deform vg-encode; do
        # shellcheck disable=SC2016 # zsh's
        must zsh -f -c 'source <(sed "/^_vg \"/d" "$1"); _vg_specs "$2"' zsh "$ROOT/completion/_vg" "$program"
        diff <(sed -n 's/^\(--[a-z0-9-]*\)[=[].*/\1/p' <<<"$output" | LC_ALL=C sort) \
            <("$program" --help | grep -o '^  \(-., \|    \)--[a-z0-9-]*' | sed 's/.*--/--/' | LC_ALL=C sort)
    done
    must zsh -f -c 'source <(sed "/^_vg \"/d" "$1"); _vg_specs vg-deform' zsh "$ROOT/completion/_vg"
    shows '--by=[' ':(auto offset blend pose gradient shape)' ':(centroid stay)' '-o[write'
}
