#!/usr/bin/env bash
# A Slurm of two nodes on this machine alone: slurm_up.sh FOLDER, then `export SLURM_CONF=FOLDER/slurm.conf`.
# Debian's packages are enough: slurmctld slurmd slurm-client munge.  slurm_up.sh FOLDER down ends what it started.
set -euo pipefail
folder=$(realpath "$1")
if [ "${2:-}" = down ]; then
    for pid in "$folder"/n?.pid "$folder/slurmctld.pid" "$folder/munged.pid"; do
        [ -s "$pid" ] && kill "$(cat "$pid")" 2>/dev/null || true
    done
    exit 0
fi
mkdir -p "$folder"/{state,n1,n2}
chmod 700 "$folder"
user=$(id -un)
cores=$(getconf _NPROCESSORS_ONLN)  # nproc would heed OMP_NUM_THREADS
memory_mb=$(awk "/MemTotal/ {print int(\$2 / 2048)}" /proc/meminfo)
# Ports that nobody has now.
read -r control first second < <(python3 -c '
import socket
found = [socket.socket() for _ in range(3)]
for one in found: one.bind(("127.0.0.1", 0))
print(*(one.getsockname()[1] for one in found))')
head -c 1024 /dev/urandom > "$folder/munge.key"
chmod 600 "$folder/munge.key"
munged --force --key-file="$folder/munge.key" --socket="$folder/munge.socket" --pid-file="$folder/munged.pid" \
    --log-file="$folder/munged.log" --seed-file="$folder/munge.seed" >> "$folder/daemons.log" 2>&1
cat > "$folder/slurm.conf" <<CONF
ClusterName=loopback
SlurmctldHost=$(hostname -s)(127.0.0.1)
SlurmctldPort=$control
SlurmUser=$user
SlurmdUser=$user
AuthType=auth/munge
AuthInfo=socket=$folder/munge.socket,cred_expire=5
CryptoType=crypto/munge
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/%n
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/%n.pid
SlurmctldLogFile=$folder/slurmctld.log
SlurmdLogFile=$folder/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=2,bf_interval=2,batch_sched_delay=1
SlurmdTimeout=10
MinJobAge=300
ReturnToService=2
MpiDefault=none
NodeName=n1 NodeHostname=$(hostname -s) NodeAddr=127.0.0.1 Port=$first CPUs=$cores RealMemory=$memory_mb
NodeName=n2 NodeHostname=$(hostname -s) NodeAddr=127.0.0.1 Port=$second CPUs=$cores RealMemory=$memory_mb
PartitionName=loopback Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF="$folder/slurm.conf"
slurmctld >> "$folder/daemons.log" 2>&1  # daemons keep what they are given open
slurmd -N n1 >> "$folder/daemons.log" 2>&1
slurmd -N n2 >> "$folder/daemons.log" 2>&1
for _ in $(seq 60); do
    [ "$(sinfo -h -N -t idle -o %n 2>/dev/null | wc -l)" = 2 ] && exit 0
    sleep 0.5
done
sinfo -N >&2
exit 1
