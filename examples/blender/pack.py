"""pack.py OUT.zip: the add-on vg_tools as Blender installs it, with vgstream.py and COPYING inside. The same files give the same bytes.

SPDX-License-Identifier: GPL-3.0-or-later
"""
import os
import sys
import zipfile

here = os.path.dirname(os.path.abspath(__file__))
files = {name: os.path.join(here, "vg_tools", name) for name in os.listdir(os.path.join(here, "vg_tools")) if name.endswith(".py")}
files["vgstream.py"] = os.path.join(here, "..", "python", "vgstream.py")
files["COPYING"] = os.path.join(here, "..", "..", "COPYING")

out = sys.argv[1]
os.makedirs(os.path.dirname(out) or ".", exist_ok=True)
with zipfile.ZipFile(out + ".part", "w", zipfile.ZIP_DEFLATED) as made:
    for name in sorted(files):
        entry = zipfile.ZipInfo("vg_tools/" + name, (2026, 1, 1, 0, 0, 0))
        entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
        with open(files[name], "rb") as file:
            made.writestr(entry, file.read())
os.replace(out + ".part", out)
