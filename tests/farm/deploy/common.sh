# What the tests of deploy/ share; sourced by them. The golden store is the one that a local worker
# makes without faults; every test compares its own with that byte for byte.
# A test says in `rows` which of the fault table's it is for, before it may skip.
# Usage: TEST.sh BIN_DIR SOURCE_DIR. Exit codes: 0 passed, 1 failed, 77 cannot run here.
set -Eeuo pipefail
bin=$(cd "$1" && pwd)
source=$(cd "$2" && pwd)
test=$(basename "$0" .sh)
folder=$(mktemp -d "${TMPDIR:-/tmp}/pvsfarm-deploy-XXXXXX")
echo $$ > "$folder/owner"
undo=()  # commands that take back what was set up, run in reverse

say() { printf '%s %s\n' "$(date +%T)" "$*"; }
skip() {
  echo "skipped: $*"
  [ -z "${PVSFARM_FIGURES:-}" ] || [ -z "${rows:-}" ] ||
    printf '{"row":%d,"test":"'"$test"'","skipped":"'"$*"'"}\n' $rows >> "$PVSFARM_FIGURES"
  exit 77
}
fail() { echo "FAILED: $*" >&2; exit 1; }
need_root() { [ "$(id -u)" -eq 0 ] || skip "needs root, for namespaces"; }
need() {
  local program
  for program in "$@"; do
    command -v "$program" > /dev/null ||
      skip "$program is not installed (bash deploy/install.sh --farm)"
  done
}

clean_up() {
  local status=$? i
  trap - EXIT INT TERM
  set +e
  [ "$status" -eq 0 ] || [ "$status" -eq 77 ] || show_logs
  for ((i = ${#undo[@]} - 1; i >= 0; i--)); do eval "${undo[i]}"; done
  rm -rf "$folder"
  exit "$status"
}
show_logs() {
  local log
  while read -r log; do printf -- '--- %s\n' "$log"; tail -n 25 "$log"; done \
    < <(find "$folder" \( -name '*.log' -o -name '*.out' \) -size +0 -not -path '*/rootfs/*')
}
trap clean_up EXIT
trap 'echo "${BASH_SOURCE[0]##*/}:$LINENO: $BASH_COMMAND: ended with $?" >&2' ERR
trap 'exit 143' INT TERM

add_namespace() {  # NAME
  echo "$1" >> "$folder/namespaces"
  ip netns add "$1"
  undo+=("ip netns del $1")
}
# What a test left that was killed itself: its folder says its process and its namespaces.
clean_stale() {
  local stale name
  for stale in "${TMPDIR:-/tmp}"/pvsfarm-deploy-*; do
    [ -s "$stale/owner" ] || continue
    ! grep -qs _test.sh "/proc/$(cat "$stale/owner")/cmdline" || continue
    if [ -s "$stale/namespaces" ]; then
      while read -r name; do end_namespace "$name"; done < "$stale/namespaces"
    fi
    echo "left by an earlier run: $stale"
    rm -rf "$stale"
  done
}
end_namespace() {  # NAME: what runs in it, then itself
  local pid
  [ -e "/run/netns/$1" ] || return 0
  for pid in $(ip netns pids "$1"); do kill -KILL "$pid" 2> /dev/null || true; done
  ip netns del "$1"
}
[ "$(id -u)" -ne 0 ] || clean_stale

full_counts() { [ -n "${PVSFARM_FULL:-}" ] && [ "$PVSFARM_FULL" != 0 ]; }

# record ROW WHAT ASKED REACHED: a figure of docs/reliability.md; held if reached is what was asked.
# Fails the test, at its end, where it does not hold.
missed=0
record() {
  local held=true full=false
  [ "$3" = "$4" ] || { held=false; missed=1; echo "missed: $2: $4 (asked $3)" >&2; }
  ! full_counts || full=true
  say "$2: $4 (asked $3)"
  [ -z "${PVSFARM_FIGURES:-}" ] ||
    printf '{"row":%d,"what":"%s","asked":"%s","reached":"%s","held":%s,"full":%s,"test":"%s"}\n' \
      "$1" "$2" "$3" "$4" "$held" "$full" "$test" >> "$PVSFARM_FIGURES"
}

# wait_for SECONDS COMMAND...: until it succeeds; fails when it never did.
meanwhile=:  # what waiting does between two tries
wait_for() {
  local end=$((SECONDS + $1))
  shift
  until "$@"; do
    [ "$SECONDS" -lt "$end" ] || return 1
    sleep 0.2
    "$meanwhile"
  done
}

# summary NAME < OUTPUT: a whole number from the last summary of a bake.
summary() { sed -n "s/.*\"$1\":\([0-9]*\)[,.}].*/\1/p" | tail -n 1; }

# make_golden BLOCKS SECONDS: a city and its golden store, in $folder; BLOCKS x BLOCKS blocks, or
# more if two workers bake it in less than SECONDS here.
make_golden() {
  local blocks=$1
  while :; do
    "$bin/pvsfarm" -q generate city --blocks "$blocks" --cell-size 4 -o "$folder/city.obj" \
      > "$folder/generate.out"
    "$bin/pvsfarm" -q bake "$folder/city.obj" -o "$folder/golden.pvs" "${scene_options[@]}" \
      --workers 2 --fresh --json > "$folder/golden.json"
    [ "$(summary seconds < "$folder/golden.json")" -lt "$2" ] && [ "$blocks" -lt 12 ] || break
    blocks=$((blocks + 1))
    rm "$folder/golden.pvs"
  done
  cells=$(summary evaluated < "$folder/golden.json")
  say "golden: $blocks x $blocks blocks, $cells cells"
}
# Cells of some ten milliseconds: of quicker ones a task has dozens, and few tasks are too few.
scene_options=(--budget 1200 --min-cell 1.5 --gap 0.02 --resolution 512
               --cells "$folder/city.cells.json" --tags "$folder/city.tags.json")

identical() { if cmp -s "$1" "$folder/golden.pvs"; then echo identical; else echo different; fi; }

# record_store ROW FAULTS STORE SUMMARY: the figures of a whole bake beside those of the golden one.
record_store() {
  local row=$1 faults=$2 made=$(($(summary evaluated < "$4") + $(summary resumed < "$4")))
  record "$row" "store after $faults" identical "$(identical "$3")"
  record "$row" "lost of $cells cells" 0 $((made < cells ? cells - made : 0))
  record "$row" "merged twice of $cells cells" 0 $((made > cells ? made - cells : 0))
  record "$row" "cells given up or answered differently" 0 \
    $(($(summary quarantined < "$4") + $(summary disagreements < "$4")))
}
