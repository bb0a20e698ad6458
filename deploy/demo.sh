#!/usr/bin/env bash
# From a bare Debian 12 to a baked city: installs what is missing, builds release, generates a city,
# bakes it on two local workers, and draws what was culled. Two minutes after the build.
#   BLOCKS=12 bash deploy/demo.sh    a larger city (BLOCKS x BLOCKS blocks)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
blocks=${BLOCKS:-8}
demo=build/demo
bin=build/release/bin
step() { printf '\n== %s\n' "$*"; }

step "Installing what is missing"
bash deploy/install.sh

step "Building (build/release)"
cmake --preset release
cmake --build build/release -j "$(nproc)" --target pvsfarm pvsfarm-worker

step "Generating a city of $blocks x $blocks blocks"
mkdir -p "$demo"
"$bin/pvsfarm" generate city --blocks "$blocks" --seed 1 -o "$demo/city.glb"

step "Baking it on two local workers"
"$bin/pvsfarm" bake "$demo/city.glb" -o "$demo/city.pvs" --cells "$demo/city.cells.json" --workers 2

step "What came out"
"$bin/pvsfarm" inspect "$demo/city.pvs" --picture "$demo/city.png"

cat <<END

The picture:  $demo/city.png   (streets coloured by how much can be seen; one cell's view in detail)
The store:    $demo/city.pvs   (what an engine reads at run time)
The scene:    $demo/city.glb

Try next:
  $bin/pvsfarm query $demo/city.pvs --at 0,0,1.7        what can be seen from a point
  $bin/pvsfarm export $demo/city.pvs | head -n 3        every cell, one JSON object a line
  $bin/pvsfarm bake YOUR.glb -o YOUR.pvs                your own scene: one object a mesh node
END
