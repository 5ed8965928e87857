# vg.bash: completion of the vg programs for bash. What a program takes is asked of the program (--help), so that this file knows
# no option by name: an option's value is completed from its place-holder there, as a choice or as a file of some kind.
# Leaves out values that are numbers, and lists with commas. Needs nothing of the package bash-completion but to be found.
# SPDX-License-Identifier: GPL-3.0-or-later
# shellcheck shell=bash

# what is read as a sequence: mesh files, whole sequences, archives, streams
_vg_sequences='obj|ply|off|stl|bvh|glb|gltf|pc2|mdd|npy|npz|zip|7z|tar|tgz|txz|tar.*|xz|gz|zst|vgs|patches|map|rig|signal'

# _vg_value PROGRAM OPTION: the place-holder of its value ("FILE", "pose|shape"); nothing when it takes none or is unknown
_vg_value() {
    local line
    while IFS= read -r line; do
        # "  -o, --output FILE   text", "      --json   text"
        [[ $line =~ ^\ \ (-([a-zA-Z]),\ |\ \ \ \ )--([a-z0-9-]+)(\ ([^ ]+))?(\ |$) ]] || continue
        [[ $2 == "--${BASH_REMATCH[3]}" || $2 == "-${BASH_REMATCH[2]}" ]] || continue
        printf '%s\n' "${BASH_REMATCH[5]}"
        return
    done < <("$1" --help 2>/dev/null)
}

# _vg_options PROGRAM: the long ones
_vg_options() {
    "$1" --help 2>/dev/null | sed -n 's/^  \(-[a-zA-Z], \|    \)\(--[a-z0-9-]*\).*/\2/p'
}

# _vg_choices PLACE-HOLDER: the words of "centroid|stay|V"; what has capitals stands for something else
_vg_choices() {
    local word words
    [[ $1 == *'|'* ]] || return
    IFS='|' read -r -a words <<<"$1"
    for word in "${words[@]}"; do
        [[ $word != "${word,,}" ]] || printf '%s\n' "$word"
    done
}

# _vg_files WORD SUFFIXES: directories, and the files that have one of these suffixes; any files when there are none of them
_vg_files() {
    local file found=0
    while IFS= read -r file; do
        [[ ! -d $file ]] || { COMPREPLY+=("$file") && continue; }
        [[ ! ${file,,} =~ \.($2)$ ]] || { COMPREPLY+=("$file") && found=1; }
    done < <(compgen -f -- "$1")
    [[ $found = 1 ]] || mapfile -t COMPREPLY < <(compgen -f -- "$1")
}

# _vg_complete_value PLACE-HOLDER OPTION WORD
_vg_complete_value() {
    case $1 in
    *'|'*) mapfile -t COMPREPLY < <(compgen -W "$(_vg_choices "$1")" -- "$3") ;;
    MAP) _vg_files "$3" 'map|rig|vgs' ;;
    PATCHES) _vg_files "$3" 'patches|vgs' ;;
    MESH | POSES | SKELETON | OTHER | TRUTH | *=MESH) _vg_files "$3" "$_vg_sequences" ;;
    FILE)
        case $2 in
        -o | --output) mapfile -t COMPREPLY < <(compgen -f -- "$3") ;;
        --patches) _vg_files "$3" 'patches|vgs' ;;
        --correspondence) _vg_files "$3" vgs ;;
        *) _vg_files "$3" 'txt|tsv|csv' ;;
        esac
        ;;
    esac
}

# _vg_operand PROGRAM WORD...: the place-holder of the operand that comes after these words ("MAP", "FILE")
_vg_operand() {
    local program=$1 operands=0 skip='' word
    shift
    for word; do
        if [[ $word == '=' ]]; then
            skip=1
        elif [[ -n $skip ]]; then
            skip=''
        elif [[ $word == -?* ]]; then
            skip=$(_vg_value "$program" "$word")
        else
            operands=$((operands + 1))
        fi
    done
    "$program" --help 2>/dev/null | sed -n '1s/--[a-z]* [A-Z,.]*//g; 1s/^usage: [a-z-]* //p' | grep -o '[A-Z][A-Z]*' |
        sed -n "$((operands + 1))p"
}

# bash cuts words at '=': --by=shape is three of them, and so is walk=a.obj behind --key
_vg() {
    local program=$1 word=${COMP_WORDS[COMP_CWORD]} before='' at=$((COMP_CWORD - 1)) i value
    COMPREPLY=()
    for ((i = 1; i < COMP_CWORD; i++)); do
        [[ ${COMP_WORDS[i]} != -- ]] || { _vg_files "$word" "$_vg_sequences" && return; }
    done
    [[ $word != '=' ]] || { word='' && at=$COMP_CWORD; }
    if ((at > 0)) && [[ ${COMP_WORDS[at]} == '=' ]]; then
        before=${COMP_WORDS[at - 1]} # --by=shape
        [[ $before == -* ]] || before=${COMP_WORDS[at - 2]} # --key walk=a.obj
    elif ((at > 0)); then
        before=${COMP_WORDS[at]}
    fi
    if [[ $before == -?* ]]; then
        value=$(_vg_value "$program" "$before")
        if [[ -n $value ]]; then
            _vg_complete_value "$value" "$before" "$word"
            return
        fi
    fi
    if [[ $word == -* ]]; then
        mapfile -t COMPREPLY < <(compgen -W "$(_vg_options "$program")" -- "$word")
    elif [[ $(_vg_operand "$program" "${COMP_WORDS[@]:1:COMP_CWORD-1}") == MAP ]]; then
        _vg_complete_value MAP '' "$word"
    else
        _vg_files "$word" "$_vg_sequences"
    fi
}

complete -o filenames -F _vg vg-decode vg-deform vg-diff vg-encode vg-features vg-fitmap vg-fitsignal vg-generate vg-info vg-interpolate vg-play vg-poisson vg-register \
    vg-retarget vg-sample vg-segment vg-smooth vg-solve vg-train vg-view
