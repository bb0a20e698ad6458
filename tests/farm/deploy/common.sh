# What the tests of deploy/ share; sourced by them. The golden store is the one that a local worker
# makes without faults; every test compares its own with that byte for byte.
# Usage: TEST.sh BIN_DIR SOURCE_DIR. Exit codes: 0 passed, 1 failed, 77 cannot run here.
set -euo pipefail
bin=$(cd "$1" && pwd)
source=$(cd "$2" && pwd)
folder=$(mktemp -d "${TMPDIR:-/tmp}/pvsfarm-deploy-XXXXXX")
undo=()  # commands that take back what was set up, run in reverse

say() { printf '%s %s\n' "$(date +%T)" "$*"; }
skip() { echo "skipped: $*"; exit 77; }
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
trap 'exit 143' INT TERM

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
    printf '{"row":%d,"what":"%s","asked":"%s","reached":"%s","held":%s,"full":%s}\n' \
      "$1" "$2" "$3" "$4" "$held" "$full" >> "$PVSFARM_FIGURES"
}

# wait_for SECONDS COMMAND...: until it succeeds; fails when it never did.
wait_for() {
  local end=$((SECONDS + $1))
  shift
  until "$@"; do
    [ "$SECONDS" -lt "$end" ] || return 1
    sleep 0.3
  done
}

# A city of BLOCKS x BLOCKS blocks and its golden store, in $folder.
make_golden() {
  "$bin/pvsfarm" -q generate city --blocks "$1" --cell-size 4 -o "$folder/city.obj"
  "$bin/pvsfarm" -q bake "$folder/city.obj" -o "$folder/golden.pvs" "${scene_options[@]}" \
    --workers 2 --json > "$folder/golden.json"
  cells=$(grep -o '"cells":[0-9]*' "$folder/golden.json" | head -n 1 | cut -d: -f2)
}
scene_options=(--budget 2000 --min-cell 1.5 --cells "$folder/city.cells.json"
               --tags "$folder/city.tags.json")

identical() { if cmp -s "$1" "$folder/golden.pvs"; then echo identical; else echo different; fi; }
