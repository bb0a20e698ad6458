#!/usr/bin/env bash
# Installs what deploy/apt-packages.txt lists and this machine lacks. Does nothing, and needs no
# rights, when everything is there.
#   bash deploy/install.sh            what building, running and testing need
#   bash deploy/install.sh --farm     also the engines that the tests of deploy/ run a farm on
#   bash deploy/install.sh --charts   also what draws charts: build/charts/node_modules/.bin/vl2svg,
#                                     from the npm packages of deploy/charts/, pinned
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

as_root() {
  if [ "$(id -u)" -eq 0 ]; then
    "$@"
  else
    command -v sudo >/dev/null ||
      { echo "not root and no sudo: run by hand: $*" >&2; return 1; }
    sudo "$@"
  fi
}

install_packages() {
  local missing=() package
  for package in "$@"; do
    dpkg-query -W -f='${Status}' "$package" 2>/dev/null | grep -q 'ok installed' ||
      missing+=("$package")
  done
  [ ${#missing[@]} -eq 0 ] && return 0
  echo "installing: ${missing[*]}" >&2
  export DEBIAN_FRONTEND=noninteractive
  as_root apt-get update -q >&2
  as_root apt-get install -y -q --no-install-recommends "${missing[@]}" >&2
}

install_charts() {
  local place=$here/../build/charts
  command -v npm >/dev/null || install_packages nodejs npm
  [ -x "$place/node_modules/.bin/vl2svg" ] &&
    cmp -s "$here/charts/package-lock.json" "$place/installed.json" && return 0
  echo "installing: vl2svg" >&2
  mkdir -p "$place"
  cp "$here/charts/package.json" "$here/charts/package-lock.json" "$place/"
  (cd "$place" && npm ci --ignore-scripts --no-audit --no-fund --loglevel=error >&2)
  cp "$here/charts/package-lock.json" "$place/installed.json"
}

install_list() {
  local packages
  mapfile -t packages < <(grep -vE '^\s*(#|$)' "$here/$1")
  install_packages "${packages[@]}"
}

install_list apt-packages.txt
case ${1:-} in
  --charts) install_charts ;;
  --farm)
    install_list farm-packages.txt
    # One from elsewhere is as good, and Debian's package would not install beside it.
    command -v kubectl > /dev/null || install_packages kubernetes-client
    ;;
esac
