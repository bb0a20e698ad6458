#!/usr/bin/env bash
# The image is built and the farm of deploy/containers/compose.yaml run: an internal network, no
# root, nothing writable but what must be. Its containers are killed, paused, stopped and starved of
# memory meanwhile: the store is the golden one.
# PVSFARM_FULL=1: a larger scene, every fault three times.
here=$(dirname "${BASH_SOURCE[0]}")
source "$here/common.sh"
source "$here/image.sh"
need_root
need podman podman-compose buildah debootstrap runc iptables ip nsenter
[ -x /usr/lib/podman/netavark ] || skip "netavark is not installed"

blocks=${PVSFARM_BLOCKS:-4} rounds=1
if full_counts; then blocks=5 rounds=3; fi
start_engine
build_image
make_golden "$blocks"
say "golden: $cells cells"

farm=$folder/farm
out=$farm/out/scene.pvs
project=pvsfarmtest
mkdir -p "$farm/out"
PATH=$bin:$PATH bash "$source/deploy/make_keys.sh" "$farm/keys"
cp "$folder"/city.obj "$folder"/city.*.json "$farm/"
chown -R 10001:10001 "$farm"
export PVSFARM_IMAGE=$image PVSFARM_FOLDER=$farm PVSFARM_SCENE=city.obj PVSFARM_WORKERS=2
export PVSFARM_OPTIONS="--budget 2000 --min-cell 1.5 --json \
--cells /data/city.cells.json --tags /data/city.tags.json"
compose() (
  cd "$folder" && nsenter --net="/run/netns/$net" podman-compose --podman-path "$folder/podman" \
    -p "$project" -f "$source/deploy/containers/compose.yaml" "$@" >> "$folder/compose.log" 2>&1
)
container() { echo "${project}_$1"; }
state() { engine inspect "$(container "$1")" --format "{{.State.$2}}" 2> /dev/null; }
state_is() { [ "$(state "$1" "$2")" = "$3" ]; }
pid_differs() { local pid; pid=$(state "$1" Pid); [ "${pid:-0}" -gt 0 ] && [ "$pid" != "$2" ]; }
done_cells() {
  engine exec "$(container coordinator_1)" pvsfarm status /data/out/scene.pvs --json \
    --key /data/keys/admin.key --server-key /data/keys/farm.pub 2> /dev/null |
    sed -n 's/.*"cells_done":\([0-9]*\).*/\1/p'
}
reached() { local n; n=$(done_cells); [ -f "$out" ] || [ "${n:-0}" -ge $((cells * $1 / 100)) ]; }
wait_percent() { wait_for 240 reached "$1" || fail "the bake did not reach $1 %"; }
log_of() { engine logs "$(container "$1")" 2>&1; }

kill_one() {  # NAME: as the kernel would; the engine starts it again
  local pid
  pid=$(state "$1" Pid)
  say "$1 killed"
  kill -KILL "$pid"
  wait_for 30 pid_differs "$1" "$pid" || fail "$1 was not started again"
}
pause_one() {  # NAME SECONDS
  say "$1 paused"
  engine pause "$(container "$1")" > /dev/null
  sleep "$2"
  engine unpause "$(container "$1")" > /dev/null
}
starve_one() {  # a third worker with a fraction of the memory that it needs
  say "a worker without memory"
  engine run --name starved --network "${project}_farm" --memory 12m --memory-swap 12m \
    --user 10001:10001 --read-only --cap-drop ALL --tmpfs /tmp:size=1g,mode=1777 \
    -v "$farm/keys/worker.key:/keys/worker.key:ro" -v "$farm/keys/farm.pub:/keys/farm.pub:ro" \
    "$image" pvsfarm-worker --connect tcp://coordinator:5555 \
    --key /keys/worker.key --server-key /keys/farm.pub > "$folder/starved.log" 2>&1 || true
  [ "$(engine inspect starved --format '{{.State.ExitCode}}')" = 137 ] ||
    fail "the worker without memory was not killed for it"
  engine rm starved > /dev/null
}
stop_one() {  # it finishes its cell and leaves
  say "$1 stopped"
  engine stop --time 30 "$(container "$1")" > /dev/null
  stopped=$((stopped + 1))
  ! state_is "$1" ExitCode 0 || left=$((left + 1))
  engine start "$(container "$1")" > /dev/null
}

compose up -d || fail "compose up: $(tail -n 3 "$folder/compose.log")"
for name in coordinator_1 worker_1 worker_2; do
  engine exec "$(container "$name")" sh -c '[ "$(id -u)" = 10001 ] && ! touch /x /usr/x' \
    2> /dev/null || fail "$name runs as root, or may write its root"
done
say "the farm is up: not root, read-only"

stopped=0 left=0 kills=0 pauses=0 starved=0
for ((round = 0; round < rounds; round++)); do
  at() { echo $(((100 * round + $1) / rounds)); }
  wait_percent "$(at 8)"
  kill_one worker_1
  wait_percent "$(at 15)"
  pause_one worker_2 12
  pauses=$((pauses + 1))
  wait_percent "$(at 50)"
  kill_one coordinator_1
  kills=$((kills + 2))
  wait_percent "$(at 60)"
  stop_one worker_2
  starve_one
  starved=$((starved + 1))
done
over() { state_is coordinator_1 Status exited && state_is coordinator_1 ExitCode 0; }
wait_for 300 over || fail "the coordinator did not finish: $(state coordinator_1 Status)"

record 26 "store after $kills kills, $pauses pauses, $starved out of memory" \
  identical "$(identical "$out")"
summary() { log_of coordinator_1 | sed -n "s/.*\"$1\":\([0-9]*\).*/\1/p" | tail -n 1; }
bad=$(($(summary quarantined) + $(summary disagreements)))
record 26 "cells given up or answered differently" 0 "$bad"
record 24 "workers that left with 0 of $stopped by podman stop" "$stopped" "$left"
compose down
exit "$missed"
