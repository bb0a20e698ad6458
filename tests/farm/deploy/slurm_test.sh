#!/usr/bin/env bash
# A bake by deploy/slurm on a real Slurm cluster of two nodes, whose daemons are killed, whose links
# are cut and whose jobs are cancelled meanwhile: the store is the golden one.
# PVSFARM_FULL=1: a larger scene, every fault three times, and the node that is cut off may be the
# coordinator's.
here=$(dirname "${BASH_SOURCE[0]}")
source "$here/common.sh"
source "$here/slurm_cluster.sh"
need_root
need slurmctld slurmd munged sbatch ip nsenter flock

out=$folder/store/city.pvs
run=$out.farm
done_cells() {
  on_head "$bin/pvsfarm" status "$(cat "$run/endpoint")" --json --key "$run/keys/admin.key" \
    --server-key "$run/keys/farm.pub" 2> /dev/null |
    sed -n 's/.*"cells_done":\([0-9]*\).*/\1/p'
}
reached() {
  local n
  ! grep -qs failed "$run/state" || fail "$(cat "$run/state")"
  n=$(done_cells)
  [ -f "$out" ] || [ "${n:-0}" -ge $((cells * $1 / 100)) ]
}
wait_percent() { wait_for 240 reached "$1" || fail "the bake did not reach $1 %"; }
worker_log() { cat "$run/worker-$1.log" 2> /dev/null; }
logged() { worker_log "$1" | grep -qF "$2"; }
task() { echo "$(cat "$run/workers.job")_$1"; }
job_is() { on_head scontrol -o show job "$1" | grep -q "JobState=$2 "; }
node_of() { on_head squeue -h -j "$1" -o %N; }
other_node() { [ "$1" = n1 ] && echo n2 || echo n1; }

kill_slurmctld() {
  kill_daemon slurmctld
  sleep 1
  start_slurmctld
  wait_for 20 on_head scontrol ping > /dev/null || fail "slurmctld did not come back"
}
kill_slurmd() {
  kill_daemon "slurmd-$1"
  sleep 1
  start_slurmd "$1"
}
cancel_task() {  # it finishes its cell and leaves
  on_head scancel "$(task "$1")"
  wait_for 30 logged "$1" "the worker ended with 0 (cancelled)" || fail "task $1 did not drain"
  drained=$((drained + 1))
}
warn_task() {  # as Slurm does before a time limit: it leaves, and waits for its next turn
  on_head scancel --batch --signal=USR1 "$(task "$1")"
  wait_for 30 logged "$1" "the worker ended with 0 (limit)" || fail "task $1 did not drain"
  wait_for 30 logged "$1" "more is to be done" || fail "task $1 was not queued again"
  drained=$((drained + 1))
}
isolate() {  # NODE SECONDS
  cut_link "$1"
  sleep "$2"
  mend_link "$1"
}

blocks=${PVSFARM_BLOCKS:-4} workers=4 rounds=1
if full_counts; then blocks=5 rounds=3; fi
make_golden "$blocks"
say "golden: $cells cells"
make_network
start_cluster
mkdir -p "$folder/store"
export PATH=$bin:$PATH PVSFARM_CACHE=$folder/cache PVSFARM_MAX_IDLE=15
on_head bash "$source/deploy/slurm/bake.sh" --workers "$workers" \
  "$folder/city.obj" -o "$out" "${scene_options[@]}" --json > "$folder/submit.log"
say "submitted"
wait_percent 5
home=$(node_of "$(cat "$run/coordinator.job")")
say "the coordinator is on $home"

drained=0 killed_ctld=0 killed_slurmd=0 cuts=0
for ((round = 0; round < rounds; round++)); do
  at() { echo $(((100 * round + $1) / rounds)); }
  wait_percent "$(at 8)"
  say "slurmctld killed"; kill_slurmctld; killed_ctld=$((killed_ctld + 1))
  wait_percent "$(at 15)"
  say "scancel"; cancel_task $((1 + round))
  wait_percent "$(at 22)"
  node=$([ $((round % 2)) -eq 0 ] && other_node "$home" || echo "$home")
  say "slurmd of $node killed"; kill_slurmd "$node"; killed_slurmd=$((killed_slurmd + 1))
  wait_percent "$(at 30)"
  say "a task near its time limit"; warn_task 4
  wait_percent "$(at 40)"
  say "$node cut off"; isolate "$node" 14; cuts=$((cuts + 1))
done

finished() { [ -f "$out" ] && [ "$(cat "$run/state" 2> /dev/null)" = over ]; }
wait_for 300 finished || fail "no store: $(cat "$run/state" 2> /dev/null)"
say "finished"
coordinator_done() { job_is "$(cat "$run/coordinator.job")" COMPLETED; }
wait_for 60 coordinator_done || fail "the coordinator's job did not complete"

faults="slurmctld killed $killed_ctld, slurmd killed $killed_slurmd, links cut $cuts times"
record 25 "store after $faults" identical "$(identical "$out")"
summary() { sed -n "s/.*\"$1\":\([0-9]*\).*/\1/p" "$run/coordinator.log" | tail -n 1; }
bad=$(($(summary quarantined) + $(summary disagreements)))
record 25 "cells given up or answered differently" 0 "$bad"
record 24 "Slurm workers that left with 0 of $drained by scancel or time limit" "$drained" \
  "$(cat "$run"/worker-*.log | grep -cE 'ended with 0 \((cancelled|limit)\)')"
exit "$missed"
