#!/usr/bin/env bash
# Runs the tests of the fault table and makes docs/reliability.md of what they say: for every row of
# docs/faults.json the figure reached beside the figure asked. Full counts, an hour or more:
#   bash docs/make_reliability.sh
# Only some tests, with the counts of a plain run (rows that were not run keep their last figures):
#   QUICK=1 bash docs/make_reliability.sh -R journal
# Arguments go to ctest. Exits 0 only if every test passed.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
figures=$PWD/build/release/figures.jsonl
rm -f "$figures"
status=0
if [ -z "${QUICK:-}" ]; then
  bash deploy/install.sh --farm  # without the engines, their rows would be skipped
  export PVSFARM_FULL=1
fi
PVSFARM_FIGURES=$figures ctest --test-dir build/release -L '^farm$' --output-on-failure "$@" ||
  status=$?
page=docs/reliability.md.new
python3 docs/reliability_page.py docs/faults.json docs/reliability.jsonl "$figures" > "$page"
mv "$page" docs/reliability.md
exit "$status"
