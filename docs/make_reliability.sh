#!/usr/bin/env bash
# Runs the tests of the fault table and makes docs/reliability.md of what they say: for every row of
# docs/faults.json the figure reached beside the figure asked. Full counts, two hours or more:
#   bash docs/make_reliability.sh
# Only some of its parts (rows that were not run keep their last figures): the tests, the fuzzers
# under sanitizers, which are built first, or the speed, on a machine that does nothing else:
#   PARTS="fuzz speed" bash docs/make_reliability.sh
# Only some tests, with the counts of a plain run:
#   QUICK=1 bash docs/make_reliability.sh -R journal
# Arguments go to ctest, for the tests and the fuzzers. Exits 0 only if all of it passed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
figures=$PWD/build/release/figures.jsonl
rm -f "$figures"
export PVSFARM_FIGURES=$figures
status=0
parts="tests fuzz speed"
if [ -n "${QUICK:-}" ]; then
  parts=tests
else
  export PVSFARM_FULL=1
fi
parts=${PARTS:-$parts}

tests() {
  # Without the engines, their rows would be skipped.
  [ -n "${QUICK:-}" ] || bash deploy/install.sh --farm || return
  ctest --test-dir build/release -L '^farm$' -LE '^fuzz$' --output-on-failure "$@"
}
# What comes from outside, mutated: ten minutes a fuzzer.
fuzz() {
  local targets=(fuzz_envelope fuzz_delta fuzz_store fuzz_scene fuzz_bundle)
  cmake --preset fuzz && cmake --build build/fuzz -j "$(nproc)" --target "${targets[@]}" &&
    ctest --test-dir build/fuzz -L '^fuzz$' -j "$(nproc)" --output-on-failure "$@"
}
# Two workers beside one. Each of many cells is work for some milliseconds, as in a real bake.
speed() {
  cmake --build build/release -j "$(nproc)" --target bench_accuracy pvsfarm pvsfarm-worker &&
    build/release/bench/bench_accuracy farm --generator city --size 20 --cell-size 5 \
      --cells 2008 --must-hold --bin build/release/bin --work build/release/farm_speed
}
for part in $parts; do
  case $part in
    tests | fuzz) "$part" "$@" || status=$? ;;
    speed) speed || status=$? ;;
    *) echo "no part is called $part" >&2 && exit 1 ;;
  esac
done

page=docs/reliability.md.new
python3 docs/reliability_page.py docs/faults.json docs/reliability.jsonl "$figures" > "$page"
mv "$page" docs/reliability.md
exit "$status"
