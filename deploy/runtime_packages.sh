#!/usr/bin/env bash
# Prints the Debian packages that hold the shared libraries the given programs load, one a line.
set -euo pipefail
# By whole paths, which dpkg finds at once; with and without /usr, since packages say either.
ldd "$@" | awk '$2 == "=>" && $3 ~ /^\// { print $3 }' | sort -u | while read -r library; do
  library=$(readlink -f "$library")
  echo "/${library#/usr/}"
  echo "/usr/${library#/usr/}"
done | { xargs dpkg-query -S 2> /dev/null || true; } | cut -d: -f1 | sort -u
