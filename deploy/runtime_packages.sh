#!/usr/bin/env bash
# Prints the Debian packages that hold the shared libraries the given programs load, one a line.
set -euo pipefail
ldd "$@" | awk '$2 == "=>" && $3 ~ /^\// { print $3 }' | sort -u | while read -r library; do
  dpkg-query -S "*-linux-gnu/$(basename "$(readlink -f "$library")")" | cut -d: -f1 | head -n 1
done | sort -u
