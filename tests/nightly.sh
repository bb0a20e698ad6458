#!/usr/bin/env bash
# The tests of a night: tests/run.sh with the slow ones (every cell of the real scenes, whole bakes,
# all perturbations, ten times the rays at random worlds), the others once more under the
# sanitizers, the fault table at its full counts, every combination of provers, a city of Durand's
# size. Hours, not minutes. Arguments go to ctest. Goes on where something fails; exits 0 only if
# nothing did.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 1
failed=()
stage() { "$@" || failed+=("$*"); }

stage bash deploy/install.sh --farm
PVSFARM_NIGHTLY=1 stage bash tests/run.sh "$@"
sanitized() {
  local preset=$1
  shift
  cmake --preset "$preset" && cmake --build "build/$preset" -j "$(nproc)" &&
    ctest --test-dir "build/$preset" -j "$(nproc)" -LE '^(bench|slow)$' --output-on-failure "$@"
}
for preset in asan tsan; do stage sanitized "$preset" "$@"; done
# The fault table at its full counts, with the fuzzers and the farm's speed, which makes
# docs/reliability.md.
fault_table() { bash docs/make_reliability.sh 2>&1 | tee build/release/reliability.log; }
stage fault_table
# Every combination of provers, on every scene: 10^8 rays at what they hide.
stage build/release/bench/bench_combinations --cells 6 --surface-cells 2 --rays 120000000
# Last, as it wants the machine for itself.
stage bash tests/bench/durand.sh

# A test that is skipped has no figure here.
skipped=$(grep -hE 'Test .*\*\*\*Skipped' build/release/tests.log build/release/reliability.log |
  sed 's/^.*: //' | sort -u)
[ -z "$skipped" ] || printf 'What this machine could not do:\n%s\n' "$skipped"
for what in "${failed[@]}"; do echo "FAILED: $what" >&2; done
[ ${#failed[@]} -eq 0 ]
