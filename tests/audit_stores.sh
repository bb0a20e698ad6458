#!/usr/bin/env bash
# Bakes the city of 20 x 20 blocks (5 m cells) and every real scene whole, then tries to falsify
# each store: the unmodified one must pass, one with removed objects must be caught, both in
# SECONDS of wall time. The bakes take most of an hour on two cores.
#   bash tests/audit_stores.sh                                all of them
#   ONLY=delft bash tests/audit_stores.sh                     one: city, or the name of a real scene
#   PVSFARM_SCENES=FOLDER SECONDS_EACH=30 PLANT=1 OUT=FOLDER  where, how hard; OUT keeps the stores
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
scenes=${PVSFARM_SCENES:-../shared/scenes}
seconds=${SECONDS_EACH:-30}
plant=${PLANT:-1}
out=${OUT:-build/audited}
program=${PVSFARM:-build/release/bin/pvsfarm}
mkdir -p "$out"
failed=0 checked=0

# check NAME SCENE OPTION...: the bake's options
check() {
  local name=$1 scene=$2 code
  shift 2
  [ -z "${ONLY:-}" ] || [ "$ONLY" = "$name" ] || return 0
  checked=$((checked + 1))
  [ -f "$out/$name.pvs" ] || "$program" bake "$scene" "$@" -q -o "$out/$name.pvs" > "$out/$name.txt"
  local from=()
  while [ $# -gt 0 ]; do
    case $1 in --tags | --occluders) from+=("$1" "$2") ;; esac
    shift 2
  done
  code=0
  "$program" audit "$out/$name.pvs" "$scene" "${from[@]}" --seconds "$seconds" -q \
    > "$out/$name.audit.txt" || code=$?
  [ $code = 0 ] || failed=1
  echo "$name: unmodified: exit $code (must be 0); $(head -1 "$out/$name.audit.txt")"
  code=0
  "$program" audit "$out/$name.pvs" "$scene" "${from[@]}" --seconds "$seconds" --plant "$plant" -q \
    > "$out/$name.planted.txt" || code=$?
  [ $code = 7 ] || failed=1
  echo "$name: $plant object(s) removed: exit $code (must be 7)"
}

if [ ! -f "$out/city.glb" ]; then
  "$program" generate city --blocks 20 --cell-size 5 -o "$out/city.glb" > /dev/null
fi
check city "$out/city.glb" --cells "$out/city.cells.json" --tags "$out/city.tags.json" --gap 0.15
for folder in "$scenes"/*/; do
  [ -f "$folder/scene.obj" ] || continue
  options=(--cells "$folder/cells.json")
  [ ! -f "$folder/tags.json" ] || options+=(--tags "$folder/tags.json")
  [ ! -f "$folder/blockers.obj" ] || options+=(--occluders "$folder/blockers.obj")
  check "$(basename "$folder")" "$folder/scene.obj" "${options[@]}"
done
if [ $checked = 0 ]; then
  echo "no scene to audit: ONLY=${ONLY:-}, PVSFARM_SCENES=$scenes" >&2
  exit 3
fi
exit $failed
