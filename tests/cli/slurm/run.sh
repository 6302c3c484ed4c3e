#!/usr/bin/env bash
# Recognises 1,000 unknowns as a job array on a Slurm cluster of two nodes, which it starts on this
# machine. Kills one task, and all of one node. The results must be those of one process, byte for
# byte.
#
#   run.sh SCRATCH PALPATE BATCH_SCRIPT
#
# Exits with 77 (skipped) and the reason where Slurm cannot be started: it takes root, the packages
# slurm-wlm and munge, and mounted cgroups, which a chroot may lack. Takes about two minutes.
set -euo pipefail

skip() {
  echo "skipped: $*"
  exit 77
}

fail() {
  echo "failed: $*"
  exit 1
}

for tool in slurmctld slurmd sbatch srun munged python3; do
  PATH=$PATH:/usr/sbin command -v "$tool" >/dev/null ||
    skip "$tool is not installed; install slurm-wlm and munge"
done
[ "$(id -u)" -eq 0 ] || skip "starting slurmd needs root"

rm -rf "$1"
mkdir -p "$1"/{bin,state,n1,n2}
scratch=$(cd "$1" && pwd)
batch_script=$(realpath "$3")
short=$(mktemp -d) # the path of a socket has at most 107 bytes
ln -s "$(realpath "$2")" "$scratch/bin/palpate"
export PATH=$scratch/bin:$PATH:/usr/sbin
export SLURM_CONF=$scratch/slurm.conf
cd "$scratch"

