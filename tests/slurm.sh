#!/usr/bin/env bash
# A throw-away Slurm of one node on free ports of 127.0.0.1, with eight CPUs whatever the machine has.
#   tests/slurm.sh start DIRECTORY     up to 30 s; then SLURM_CONF=DIRECTORY/slurm.conf is its address
#   tests/slurm.sh stop DIRECTORY      also after a start that failed; its jobs end, too
# DIRECTORY is emptied by start. The partition `farm` (default) is preempted by `urgent` at once, and
# `graceful` within 20 s: the preempted job is requeued. Needs root and deploy/install-deps.sh --farm.
set -euo pipefail
usage() { sed -n '2,/^set -/s/^# \{0,1\}//p' "$0"; }
refuse() { echo "slurm.sh: $1" >&2; usage >&2; exit 2; }
command=${1:-}
case $command in
  --help) usage; exit 0 ;;
  start | stop) [ $# = 2 ] || refuse "$command wants one DIRECTORY" ;;
  *) refuse "unknown command: $command" ;;
esac
here=$(cd "$(dirname "$0")" && pwd)
mkdir -p "$2"
directory=$(cd "$2" && pwd)
export SLURM_CONF=$directory/slurm.conf

# await SECONDS COMMAND...
await() {
  local end=$((SECONDS + $1))
  shift
  until "$@" >/dev/null 2>&1; do
    [ $SECONDS -lt $end ] || { echo "slurm.sh: gave up waiting for: $*" >&2; return 1; }
    sleep 0.2
  done
}

write_config() {
  local node
  node=$(hostname -s)
  cat >"$SLURM_CONF" <<CONFIG
ClusterName=liquidblend
SlurmctldHost=$node(127.0.0.1)
SlurmctldPort=$1
SlurmdPort=$2
SlurmUser=root
AuthInfo=socket=$directory/munge/socket
StateSaveLocation=$directory/state
SlurmdSpoolDir=$directory/spool
SlurmctldPidFile=$directory/slurmctld.pid
SlurmdPidFile=$directory/slurmd.pid
SlurmctldLogFile=$directory/slurmctld.log
SlurmdLogFile=$directory/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
ReturnToService=2
MinJobAge=3600
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SchedulerParameters=batch_sched_delay=0,sched_min_interval=0,bf_interval=1
SlurmdParameters=config_overrides
PreemptType=preempt/partition_prio
PreemptMode=REQUEUE
NodeName=$node NodeAddr=127.0.0.1 CPUs=8 RealMemory=16000
PartitionName=farm Nodes=$node Default=YES PriorityTier=1
PartitionName=graceful Nodes=$node PriorityTier=1 GraceTime=20
PartitionName=urgent Nodes=$node PriorityTier=10 PreemptMode=OFF
CONFIG
}

# munged trusts files alone that nobody else can change, of folders that nobody else can.
start_munge() {
  mkdir -m 700 "$directory/munge"
  dd if=/dev/urandom of="$directory/munge/key" bs=128 count=1 status=none
  chmod 600 "$directory/munge/key"
  chmod 711 "$directory/munge"
  munged --force --key-file="$directory/munge/key" --socket="$directory/munge/socket" \
    --pid-file="$directory/munged.pid" --log-file="$directory/munged.log" \
    --seed-file="$directory/munge/seed"
}

start() {
  stop  # what an interrupted run has left
  mkdir -p "$directory"/{state,spool}
  local controller_port node_port
  read -r controller_port node_port < <("$here/free_ports.sh" 2)
  write_config "$controller_port" "$node_port"
  {
    start_munge
    slurmctld -f "$SLURM_CONF"
    await 20 scontrol ping
    slurmd -f "$SLURM_CONF"
    await 20 sh -c 'sinfo -h -p farm -t idle | grep -q idle'
  } >"$directory/start.log" 2>&1 || {
    cat "$directory/start.log" "$directory"/*d.log >&2
    stop
    exit 1
  }
}

# end NAME: ends the daemon that this directory's NAME.pid names
end() {
  local pid
  pid=$(cat "$directory/$1.pid" 2>/dev/null) || return 0
  grep -qa -e "$directory/" "/proc/$pid/cmdline" 2>/dev/null || return 0  # gone, or not ours
  kill "$pid" 2>/dev/null || return 0
  await 20 sh -c "! kill -0 $pid" || kill -9 "$pid" 2>/dev/null || true
}

stop() {
  if [ -f "$directory/slurmctld.pid" ]; then
    timeout 10 scancel --full --state=RUNNING --user=root || true
    timeout 10 scancel --user=root || true
    await 30 sh -c '[ -z "$(squeue -h)" ]' || true
  fi
  end slurmd
  end slurmctld
  end munged
  rm -rf "$directory"
}

"$command"
