#!/usr/bin/env bash
# A bake by deploy/slurm on a real Slurm cluster of two nodes, whose daemons are killed, whose links
# are cut and whose jobs are cancelled and queued again meanwhile: the store is the golden one.
# PVSFARM_FULL=1: every fault twice, the second time at the coordinator's own node.
here=$(dirname "${BASH_SOURCE[0]}")
source "$here/common.sh"
source "$here/held_bake.sh"
source "$here/slurm_cluster.sh"
rows="24 25"
need_root
need slurmctld slurmd munged sbatch ip nsenter flock

out=$folder/store/city.pvs
run=$out.farm
home() {  # the coordinator's node
  case $(cat "$run/endpoint" 2> /dev/null) in
    *"//${node_ip[n1]}:"*) echo n1 ;;
    *"//${node_ip[n2]}:"*) echo n2 ;;
    *) return 1 ;;
  esac
}
farm() {  # asked on its own node, which answers while its link is cut
  ! grep -qs failed "$run/state" || fail "$(cat "$run/state")"
  in_net "$(home)" "$bin/pvsfarm" "$1" "$(cat "$run/endpoint")" "${@:2}" \
    --key "$run/keys/admin.key" --server-key "$run/keys/farm.pub"
}
count() { grep -cF "$1" "$2" 2> /dev/null || true; }  # TEXT FILE: lines
counts_more() { [ "$(count "$1" "$2")" -gt "$3" ]; }
task() { echo "$(cat "$run/workers.job")_$1"; }
running_task() {  # head or tail: the first or the last of those that run
  on_head squeue -h -t R -j "$(cat "$run/workers.job")" -o %K | sort -n | "$1" -n 1
}
job_is() { on_head scontrol -o show job "$1" | grep -q "JobState=$2 "; }
node_is() { [[ $(on_head sinfo -h -n "$1" -o %T) =~ ^($2)$ ]]; }
other_node() { [ "$1" = n1 ] && echo n2 || echo n1; }

kill_slurmctld() {
  next_fault "slurmctld killed"
  kill_daemon slurmctld
  ! on_head scontrol ping | grep -q 'is UP' || fail "slurmctld still answers"
  goes_on "without slurmctld"
  start_slurmctld
  wait_for 60 nodes_up || fail "slurmctld did not come back"
  ctlds=$((ctlds + 1))
}
kill_slurmd() {  # NODE
  next_fault "slurmd of $1 killed"
  kill_daemon "slurmd-$1"
  goes_on "without slurmd of $1"
  start_slurmd "$1"
  wait_for 120 node_is "$1" 'idle|mixed|allocated' || fail "$1 did not come back"
  slurmds=$((slurmds + 1))
}
cut_off() {  # NODE: until Slurm gives it up, and what ran there starts elsewhere
  next_fault "$1 cut off"
  cut_link "$1"
  wait_for 180 node_is "$1" 'down\*?' || fail "Slurm does not miss $1"
  mend_link "$1"
  wait_for 180 node_is "$1" 'idle|mixed|allocated' || fail "$1 did not come back"
  cuts=$((cuts + 1))
}
exec_on_head() { exec nsenter --net="/run/netns/$net-head" "$@"; }
leaves() {  # TASK WHY COMMAND...: it finishes its cell and leaves with 0
  local log=$run/worker-$1.log line="ended with 0 ($2)" before teller
  before=$(count "$line" "$log")
  SLURM_CONF=$folder/slurm.conf exec_on_head "${@:3}" & teller=$!
  asked=$((asked + 1))
  ! wait_for 60 counts_more "$line" "$log" "$before" || drained=$((drained + 1))
  kill "$teller" 2> /dev/null || true  # scancel tries again while the job is being queued again
  wait "$teller" || true
}
cancel_worker() {
  next_fault "scancel of a worker"
  index=$(running_task head)
  leaves "$index" cancelled scancel "$(task "$index")"
}
warn_worker() {  # as Slurm does before a time limit: it leaves, and waits for its next turn
  next_fault "a worker near its time limit"
  index=$(running_task tail)
  leaves "$index" limit scancel --batch --signal=USR1 "$(task "$index")"
}
requeue_coordinator() {  # as Slurm does for a job of more weight
  local log=$run/coordinator.log line="the coordinator ended with 130" before
  next_fault "the coordinator's job queued again"
  before=$(count "$line" "$log")
  on_head scontrol requeue "$(cat "$run/coordinator.job")"
  wait_for 60 counts_more "$line" "$log" "$before" || fail "the coordinator did not end"
  requeues=$((requeues + 1))
}

workers=8 rounds=1  # three workers find room at once
! full_counts || rounds=2
faults=$((6 * rounds))
make_golden "${PVSFARM_BLOCKS:-3}" $((3 * faults / 2))
make_network
start_cluster
mkdir -p "$folder/store"
export PATH=$bin:$PATH PVSFARM_CACHE=$folder/cache PVSFARM_MAX_IDLE=30
on_head bash "$source/deploy/slurm/bake.sh" --workers "$workers" \
  "$folder/city.obj" -o "$out" "${scene_options[@]}" --json > "$folder/submit.log"
say "submitted"
begin_holding
# Slurm itself forgets jobs of the last seconds when it is killed.
kept() { [ "$folder/state/job_state" -nt "$folder/running" ]; }
three_run() { [ "$(on_head squeue -h -t R -o %K -r 2> /dev/null | grep -c '[0-9]')" -ge 3 ]; }
wait_for 120 three_run || fail "the workers did not start"
touch "$folder/running"
wait_for 120 kept || fail "Slurm does not keep its state"

asked=0 drained=0 ctlds=0 slurmds=0 cuts=0 requeues=0
for ((round = 0; round < rounds; round++)); do
  kill_slurmctld
  cancel_worker
  kill_slurmd "$([ $((round % 2)) -eq 0 ] && other_node "$(home)" || home)"
  warn_worker
  cut_off "$([ $((round % 2)) -eq 0 ] && other_node "$(home)" || home)"
  requeue_coordinator
done
last_fault_over

finished() { [ -f "$out" ] && [ "$(cat "$run/state" 2> /dev/null)" = over ]; }
wait_for 900 finished || fail "no store: $(cat "$run/state" 2> /dev/null)"
coordinator_done() { job_is "$(cat "$run/coordinator.job")" COMPLETED; }
wait_for 60 coordinator_done || fail "the coordinator's job did not complete"

[ "$happened" -eq "$faults" ] || fail "$happened of $faults faults"
record_store 25 "slurmctld killed $ctlds, slurmd killed $slurmds, a link cut $cuts, \
coordinator queued again $requeues times" "$out" "$run/coordinator.log"
record 24 "Slurm workers that left with 0 of $asked by scancel or before a time limit" \
  "$asked" "$drained"
exit "$missed"