# with VARIABLE=VALUE...: the processes of this cluster with one of these in their environment, and
# the slurmstepd that have started them, which overwrite theirs. Not this script's own.
with() {
  local setting pid pids parent parents=() options=()
  for setting in "$@"; do options+=(-e "^$setting\$"); done
  mapfile -t pids < <(grep -lsz "${options[@]}" /proc/[0-9]*/environ | cut -d/ -f3)
  for pid in "${pids[@]}"; do
    if grep -qsz "^SLURM_CONF=$SLURM_CONF\$" "/proc/$pid/environ" && [ "$pid" != $$ ]; then
      echo "$pid"
      parent=$(cut -d' ' -f4 "/proc/$pid/stat" 2>/dev/null) || continue
      if grep -qs '^slurmstepd' "/proc/$parent/comm"; then parents+=("$parent"); fi
    fi
  done
  printf '%s\n' "${parents[@]}" | sort -u
}
# Those of a node: slurmd inherits TEST_NODE, Slurm sets SLURMD_NODENAME for the rest.
of_node() { with "TEST_NODE=$1" "SLURMD_NODENAME=$1"; }
# Kills all at once: none may tell of another's end before its own.
kill_all() {
  kill -STOP "$@" 2>/dev/null || true # some end by themselves meanwhile
  kill -KILL "$@" 2>/dev/null || true
}
end() {
  local status=$?
  trap - EXIT
  if [ "$status" -ne 0 ] && [ "$status" -ne 77 ]; then
    tail -n 40 ./*.log
    squeue || true
    sinfo || true
  fi
  mapfile -t pids < <(with "SLURM_CONF=$SLURM_CONF")
  kill_all "${pids[@]}"
  rm -rf "$short"
  exit "$status"
}
trap end EXIT

# until_true SECONDS WHAT COMMAND...
until_true() {
  local left=$((5 * $1)) what=$2
  shift 2
  until "$@"; do
    left=$((left - 1))
    [ "$left" -gt 0 ] || fail "waited in vain until $what"
    sleep 0.2
  done
}

read -r controller n1 n2 < <(/usr/bin/python3 -c '
import socket
sockets = [socket.socket() for _ in range(3)]
for s in sockets:
    s.bind(("127.0.0.1", 0))
print(*(s.getsockname()[1] for s in sockets))')
cat > slurm.conf <<END
ClusterName=palpate
SlurmctldHost=$(hostname)(127.0.0.1)
SlurmctldPort=$controller
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$short/munge.socket
CredType=cred/munge
StateSaveLocation=$scratch/state
SlurmctldPidFile=$scratch/slurmctld.pid
SlurmdSpoolDir=$scratch/%n
SlurmdPidFile=$scratch/%n.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SlurmdParameters=config_overrides
AccountingStorageType=accounting_storage/none
JobCompType=jobcomp/none
MpiDefault=none
SchedulerType=sched/builtin
SlurmdTimeout=6
KillWait=1
CompleteWait=0
ReturnToService=2
NodeName=n1 NodeHostname=$(hostname) NodeAddr=127.0.0.1 Port=$n1 CPUs=2 RealMemory=4096
NodeName=n2 NodeHostname=$(hostname) NodeAddr=127.0.0.1 Port=$n2 CPUs=2 RealMemory=4096
PartitionName=all Nodes=n1,n2 Default=YES State=UP
END
head -c 128 /dev/urandom > munge.key
chmod 400 munge.key

declare -A slurmd_of
start_node() {
  TEST_NODE=$1 slurmd -D -N "$1" >> "$1.log" 2>&1 &
  slurmd_of[$1]=$!
  disown
}
runs() { kill -0 "${slurmd_of[$1]}" 2>/dev/null; }
node_is() { sinfo -h -n "$1" -o %T | grep -Eq "$2"; }
munged --foreground --force --key-file munge.key --socket "$short/munge.socket" \
  --pid-file munge.pid --seed-file munge.seed --log-file munge.log > munged.log 2>&1 &
disown # its death is no news
until_true 10 "munged listens" test -S "$short/munge.socket"
slurmctld -D > slurmctld.log 2>&1 &
disown
start_node n1
start_node n2
idle_or_ended() { node_is "$1" '^idle' || ! runs "$1"; }
for node in n1 n2; do
  until_true 30 "$node is idle" idle_or_ended "$node"
  runs "$node" || skip "slurmd cannot start: $(sed -n 's/.*error: *//p' "$node.log" | head -n 1)"
done

echo "Ten recordings, of each a hundred rows of nine touches"
mkdir train unknowns
for letter in A E I O U; do
  palpate simulate "$letter" -o "train/$letter.h5" --seed 1 > /dev/null
  for seed in 2 3; do
    palpate simulate "$letter" -o "unknowns/$letter$seed.h5" --seed "$seed" \
      --object-pose random > /dev/null
  done
done
palpate map train/*.h5 -o maps/ > /dev/null
{
  echo path,frames
  for file in unknowns/*.h5; do
    for first in $(seq 0 99); do
      echo "$file,$first:$((first + 9))"
    done
  done
} > list.csv
flags=(--maps maps/ --filter histogram --bins 25x25x16 --x-mm=-10:10 --y-mm=-10:10 --chunk 10)
palpate batch list.csv -o direct/ "${flags[@]}"
palpate merge direct/ -o direct.ndjson

submit() {
  sbatch --parsable --array=0-3 --cpus-per-task=1 --mem=512 --chdir="$scratch" "$batch_script" \
    list.csv results/ "${flags[@]}"
}
computes() { # NODE
  local pid
  for pid in $(of_node "$1"); do
    if [ "$(cat "/proc/$pid/comm" 2>/dev/null)" = palpate ]; then return 0; fi
  done
  return 1
}
chunks() { [ "$(find results/chunks -name '*.ndjson' 2>/dev/null | wc -l)" -ge "$1" ]; }
ended() {
  local left
  left=$(squeue -h -t all -j "$job" -o %T) && ! grep -Evq '^(COMPLETED|FAILED|NODE_FAIL)$' <<< "$left"
}
restarted() { grep -q 'Restarts=[1-9]' <<< "$(scontrol show job "$job")"; }

job=$(submit)
until_true 60 "node 1 computes" computes n1
until_true 60 "node 2 computes" computes n2
until_true 60 "some chunks are finished" chunks 8
echo "A task on node 1 is killed"
read -r killed < <(squeue -h -r -j "$job" -w n1 -o %K) || fail "node 1 has no task left to kill"
mapfile -t pids < <(with "SLURM_ARRAY_TASK_ID=$killed")
for pid in "${pids[@]}"; do
  if [ "$(cat "/proc/$pid/comm" 2>/dev/null)" = palpate ]; then kill -KILL "$pid" || true; fi
done
echo "Node 2 is killed, with its daemon and its tasks"
computes n2 || fail "node 2 has no task left to kill"
mapfile -t pids < <(of_node n2)
kill_all "${pids[@]}"
until_true 60 "node 2 is down" node_is n2 '^down'
until_true 60 "its tasks are queued again" restarted
start_node n2
for task in $(squeue -h -r -t PENDING -j "$job" -o %i); do
  scontrol update "jobid=$task" starttime=now # Slurm lets them wait for two minutes
done
until_true 200 "the tasks have ended" ended

for chunk in $(seq 0 99); do
  if [ $((chunk % 4)) -ne "$killed" ] && [ ! -f "results/chunks/$(printf %06d "$chunk").ndjson" ]; then
    fail "chunk $chunk is missing, whose task was not the killed one"
  fi
done
if palpate merge results/ -o results.ndjson 2> merge.err; then
  fail "the killed task has left nothing undone"
fi
cat merge.err
echo "The array is submitted again, for what the killed task has left"
job=$(submit)
until_true 120 "the tasks have ended" ended
palpate merge results/ -o results.ndjson
cmp direct.ndjson results.ndjson
[ "$(wc -l < results.ndjson)" -eq 1000 ]
echo "1,000 unknowns: the bytes of one process"
