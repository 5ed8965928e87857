# vg.fish: completion of the vg programs for fish. What a program takes is asked of the program (--help), once a shell.
# SPDX-License-Identifier: GPL-3.0-or-later

function __vg_learn --argument-names program
    for line in ($program --help 2>/dev/null)
        # "  -o, --output FILE   text", "      --json   text"
        string match --quiet --regex '^  (?:-(?<short>[a-zA-Z]), |    )--(?<long>[a-z0-9-]+)(?: (?<value>[^ ]+))?(?: +(?<help>.*))?$' -- $line
        or continue
        set -l options --command $program --long-option $long --description "$help"
        test -z "$short"; or set options $options --short-option $short
        if string match --quiet '*|*' -- "$value"
            set -l words (string split '|' -- $value | string match --regex --invert '[A-Z]')
            set options $options --exclusive --arguments "$words"
        else if test -n "$value"
            set options $options --require-parameter
        end
        complete $options
    end
end

for program in vg-decode vg-deform vg-diff vg-encode vg-features vg-fitmap vg-fitsignal vg-generate vg-info vg-interpolate vg-play vg-poisson \
        vg-register vg-retarget vg-sample vg-segment vg-smooth vg-solve vg-train vg-view
    if command --query $program; and not contains -- $program $__vg_learnt
        set --global --append __vg_learnt $program
        __vg_learn $program
    end
end
