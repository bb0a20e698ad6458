#!/usr/bin/env bash
# Writes docs/accuracy.md: every figure in it is measured by this run, on this machine.
#   bash docs/make_accuracy.sh            about ten minutes
#   CELLS=300 bash docs/make_accuracy.sh  more cells in every table
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
cells=${CELLS:-60}
rays=${RAYS:-4000000}
farm_cells=${FARM_CELLS:-2000}
bash deploy/install.sh
cmake --preset release >&2
cmake --build build/release -j "$(nproc)" --target bench_accuracy pvsfarm pvsfarm-worker >&2
bench=build/release/bench/bench_accuracy
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

culling() {
  echo "culling $*" >&2
  "$bench" culling --cells "$cells" --rays "$rays" "$@"
}
speed() {
  echo "speed $*" >&2
  "$bench" speed --cells "$cells" "$@"
}
processor() { sed -n 's/^model name[[:space:]]*: //p' /proc/cpuinfo | head -n 1; }

{
cat <<END
# Accuracy and speed

Made by \`bash docs/make_accuracy.sh\`, which writes this whole page; no figure is typed by hand.
Processor: $(processor), $(nproc) in use. Times are processor time unless they say otherwise: trust
the ratios within a table more than the milliseconds.

## What is culled

Each row evaluates a sample of the generator's cells, spread evenly over the scene, against all
objects (direct rasteriser, default settings). *Visible objects* is the mean size of a PVS; *culled*
the share of all triangles that is proved hidden. Then $rays rays are cast from each cell, half in
all directions, half at what the PVS holds and no ray has seen. What they see is less than the
truth, so *PVS / seen* bounds from above how loose the PVS is. *Wrong* counts objects declared
hidden that a ray saw; the program fails if there is one.

| scene | cell, m | cells | visible objects | culled, % | PVS / seen, objects | triangles | wrong |
|---|---|---|---|---|---|---|---|
END
for size in 2 5 10 20; do culling --generator city --size 20 --cell-size "$size"; done
culling --generator closed-city --size 20 --cell-size 5
culling --generator terrain --cell-size 5
culling --generator rooms --cell-size 2.5
culling --generator maze --cell-size 3
culling --generator forest --cell-size 5
cat <<END

The city is 20 x 20 blocks. Where *PVS / seen* is 1, rays see all that is left: there was nothing
to cull. Rooms and mazes are the weak point: where two walls meet at an angle neither wall's
Projection covers the seam, and rooms see each other along it.

## What a cell costs

City of 20 x 20 blocks, 5 m cells, the same sample. Each cell is evaluated twice, by two evaluators
in opposite order; the run fails if any delta differs. The faster of the two counts.

| rasteriser | map, pixels a side | mean, ms | median, ms | slowest, ms | digest of the deltas |
|---|---|---|---|---|---|
END
for raster in direct osmesa; do
  speed --generator city --size 20 --cell-size 5 --raster "$raster" --resolution 256
done
for resolution in 128 512; do
  speed --generator city --size 20 --cell-size 5 --raster direct --resolution "$resolution"
done
cat <<END

## What the farm adds

The same city, baked by the real programs: a coordinator and one worker, then two, in turn three
times; of each figure the least counts. *Start* is the wall time of a bake of eight cells: reading
the scene, building the bundle, writing the store. *Baking* is the wall time of all cells less
that, and the milliseconds are processor time a cell, likewise; the coordinator's from when the
scene is read. The run fails if two stores differ in a byte.

| workers | cells | start, s | baking, s | times one worker | worker, ms | coordinator, ms | store |
|---|---|---|---|---|---|---|---|
END
echo "farm" >&2
"$bench" farm --generator city --size 20 --cell-size 5 --cells "$farm_cells" \
  --bin build/release/bin --work "$work"
} > "$work/accuracy.md"
mv "$work/accuracy.md" docs/accuracy.md
echo "wrote docs/accuracy.md" >&2
