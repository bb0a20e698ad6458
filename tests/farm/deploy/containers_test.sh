#!/usr/bin/env bash
# The image is built and the farm of deploy/containers/compose.yaml run: an internal network, no
# root, nothing writable but what must be. Its containers are killed, paused, stopped and run out of
# memory meanwhile: the store is the golden one.
# PVSFARM_FULL=1: every fault twice.
here=$(dirname "${BASH_SOURCE[0]}")
source "$here/common.sh"
source "$here/held_bake.sh"
source "$here/image.sh"
rows="24 26"
need_root
need podman podman-compose buildah debootstrap runc iptables ip nsenter
[ -x /usr/lib/podman/netavark ] || skip "netavark is not installed"

rounds=1
! full_counts || rounds=2
faults=$((5 * rounds))
start_engine
build_image
make_golden "${PVSFARM_BLOCKS:-3}" $((3 * faults / 2))

place=$folder/farm
out=$place/out/scene.pvs
project=pvsfarmtest
mkdir -p "$place/out"
PATH=$bin:$PATH bash "$source/deploy/make_keys.sh" "$place/keys"
cp "$folder"/city.obj "$folder"/city.*.json "$place/"
chown -R 10001:10001 "$place"
export PVSFARM_IMAGE=$image PVSFARM_FOLDER=$place PVSFARM_SCENE=city.obj PVSFARM_WORKERS=2
export PVSFARM_MEMORY=300m  # soon full
PVSFARM_OPTIONS="--json --lease 15 ${scene_options[*]}"
export PVSFARM_OPTIONS=${PVSFARM_OPTIONS//$folder/\/data}
cp "$source/deploy/containers/compose.yaml" "$folder/"  # conmon leaves a file beside it
compose() (
  cd "$folder" && nsenter --net="/run/netns/$net" podman-compose --podman-path "$folder/podman" \
    -p "$project" -f "$folder/compose.yaml" "$@" >> "$folder/compose.log" 2>&1
)
container() { echo "${project}_$1"; }
state() { engine inspect "$(container "$1")" --format "{{.State.$2}}" 2> /dev/null; }
state_is() { [ "$(state "$1" "$2")" = "$3" ]; }
pid_differs() { local pid; pid=$(state "$1" Pid); [ "${pid:-0}" -gt 0 ] && [ "$pid" != "$2" ]; }
host() { engine inspect "$(container "$1")" --format '{{.Config.Hostname}}'; }
log_of() { engine logs "$(container "$1")" 2>&1; }

coordinator_pid=
farm() {  # asked on the coordinator's own address 127.0.0.1
  [ -e "/proc/${coordinator_pid:-none}" ] || coordinator_pid=$(state coordinator_1 Pid)
  [ "${coordinator_pid:-0}" -gt 0 ] || return 1
  nsenter --net="/proc/$coordinator_pid/ns/net" "$bin/pvsfarm" "$1" tcp://127.0.0.1:5555 \
    "${@:2}" --key "$place/keys/admin.key" --server-key "$place/keys/farm.pub"
}
lost_more_than() { look; [ "$taken_back" -gt "$1" ]; }

kill_one() {  # NAME: as the kernel would; the engine starts it again
  local pid
  next_fault "$1 killed" "${@:2}"
  pid=$(state "$1" Pid)
  kill -KILL "$pid"
  wait_for 60 pid_differs "$1" "$pid" || fail "$1 was not started again"
  kills=$((kills + 1))
}
pause_one() {  # NAME: until its cells go to others
  local before
  next_fault "$1 paused" "$(host "$1")"
  before=$taken_back
  engine pause "$(container "$1")" > /dev/null
  wait_for 180 lost_more_than "$before" || fail "nobody missed $1"
  engine unpause "$(container "$1")" > /dev/null
  pauses=$((pauses + 1))
}
starve_one() {  # NAME: what is in its /tmp counts as memory, and it is the largest program there
  local pid
  next_fault "$1 out of memory" "$(host "$1")"
  pid=$(state "$1" Pid)
  rm -f "$folder/oom"
  engine exec "$(container "$1")" sh -c 'head -c 400M /dev/zero > "$TMPDIR/full"' \
    > "$folder/full.log" 2>&1 || true
  wait_for 60 pid_differs "$1" "$pid" || fail "$1 was not started again"
  [ -e "$folder/oom" ] || fail "$1 ended, but not for want of memory"
  starved=$((starved + 1))
}
stop_one() {  # NAME: it finishes its cell and leaves
  next_fault "$1 stopped" "$(host "$1")"
  engine stop --time 30 "$(container "$1")" > /dev/null
  stopped=$((stopped + 1))
  ! state_is "$1" ExitCode 0 || left=$((left + 1))
  engine start "$(container "$1")" > /dev/null
}
confined() {  # NAME: no root, no rights, nothing to write, no way out
  engine exec "$(container "$1")" sh -c '[ "$(id -u)" = 10001 ] && ! touch /x && ! touch /usr/x &&
    grep -q "^CapEff:[[:space:]]*0*$" /proc/1/status && grep -q "^NoNewPrivs:.*1" /proc/1/status &&
    ! grep -q "^[a-z0-9]*[[:space:]]00000000[[:space:]]" /proc/net/route' > /dev/null 2>&1
}

compose up -d || fail "compose up: $(tail -n 3 "$folder/compose.log")"
begin_holding
for name in coordinator_1 worker_1 worker_2; do
  confined "$name" || fail "$name has rights that it does not need"
done
say "the farm is up: not root, read-only, no way out"

kills=0 pauses=0 starved=0 stopped=0 left=0
for ((round = 0; round < rounds; round++)); do
  kill_one worker_1 "$(host worker_1)"
  pause_one worker_2
  kill_one coordinator_1
  stop_one worker_1
  starve_one worker_2
done
last_fault_over
over() { state_is coordinator_1 Status exited && state_is coordinator_1 ExitCode 0; }
wait_for 900 over || fail "the coordinator did not finish: $(state coordinator_1 Status)"

[ "$happened" -eq "$faults" ] || fail "$happened of $faults faults"
log_of coordinator_1 > "$folder/coordinator.log"
record_store 26 "$kills kills, $pauses pauses, $starved out of memory, $stopped stops" \
  "$out" "$folder/coordinator.log"
record 24 "workers that left with 0 of $stopped by podman stop" "$stopped" "$left"
compose down
exit "$missed"
