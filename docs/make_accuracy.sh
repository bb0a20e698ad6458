#!/usr/bin/env bash
# Writes docs/accuracy.md, docs/charts/*.vl.json and docs/accuracy_*.svg: every figure in them is
# measured by this run, on this machine. About half an hour on two quiet cores.
#   bash docs/make_accuracy.sh
#   CELLS=100 bash docs/make_accuracy.sh              more cells of every scene
#   PVSFARM_SCENES=FOLDER bash docs/make_accuracy.sh  real scenes: each folder with a scene.obj
#                                                     (default: ../shared/scenes)
# What was measured stays in build/accuracy/*.jsonl; `pvsfarm chart --data` shows it again.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
cells=${CELLS:-24}                      # of a scene, in charts and tables of single scenes
ingredient_cells=${INGREDIENT_CELLS:-6} # of a scene, for each method more or less
rays=${RAYS:-1000000}                   # a cell, against what is culled
sampling_rays=${SAMPLING_RAYS:-1000000} # a cell, the most of the series that only samples
rival_rays=${RIVAL_RAYS:-10000000}      # the same, in the comparison with sampling
farm_cells=${FARM_CELLS:-2000}
combination_rays=${COMBINATION_RAYS:-120000000} # over all scenes
combination_cells=${COMBINATION_CELLS:-2}       # of a scene
seeds=${SEEDS:-1}                       # random variants of each perturbation
workers=${WORKERS:-$(nproc)}
real_scenes=${PVSFARM_SCENES:-../shared/scenes}

say() { echo "$(date +%T) $*" >&2; }
bash deploy/install.sh
vl2svg=build/charts/node_modules/.bin/vl2svg
bash deploy/install.sh --charts || say "npm cannot install vl2svg: the SVG files stay as they are"
cmake --preset release >&2
cmake --build build/release -j "$(nproc)" --target bench_accuracy bench_stability \
  bench_combinations pvsfarm pvsfarm-worker >&2
pvsfarm=build/release/bin/pvsfarm
bench=build/release/bench/bench_accuracy
stability=build/release/bench/bench_stability
combinations=build/release/bench/bench_combinations
out=build/accuracy
rm -rf "$out"
mkdir -p "$out" docs/charts

