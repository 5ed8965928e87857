#!/bin/sh
# install-packages.sh LIST: install the Debian packages named in LIST, one a line; does nothing when all are there.
set -eu
missing=
for p in $(sed 's/#.*//' "$1"); do
    dpkg-query -W -f '${Status}\n' "$p" 2>/dev/null | grep -q '^install ok installed' || missing="$missing $p"
done
[ -n "$missing" ] || exit 0
echo "installing:$missing"
sudo=
[ "$(id -u)" = 0 ] || sudo=sudo
export DEBIAN_FRONTEND=noninteractive
$sudo apt-get update -q
# shellcheck disable=SC2086 # one word a package
$sudo apt-get install -y -q --no-install-recommends $missing
