#!/usr/bin/env bash
# Installs what is missing, builds release, runs the tests, prints a summary.
# Leaves out benchmarks and what only tests/nightly.sh has time for. Arguments go to ctest:
#   bash tests/run.sh -R store        only tests whose name holds "store"
#   bash tests/run.sh -L adversarial  only one label
# Exits 0 only if every test that ran passed, and at least one did.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
jobs=$(nproc)
log=build/release/tests.log
left_out='^(bench|slow)$'
[ -z "${PVSFARM_NIGHTLY:-}" ] || left_out='^bench$'

bash deploy/install.sh
cmake --preset release
cmake --build build/release -j "$jobs"

started=$SECONDS
status=0
ctest --test-dir build/release -j "$jobs" -LE "$left_out" --output-on-failure --no-tests=error \
      -W 70 --output-junit tests.xml "$@" 2>&1 | grep -v '^ *Start ' | tee "$log" || status=$?

count() { sed -n "s/^[[:space:]]*$1=\"\([0-9]*\)\".*/\1/p" build/release/tests.xml | head -n 1; }
echo
if [ "$status" -eq 0 ]; then verdict=passed; else verdict=FAILED; fi
echo "$verdict: $(count tests) tests, $(count failures) failed, $(count skipped) skipped," \
     "$((SECONDS - started)) s; log: $log"
grep -E '^[[:space:]]*[0-9]+/[0-9]+ Test .*(\*\*\*|Skipped)' "$log" | sed 's/^ */  /' || true
exit "$status"
