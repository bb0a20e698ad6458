#!/usr/bin/env bash
# The tests with the counts of a night: tests/run.sh with the slow ones, property tests with many
# more cases (they read PVSFARM_NIGHTLY), and once more under the sanitizers. Hours, not minutes.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
export PVSFARM_NIGHTLY=1
bash tests/run.sh "$@"
for preset in asan tsan; do
  cmake --preset "$preset"
  cmake --build "build/$preset" -j "$(nproc)"
  ctest --test-dir "build/$preset" -j "$(nproc)" -LE '^(bench|slow)$' --output-on-failure "$@"
done
# Every combination of provers, on every scene: 10^8 rays at what they hide.
build/release/bench/bench_combinations --cells 6 --surface-cells 2 --rays 120000000
# Last, as it wants the machine for itself.
bash tests/bench/durand.sh