# generate FILE KIND OPTION...: out/FILE.obj, its cells and tags
generate() {
  local file=$1
  shift
  "$pvsfarm" generate "$@" -o "$out/$file.obj" >&2
}
# measure FILE DATA NAME OPTION...: the generated scene out/FILE.obj, into out/DATA.jsonl
measure() {
  local file=$1 data=$2 name=$3
  shift 3
  say "measuring $name: $data"
  "$pvsfarm" chart "$out/$file.obj" --cells "$out/$file.cells.json" --tags "$out/$file.tags.json" \
    --name "$name" --sample "${sample:-$cells}" --workers "$workers" \
    --sampling-rays "${most_rays:-$sampling_rays}" -q --json "$out/$data.jsonl" "$@" \
    > "$out/$data.md"
}
# measure_real FOLDER DATA OPTION...: the same for a real scene
measure_real() {
  local folder=$1 data=$2 name options=()
  shift 2
  name=$(basename "$folder")
  [ ! -f "$folder/tags.json" ] || options+=(--tags "$folder/tags.json")
  [ ! -f "$folder/blockers.obj" ] || options+=(--occluders "$folder/blockers.obj")
  say "measuring $name: $data"
  "$pvsfarm" chart "$folder/scene.obj" --cells "$folder/cells.json" "${options[@]}" \
    --name "$name" --sample "${sample:-$cells}" --workers "$workers" \
    --sampling-rays "$sampling_rays" -q --json "$out/$data.jsonl" "$@" > "$out/$data.md"
}
# draw CHART KIND OPTION...: docs/charts/CHART.vl.json and docs/accuracy_CHART.svg
draw() {
  local chart=$1 kind=$2
  shift 2
  "$pvsfarm" chart --kind "$kind" -o "docs/charts/$chart.vl.json" "$@" > "$out/$chart.md"
  if [ ! -x "$vl2svg" ]; then
    say "docs/accuracy_$chart.svg: not drawn anew"
    return
  fi
  "$pvsfarm" chart --kind "$kind" --vl2svg "$vl2svg" --svg "docs/accuracy_$chart.svg" "$@" \
    > /dev/null
}
data() { for file in "$@"; do printf -- '--data %s ' "$out/$file.jsonl"; done; }
culling() {
  say "culling $*"
  "$bench" culling --cells "$cells" --rays "$rays" "$@"
}
speed() {
  say "speed $*"
  "$bench" speed --cells "$cells" "$@"
}
profile() {
  say "profile $*"
  "$bench" profile --cells "$cells" "$@"
}
real_note() {
  if [ ${#reals[@]} -gt 0 ]; then
    echo "The last ${#reals[@]} are real scenes, in their own units, with cells of their own."
  else
    echo "Real scenes were not at hand when this was measured."
  fi
}
processor() { sed -n 's/^model name[[:space:]]*: //p' /proc/cpuinfo | head -n 1; }

# Each method more or less, beside what was measured as DATA.
ingredients() {
  local how=$1 scene=$2 data=$3
  shift 3
  sample=$ingredient_cells "$how" "$scene" "ingredients_$data" "$@" --series ingredients,improved \
    --kind ingredients
  ingredients+=("ingredients_$data")
}

# 1. Measure.
compared=bake,cascade,item-buffers,resolution,sampling
cities=() others=() sizes=() ingredients=()
for size in 2 5 10 20; do
  generate "city_$size" city --blocks 20 --cell-size "$size"
  measure "city_$size" "city_$size" "city, $size m cells" --series "$compared"
  ingredients measure "city_$size" "city_$size" "city, $size m cells"
  cities+=("city_$size")
done
generate closed_city closed-city --blocks 20
generate forest forest
generate rooms rooms
for scene in closed_city forest rooms; do
  measure "$scene" "$scene" "${scene/_/ }" --series "$compared"
  ingredients measure "$scene" "$scene" "${scene/_/ }"
  others+=("$scene")
done
reals=()
for folder in "$real_scenes"/*/; do
  [ -f "$folder/scene.obj" ] || continue
  real=$(basename "$folder")
  measure_real "${folder%/}" "real_$real" --series "$compared"
  ingredients measure_real "${folder%/}" "real_$real"
  reals+=("real_$real")
done
[ ${#reals[@]} -gt 0 ] || say "no scenes in $real_scenes: the page is without real scenes"

measure city_5 settings "city, 5 m cells" --series bake,resolution,planes,extent,raster
for blocks in 5 7 10 14 20; do
  generate "size_$blocks" city --blocks "$blocks"
  measure "size_$blocks" "size_$blocks" "$blocks x $blocks blocks" --series bake,projection
  sizes+=("size_$blocks")
done
most_rays=$rival_rays measure city_5 rival "city of 20 x 20 blocks, 5 m cells" \
  --series bake,sampling --kind rival --gap 0.15
say "stability, and combinations beside it: neither tells the time"
"$combinations" --rays "$combination_rays" --cells "$combination_cells" > "$out/combinations.md" &
judged=$!
"$stability" --seeds "$seeds" --cells 3 --rays 200000 > "$out/stability.jsonl"
wait "$judged"

# 2. Draw.
methods=(--series cascade,item-buffers,resolution,sampling)
# shellcheck disable=SC2046
{
  draw cities accuracy $(data "${cities[@]}") "${methods[@]}"
  draw others accuracy $(data "${others[@]}") "${methods[@]}"
  [ ${#reals[@]} -eq 0 ] || draw real accuracy $(data "${reals[@]}") "${methods[@]}"
  draw settings accuracy $(data settings)
  draw resolution resolution $(data "${cities[@]}" "${others[@]}")
  draw size scale $(data "${sizes[@]}")
  draw rival rival $(data rival)
  draw stability stability $(data stability)
  draw ingredients ingredients $(data "${ingredients[@]}")
  "$pvsfarm" chart --series bake $(data "${cities[@]}" "${others[@]}" "${reals[@]}") \
    > "$out/bake.md"
}

# 3. Write.
figure() { printf '\n![%s](accuracy_%s.svg)\n\n' "$2" "$1"; }
{
cat <<END
# Accuracy and speed

Made by \`bash docs/make_accuracy.sh\`, which writes this whole page, its charts included; no figure
is typed by hand. Processor: $(processor), $(nproc) in use. All times are processor time a cell, in
milliseconds, unless a table says otherwise: trust ratios more than milliseconds.

## What "conservative" means here

An object is left out of a cell's visible set (PVS) only with a *certificate*: a proof that every
line from every point of the cell to every point of the object meets something opaque on the way;
in fact to every point of the boxes of its triangles, along the axes of the cell. (What may move is
all of its box, along the axes of the scene.)
Whatever is not proved hidden stays in: doubt, rounding, a limit that was reached, a worker that
failed. So a PVS may hold objects that nobody can see (it is *loose*), and never lacks one that
somebody can (it has no *holes*).

That is a statement about the scene that pvsfarm was given. It carries over to what a player sees
if, and only if,

* what is tagged as an occluder is drawn opaque whenever it could hide something: no holes cut by an
  alpha test, no blending, and no coarser level of detail that shrinks it;
* it does not move for as long as the PVS is in use. (What moves may be *hidden*: give the box of
  its whole range.)
* triangles that the engine draws from one side only belong to closed solids, or are left to hide
  only what lies behind their front. pvsfarm uses a solid as a solid only from outside it;
* nothing nearer than the camera's near plane is relied on: \`--near\` says how far that reaches, to
  the corner of the view;
* the cell holds every eye: both eyes of a headset, a bobbing head, an interpolated position. Cells
  are closed, so neighbours share their border.

One more rule makes cities work. Matter below the ground that all eyes and all objects stand on
cannot change what they see, so a building that stands on the ground is treated as if it went down
without end. Where nothing is below (a bridge, an arch, a balcony) nothing is added.

## What the columns are

* *CPU*: processor time of evaluating one cell, against all objects of the scene: the mean, the
  median and the slowest of the sample. A bake is faster: a cell of a split starts from its parent's
  set.
* *gap*: what the evaluation itself certifies. It keeps a witness (a line that meets nothing) for
  every object it has *seen*; the gap is the part of the PVS, in triangles, that it has neither
  proved hidden nor seen. The truth lies in between, so the gap bounds how loose the PVS is, without
  any reference.
* *PVS / seen*: the size of the PVS over the *reference*: for each cell, all that any method of the
  same run has seen. The reference is less than the truth, so this too bounds from above how loose
  the PVS is. Below 1 the set has holes.
* *culled*: the share of the scene's triangles that is proved hidden.
* *wrong*: objects declared hidden that anything at all saw. This page is not written unless it is 0
  everywhere.

Samples: $cells cells of each scene, one from each of $cells equal stretches of a curve through
all its cells.

## A bake's settings on every scene

The defaults: the cascade of methods stops at a certified gap of 0.1, or where nothing moves.
*City* is 20 x 20 blocks with parked cars. $(real_note)

$(cat "$out/bake.md")

## Accuracy against time

Curves go from little effort to much. *Projections* alone prove and look for nothing: their PVS is
set against what the others saw. *Random rays* alone prove nothing; their set is what they saw, and
1 is all they can hope for.

### Cities
$(figure cities "PVS over seen and certified gap against time, cities with cells of 2 to 20 m")

### A city whose answer is known, a forest, rooms
$(figure others "The same for the closed city, the forest and the rooms")

END
if [ ${#reals[@]} -gt 0 ]; then
cat <<END
### Real scenes
$(figure real "The same for real scenes")

END
fi
cat <<END

### What each method gains and costs

The defaults, going on to the end (\`--gap 0\`), with one of their methods left out or one of the
others put in; $ingredient_cells cells of each scene. A method gains less among the others than
alone: what one settles, another often settles too. Durand 2000 reports PVS 5 to 10 % smaller with
the improved Projection of occludees, over Projections alone: the last table sets ours beside it.
$(figure ingredients "What each method gains and costs, by scene, and the improved Projection")

$(cat "$out/ingredients.md")

### Settings of the Projections

City, 5 m cells: the resolution of the maps, the planes a face of the cell, the extent of a map over
the cell's, and the rasteriser, each varied from the defaults, with the Projections alone.
$(figure settings "PVS over seen and gap against time, by setting")

$(cat "$out/settings.md")

## Time and culling against the resolution

After Fig. 10 of Durand 2000, on our scenes: Projections alone.
$(figure resolution "Time and culling against the resolution of the maps")


## Time against the size of the scene

After Fig. 11 of Durand 2000: cities of 5 x 5 to 20 x 20 blocks, 1 to 16 times the triangles, 5 m
cells, $cells cells each.
$(figure size "Time against the number of triangles")

$(cat "$out/size.md")

## Against sampling

What most tools do: cast random rays from the cell, and call visible what they hit. In one run, on
the same cells: the cascade asked for a gap of 0.15, and rays in all directions from random points
of the cell, up to $rival_rays of them. What is to be found is all that anything in this run saw.
$(figure rival "What random rays miss against time")

$(cat "$out/rival.md")

## Stability

The same scene, changed so that its visible sets should hardly change: how much do they grow? Tiny
situations, random scenes and small generated ones, $seeds random variants of each change. Rays look
for what was declared hidden in every one.
$(figure stability "Growth of the visible sets by perturbation")

$(cat "$out/stability.md")

## Every combination of methods

Each set of provers, switched on together and no other, after witnesses of one kind or another or
none, on small generated scenes and the real ones at hand; then rays aimed at whatever any of them
called hidden. *Contradictions* are objects that the evaluation itself saw after it had proved them
hidden; *wrong* are objects that a ray of an oracle saw which shares no code with the evaluator.

END
cat "$out/combinations.md"
cat <<END

## What is culled

Against an oracle that shares no code with the evaluator: each row evaluates a sample of the
generator's cells against all objects (default settings). *Visible objects* is the mean size of a
PVS. Then $rays rays are cast from each cell with Embree, half in all directions, half at what the
PVS holds and no ray has seen. *Wrong* counts objects declared hidden that a ray saw.

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

Where *PVS / seen* is 1, rays see all that is left: there was nothing to cull.

## What a cell costs

City of 20 x 20 blocks, 5 m cells, the same sample, in this one process. Each cell is evaluated
twice, by two evaluators in opposite order; the run fails if any delta differs. The faster of the
two counts.

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

## Where a cell's time goes

The same city and cells, default settings, step by step. *Touched* is what a step reads and writes
in a row; the *floor* is what that would take at the speed at which this machine, in this run,
touches a map in its cache, plus the step's arithmetic (so many operations of doubles each, counted
in its source) at the speed at which it adds and multiplies in lanes. The run fails if telling the
steps apart changes an answer.

| step | CPU, ms | operations | touched, MB | floor, ms |
|---|---|---|---|---|
END
profile --generator city --size 20 --cell-size 5
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
say "farm"
"$bench" farm --generator city --size 20 --cell-size 5 --cells "$farm_cells" \
  --bin build/release/bin --work "$out/farm"
} > "$out/accuracy.md"
mv "$out/accuracy.md" docs/accuracy.md
say "wrote docs/accuracy.md"
