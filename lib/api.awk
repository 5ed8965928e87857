# api.awk: the public headers as one HTML page: comments as text, declarations as code, every function and type with an anchor.
# Leaves out what is no interface: guards, includes, C++ brackets.
# SPDX-License-Identifier: GPL-3.0-or-later
function escape(s) {
    gsub(/&/, "\\&amp;", s); gsub(/</, "\\&lt;", s); gsub(/>/, "\\&gt;", s)
    return s
}
function flush_code() {
    if (code != "") body = body "<pre>" code "</pre>\n"
    code = ""
}
function flush_text() {
    if (text != "") body = body "<p>" text "</p>\n"
    text = ""
}
# the name that a line declares at its beginning: a function, a type, a constant
function declared(line,    name) {
    if (match(line, /vg_[a-z0-9_]+\(/) && line !~ /^[ \t]/) return substr(line, RSTART, RLENGTH - 1)
    if (line ~ /^typedef (struct|enum) vg_[a-z0-9_]+/) {
        name = line
        sub(/^typedef (struct|enum) /, "", name); sub(/[^a-z0-9_].*/, "", name)
        return name
    }
    return ""
}
function begin_file() {
    part = FILENAME
    sub(/^lib\//, "", part)
    body = body "<h2 id=\"" part "\">" part "</h2>\n"
    index_html = index_html "<h3><a href=\"#" part "\">" part "</a></h3>\n"
}
FNR == 1 { flush_code(); flush_text(); begin_file() }
/^#(ifndef|endif|include|ifdef|else|if )|^extern "C"|^}$|SPDX-License|^A part of vg\.h/ { next }
/^ \* A part of vg\.h/ { next }
comment || /^\/\*/ {
    if (!comment) flush_code()
    line = $0
    done = line ~ /\*\//
    sub(/^\/\*+ ?/, "", line); sub(/^ \*\/?/, "", line); sub(/ *\*\/ *$/, "", line)
    if (line ~ /^ ? ? ?$/) flush_text()
    else if (line ~ /^    ?/) { flush_text(); body = body "<pre>" escape(line) "</pre>\n" }
    else text = text (text == "" ? "" : "\n") escape(line)
    comment = !done
    if (done) flush_text()
    next
}
/^$/ { flush_code(); next }
{
    name = declared($0)
    line = escape($0)
    if (name != "" && !(name in seen)) {
        seen[name] = 1
        line = "<span id=\"" name "\"></span>" line
        index_html = index_html "<a href=\"#" name "\">" name "</a>\n"
    }
    code = code line "\n"
}
END {
    flush_code(); flush_text()
    gsub(/<\/pre>\n<pre>/, "\n", body)
    print "<!DOCTYPE html>\n<html lang=\"en\">\n<meta charset=\"utf-8\">\n<title>libvg " version "</title>"
    print "<style>body{font:16px/1.5 sans-serif;max-width:60em;margin:2em auto;padding:0 1em}"
    print "pre{background:#f4f4f2;padding:.6em .8em;overflow-x:auto;font-size:14px}nav{columns:18em;font-size:14px}nav a{display:block}"
    print "p{white-space:normal}h3{margin:.6em 0 0}:target{background:#fe9}</style>"
    print "<h1>libvg " version "</h1>\n<nav>\n" index_html "</nav>\n" body "</html>"
}
