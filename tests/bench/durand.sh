#!/usr/bin/env bash
# A city of the size of Durand 2000, section 7.1: 12 districts, 19,200 buildings of 96 triangles,
# 3,000 moving cars of 1,400, 6 million triangles in all, and the street cells of one district,
# which a budget splits about as often as there: 8 evaluations for each, whatever one viewpoint
# sees, for the paper does not ask. Bakes it from the GLB file and prints a table of what that took;
# exits with 1 where a limit is not kept. Wants two quiet cores and about 4 GB.
#   bash tests/bench/durand.sh [FOLDER]      (default: build/durand)
#   WORKERS=2 BUDGET=170000 MIN_CELL=2 LIMIT_SECONDS=600 bash tests/bench/durand.sh
#   AUDIT=1 SECONDS_EACH=30 ...              also tries to falsify what was baked
# Arguments in BAKE_OPTIONS go to `pvsfarm bake`. Builds nothing: build/release must be up to date.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
folder=${1:-build/durand}
name=${SCENE:-city}
workers=${WORKERS:-2}
budget=${BUDGET:-170000}
min_cell=${MIN_CELL:-2}
limit_seconds=${LIMIT_SECONDS:-600}
pvsfarm=build/release/bin/pvsfarm
mkdir -p "$folder"

case "$name" in
  city)
    "$pvsfarm" generate city --blocks 10 --districts 12 --building-triangles 96 --cars 3000 \
      --car-triangles 1400 --moving-cars --lanes 2 --cell-size 20.2 -o "$folder/city.glb" >&2
    options=(--tags "$folder/city.tags.json" --budget "$budget" --min-cell "$min_cell"
      --split-gain 0) ;;
  forest)
    "$pvsfarm" generate forest --trees 7750 --leaves 1000 --glades 158 --cell-size 2 \
      -o "$folder/forest.glb" >&2
    options=(--tags "$folder/forest.tags.json") ;;
  *) echo "SCENE is city or forest" >&2; exit 2 ;;
esac
begin=$SECONDS
# shellcheck disable=SC2086
"$pvsfarm" bake "$folder/$name.glb" --cells "$folder/$name.cells.json" "${options[@]}" \
  -o "$folder/$name.pvs" --fresh --workers "$workers" --json ${BAKE_OPTIONS:-} \
  > "$folder/bake.json" &
bake=$!
trap 'kill "$bake" 2>/dev/null || true' EXIT

# The most memory each process ever held, as the system counts it, until it ends.
peak_kb() {
  sed -n 's/^VmHWM:[[:space:]]*\([0-9]*\) kB/\1/p' "/proc/$1/status" 2>/dev/null || true
}
larger() { [ "${1:-0}" -gt "${2:-0}" ] && echo "$1" || echo "${2:-0}"; }
# Processor time, in the system's ticks.
ticks() { awk '{ print $14 + $15 }' "/proc/$1/stat" 2>/dev/null || true; }
coordinator_kb=0 worker_kb=0
declare -A worker_ticks
while kill -0 "$bake" 2>/dev/null; do
  coordinator_kb=$(larger "$(peak_kb "$bake")" "$coordinator_kb")
  for child in $(pgrep -P "$bake" || true); do
    worker_kb=$(larger "$(peak_kb "$child")" "$worker_kb")
    worker_ticks[$child]=$(larger "$(ticks "$child")" "${worker_ticks[$child]:-0}")
  done
  sleep 2
done
wait "$bake"
trap - EXIT
seconds=$((SECONDS - begin))  # import included

"$pvsfarm" inspect "$folder/$name.pvs" --json > "$folder/inspect.json"
field() { grep -o "\"$2\":[0-9.eE+-]*" "$1" | head -n 1 | cut -d: -f2; }
rounded() { printf '%.1f' "$(field "$summary" "$1")"; }
failed=0
# row WHAT VALUE LIMIT: a table row; LIMIT as a comparison of awk, or nothing
row() {
  local verdict=""
  if [ -n "${3:-}" ]; then
    verdict=kept
    awk "BEGIN { exit !($2 $3) }" || { verdict=MISSED; failed=1; }
  fi
  printf '| %s | %s | %s | %s |\n' "$1" "$2" "${3:-}" "$verdict"
}
store="$folder/inspect.json" summary="$folder/bake.json"
whole_ms=$(awk -v ticks="${worker_ticks[*]:-0}" -v hz="$(getconf CLK_TCK)" \
  -v cells="$(field "$summary" evaluated)" \
  'BEGIN { n = split(ticks, t, " "); while (n > 0) sum += t[n--];
           printf "%.1f", 1000 * sum / hz / cells }')
leaves=$(field "$summary" leaves)
bytes=$(awk "BEGIN { printf \"%.1f\", ($(field "$store" set_bytes_per_cell) + \
  $(field "$store" geometry_bytes_per_cell)) * $(field "$summary" cells) / $leaves }")
echo "| Durand's $name | measured | limit | |"
echo "|---|---:|---:|---|"
row "cells evaluated" "$(field "$summary" evaluated)"
row "leaf cells" "$leaves"
if [ "$name" = city ]; then
  row "culled, % of triangles" "$(rounded culled_percent)" ">= 96"
  row "whole bake, seconds" "$seconds" "<= $limit_seconds"
  row "CPU a cell, ms" "$(rounded worker_cpu_ms_per_cell)"
  row "the same with all else that the workers did" "$whole_ms"
  row "bytes a leaf cell, all that is stored of cells" "$bytes" "<= 100"
  memory="<= 2097152"
else
  row "culled, % of triangles" "$(rounded culled_percent)" ">= 95.5"
  row "whole bake, seconds" "$seconds"
  row "CPU a cell, ms" "$(rounded worker_cpu_ms_per_cell)" "<= 500"
  row "the same with all else that the workers did" "$whole_ms"
  memory=""
fi
row "memory of the coordinator, kB" "$coordinator_kb" "$memory"
row "memory of a worker, kB" "$worker_kb" "$memory"
if [ "${AUDIT:-0}" = 1 ]; then
  code=0
  "$pvsfarm" audit "$folder/$name.pvs" "$folder/$name.glb" --tags "$folder/$name.tags.json" \
    --seconds "${SECONDS_EACH:-30}" --workers "$workers" --json -q > "$folder/audit.json" || code=$?
  [ "$code" = 0 ] || { echo "the audit ended with $code" >&2; failed=1; }
  audit="$folder/audit.json"
  row "leaf cells audited" "$(field "$audit" leaves_reached)" "> 0"
  row "rays of the audit" "$(field "$audit" rays)"
  row "violations it found" "$(grep -o '"eye":' "$audit" | wc -l)" "<= 0"
fi
exit "$failed"
