"""fail_each.py LIBRARY MOST -- PROGRAM ARGUMENT...: run a program again and again, with the first of its allocations failing,
the second, and so on until it does not matter; then with all failing from the first, from the second, ...

Runs in the current directory, which the program must leave as it was unless it succeeds; then as a run without failures
leaves it. Of more than MOST allocations (0: no limit), the first
MOST / 2 and as many more, evenly spread, are tried. Prints what went
wrong; status 1 if anything did.
SPDX-License-Identifier: GPL-3.0-or-later
"""
import os
import subprocess
import sys

TIMEOUT = 60
TALKERS = ("libgomp: ", "Fatal Internal Error in libarchive")  # say it themselves, and call exit
OURS = {"./.count", "./.stdout", "./.stderr"}


def contents():
    paths = (os.path.join(directory, name) for directory, _, names in os.walk(".") for name in names)
    return {path: open(path, "rb").read() for path in paths if path not in OURS}


def run(library, command, failing=None):
    preload = " ".join(filter(None, [os.environ.get("ASAN_RUNTIME"), library]))
    environment = dict(os.environ, LD_PRELOAD=preload, FAIL_COUNT=os.path.abspath(".count"), OPENBLAS_NUM_THREADS="1")
    # libarchive 3.6 follows pointers that it has not got; Jansson 2.14 asserts when the first refusal was not the last
    environment["FAIL_SPARE"] = "libarchive,libjansson" if failing and failing.endswith("+") else "libarchive"
    asan = environment.get("ASAN_OPTIONS", "")
    # what a program that stops at once still holds is the kernel's to free
    environment["ASAN_OPTIONS"] = asan + ":verify_asan_link_order=0:detect_leaks=0:allocator_may_return_null=1"
    if failing:
        environment["FAIL_MALLOC"] = failing
    return subprocess.run(command, env=environment, stdin=subprocess.DEVNULL, capture_output=True, timeout=TIMEOUT)


def chosen(count, most):
    if most == 0 or count <= most:
        return list(range(1, count + 1))
    first = most // 2
    return list(range(1, first + 1)) + [first + 1 + i * (count - first - 1) // (most - first - 1) for i in range(most - first)]


def restore(before):
    now = contents()
    for path in set(now) - set(before):
        os.remove(path)
    for path, data in before.items():
        if now.get(path) != data:
            with open(path, "wb") as f:
                f.write(data)


def judge(result, before, whole, whole_output):
    """What is wrong with a run in which memory ran out, or None."""
    said = result.stderr.decode("utf-8", "replace")
    after = contents()
    if result.returncode == 0:
        return None if after == whole and result.stdout == whole_output else "done, but with another result"
    if result.returncode != 4:
        return f"status {result.returncode}"
    lines = [line for line in said.splitlines() if line]
    if len(lines) > 1 and any(lines[0].startswith(name) for name in TALKERS):
        lines = lines[1:]
    if len(lines) != 1 or not lines[0].startswith("vg-") or "memory" not in lines[0]:
        return "not one line on standard error about memory"
    if after != before:
        return f"left or changed files: {sorted(set(after) ^ set(before)) or 'contents'}"
    return None


def main():
    library, most, dash, *command = sys.argv[1:]
    assert dash == "--"
    before = contents()
    first = run(library, command)
    if first.returncode != 0:
        sys.exit(f"'{' '.join(command)}' fails without failing allocations: {first.stderr.decode()}")
    count = int(open(".count").read())
    whole = contents()
    failures = refused = 0
    for suffix in ("", "+"):
        for n in chosen(count, int(most)):
            restore(before)
            try:
                result = run(library, command, f"{n}{suffix}")
                wrong = judge(result, before, whole, first.stdout)
                refused += result.returncode == 4
                said = result.stderr.decode("utf-8", "replace")[-1500:]
            except subprocess.TimeoutExpired:
                wrong, said = "it hangs", ""
            if wrong:
                failures += 1
                print(f"{' '.join(command)}: allocation {n}{suffix} of {count}: {wrong}\n{said}")
    restore(before)
    print(f"{' '.join(command)}: {count} allocations, {refused} refusals, {failures} failures")
    if refused == 0:
        sys.exit("no allocation ever failed: the library was not preloaded")
    sys.exit(failures > 0)


main()
