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
mkdir -p "$demo"
cmake --preset release > "$demo/configure.log" || { cat "$demo/configure.log"; exit 4; }
cmake --build build/release -j "$(nproc)" --target pvsfarm pvsfarm-worker

step "Generating a city of $blocks x $blocks blocks"
"$bin/pvsfarm" generate city --blocks "$blocks" --seed 1 -o "$demo/city.glb"

step "Baking it on two local workers"
"$bin/pvsfarm" bake "$demo/city.glb" -o "$demo/city.pvs" --cells "$demo/city.cells.json" --workers 2

step "What came out"
middle=$(($(grep -o '"id"' "$demo/city.cells.json" | wc -l) / 2))
"$bin/pvsfarm" inspect "$demo/city.pvs" --picture "$demo/city.png" --cell "$middle"

crossing=$((blocks / 2 * 74 + 7))  # blocks of 60 m, streets of 14 m
cat <<END

The picture:  $demo/city.png   (streets by how much can be seen; in orange what one cell sees)
The store:    $demo/city.pvs   (what an engine reads at run time)
The scene:    $demo/city.glb

Try next:
  $bin/pvsfarm query $demo/city.pvs --at $crossing,1.7,-$crossing
      what can be seen from the crossing in the middle (glTF is y up)
  $bin/pvsfarm export $demo/city.pvs
      every cell, one JSON object a line
  $bin/pvsfarm bake YOUR.glb -o YOUR.pvs
      your own scene: one object a mesh node
END
