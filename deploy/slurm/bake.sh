#!/usr/bin/env bash
# A bake on a Slurm cluster: one job for the coordinator, an array of jobs for the workers.
#   bash deploy/slurm/bake.sh --workers 20 scene.glb -o /shared/scene.pvs [options of a bake]
#   ... --sbatch "--partition=night"    options for both submissions; several times, if need be
# Returns at once and says what it submitted. Whatever scancel, time limits, preemption and lost
# nodes do, the same command goes on where the journal ends. The programs must be in PATH on every
# node, and the output on a file system that all nodes share.
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
workers=10
sbatch_options=()
bake=()
out=
while [ $# -gt 0 ]; do
  case $1 in
    --workers) workers=$2; shift ;;
    --sbatch) read -ra more <<< "$2"; sbatch_options+=("${more[@]}"); shift ;;
    -h | --help) sed -n '2,/^set/{/^set/d;s/^# \{0,1\}//p}' "${BASH_SOURCE[0]}"; exit 0 ;;
    -o | --output) out=$2; bake+=("$1" "$2"); shift ;;
    *) bake+=("$1") ;;
  esac
  shift
done
[ -n "$out" ] || { echo "bake.sh: no -o OUT.pvs; see --help" >&2; exit 1; }
for program in pvsfarm pvsfarm-worker sbatch; do
  command -v "$program" > /dev/null || { echo "bake.sh: $program is not in PATH" >&2; exit 5; }
done
[ ! -e "$out" ] || echo "bake.sh: $out exists; if it is of this bake, there is nothing to do" >&2

run=$(realpath "$out").farm
mkdir -p "$run"
chmod 700 "$run"
rm -f "$run/state" "$run/endpoint" "$run/coordinator.job" "$run/workers.job"
bash "$here/../make_keys.sh" "$run/keys"

coordinator=$(sbatch --parsable "${sbatch_options[@]}" --output="$run/coordinator.log" \
  "$here/coordinator.sbatch" "$run" "${bake[@]}")
array=$(sbatch --parsable "${sbatch_options[@]}" --dependency="after:$coordinator" \
  --array="1-$workers" --output="$run/worker-%a.log" "$here/worker.sbatch" "$run")
echo "$coordinator" > "$run/coordinator.job"
echo "$array" > "$run/workers.job"
cat <<END
coordinator: job $coordinator, log $run/coordinator.log
workers:     jobs ${array}_1 to ${array}_$workers, logs $run/worker-*.log
How far:     tail $run/coordinator.log, or
             pvsfarm status "\$(cat $run/endpoint)" --key $run/keys/admin.key \\
               --server-key $run/keys/farm.pub
Fewer:       scancel ${array}_7 (it finishes its cell first)
Stop:        scancel $coordinator (the same command goes on)
END
