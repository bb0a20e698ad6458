# A Slurm cluster of a head and two nodes on this machine, each in a network namespace of its own,
# around one bridge; sourced after common.sh. on_head COMMAND... runs a command on the head.
net=pvsd$$
head_ip=10.213.7.1
declare -A node_ip=([n1]=10.213.7.11 [n2]=10.213.7.12)
declare -A daemon=()  # pid by name

in_net() { nsenter --net="/run/netns/$net-$1" "${@:2}"; }
on_head() { SLURM_CONF=$folder/slurm.conf in_net head "$@"; }

add_host() {  # NAME ADDRESS
  add_namespace "$net-$1"
  ip -n "$net-$1" link set lo up
  ip -n "$net-$1" link add eth0 type veth peer name "to-$1" netns "$net-sw"
  ip -n "$net-$1" address add "$2/24" dev eth0
  ip -n "$net-$1" link set eth0 up
  ip -n "$net-sw" link set "to-$1" master br0 up
}
cut_link() { ip -n "$net-sw" link set "to-$1" down; }
mend_link() { ip -n "$net-sw" link set "to-$1" up; }

make_network() {
  add_namespace "$net-sw"
  ip -n "$net-sw" link add br0 type bridge
  ip -n "$net-sw" link set br0 up
  add_host head "$head_ip"
  add_host n1 "${node_ip[n1]}"
  add_host n2 "${node_ip[n2]}"
}

start_daemon() {  # NAME COMMAND...: in the foreground of a child
  local name=$1
  shift
  SLURM_CONF=$folder/slurm.conf "$@" >> "$folder/$name.log" 2>&1 &
  daemon[$name]=$!
  disown
}
kill_daemon() {  # NAME
  kill -KILL "${daemon[$1]}" 2> /dev/null || true
  while kill -0 "${daemon[$1]}" 2> /dev/null; do sleep 0.05; done
}
start_slurmctld() { start_daemon slurmctld nsenter --net="/run/netns/$net-head" slurmctld -D; }
start_slurmd() { start_daemon "slurmd-$1" nsenter --net="/run/netns/$net-$1" slurmd -D -N "$1"; }

end_cluster() {
  local name step
  for name in slurmd-n1 slurmd-n2 slurmctld munged; do
    [ -z "${daemon[$name]:-}" ] || kill_daemon "$name"
  done
  # Job steps are children of nobody by now; the cluster's own folder in their command tells them.
  for step in $(pgrep -f "slurmstepd.*|$folder" || true); do
    grep -qz "^SLURM_CONF=$folder/slurm.conf" "/proc/$step/environ" 2> /dev/null &&
      kill -KILL "$step" 2> /dev/null
  done
  return 0
}

start_cluster() {
  mkdir -p "$folder"/{munge,state,n1,n2}
  chmod 755 "$folder"
  chmod 711 "$folder/munge"
  dd if=/dev/urandom of="$folder/munge/key" bs=128 count=1 status=none
  chmod 400 "$folder/munge/key"
  cat > "$folder/slurm.conf" << END
ClusterName=pvsfarm
SlurmctldHost=$(hostname)($head_ip)
AuthType=auth/munge
AuthInfo=socket=$folder/munge/socket,cred_expire=10
CredType=cred/munge
CryptoType=crypto/munge
SlurmUser=root
SlurmctldPidFile=$folder/state/slurmctld.pid
SlurmdPidFile=$folder/%n/slurmd.pid
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/%n/spool
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
PropagateResourceLimits=NONE
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=batch_sched_delay=1,sched_interval=2,bf_interval=2
ReturnToService=2
SlurmctldTimeout=30
SlurmdTimeout=15
KillWait=28
MinJobAge=3600
SlurmdParameters=config_overrides
NodeName=DEFAULT CPUs=2 RealMemory=12000 State=UNKNOWN
NodeName=n1 NodeHostname=$(hostname) NodeAddr=${node_ip[n1]} Port=17001
NodeName=n2 NodeHostname=$(hostname) NodeAddr=${node_ip[n2]} Port=17002
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
END
  undo+=(end_cluster)
  start_daemon munged munged --foreground --force --key-file="$folder/munge/key" \
    --socket="$folder/munge/socket" --pid-file="$folder/munge/pid" \
    --log-file="$folder/munge/munged.log" --seed-file="$folder/munge/seed"
  wait_for 10 test -S "$folder/munge/socket" || fail "munged did not start"
  start_slurmctld
  start_slurmd n1
  start_slurmd n2
  wait_for 30 nodes_idle || fail "the nodes did not come up: $(on_head sinfo -h)"
}
nodes_idle() { [ "$(on_head sinfo -h -t idle -o %D 2> /dev/null)" = 2 ]; }
nodes_up() { on_head sinfo -h > /dev/null 2>&1; }
