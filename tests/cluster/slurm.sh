#!/bin/sh
# Debian's Slurm on this one machine, for tests: slurm.sh start | stop. Needs root; what is missing is installed by apt-get.
# Everything it makes lies under $SLURM_TEST (default /tmp/belt_sim_slurm). No cgroups, so that it runs in a container.
set -eu
HOME_OF=${SLURM_TEST:-/tmp/belt_sim_slurm}
NODE=$(hostname -s)
CPUS=${SLURM_TEST_CPUS:-$(nproc)}

install() {
    command -v slurmctld slurmd slurmdbd munged mariadbd sbatch sacct > /dev/null && return
    export DEBIAN_FRONTEND=noninteractive
    apt-get update -qq
    apt-get install -y -qq --no-install-recommends slurmctld slurmd slurmdbd slurm-client munge mariadb-server > /dev/null
}

configure() {
    mkdir -p "$HOME_OF/state" "$HOME_OF/spool" "$HOME_OF/log" "$HOME_OF/db" /run/munge /run/mysqld
    chown munge: /run/munge
    chown -R mysql: "$HOME_OF/db" /run/mysqld
    [ -s /etc/munge/munge.key ] || { mungekey --create --force; chown munge: /etc/munge/munge.key; }
    cat > "$HOME_OF/slurm.conf" << CONF
ClusterName=belt
SlurmctldHost=$NODE(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
StateSaveLocation=$HOME_OF/state
SlurmdSpoolDir=$HOME_OF/spool
SlurmctldLogFile=$HOME_OF/log/slurmctld.log
SlurmdLogFile=$HOME_OF/log/slurmd.log
SlurmctldPidFile=$HOME_OF/slurmctld.pid
SlurmdPidFile=$HOME_OF/slurmd.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/slurmdbd
AccountingStorageHost=127.0.0.1
ReturnToService=2
SchedulerParameters=batch_sched_delay=1,sched_interval=5
NodeName=$NODE NodeAddr=127.0.0.1 CPUs=$CPUS RealMemory=$(awk '/MemTotal/ {print int($2 / 1024 * 0.9)}' /proc/meminfo)
PartitionName=belt Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
    cat > "$HOME_OF/slurmdbd.conf" << CONF
DbdHost=$NODE
DbdAddr=127.0.0.1
SlurmUser=root
AuthType=auth/munge
StorageType=accounting_storage/mysql
StorageHost=127.0.0.1
StoragePort=33306
StorageUser=slurm
StoragePass=belt
StorageLoc=slurm_acct_db
LogFile=$HOME_OF/log/slurmdbd.log
PidFile=$HOME_OF/slurmdbd.pid
CONF
    chmod 600 "$HOME_OF/slurmdbd.conf"
    mkdir -p /etc/slurm
    ln -sf "$HOME_OF/slurm.conf" /etc/slurm/slurm.conf
    ln -sf "$HOME_OF/slurmdbd.conf" /etc/slurm/slurmdbd.conf
}

until_true() {  # until_true SECONDS COMMAND...
    left=$1
    shift
    until "$@" > /dev/null 2>&1; do
        left=$((left - 1))
        [ "$left" -gt 0 ] || { echo "slurm.sh: gave up waiting for: $*" >&2; exit 1; }
        sleep 1
    done
}

start() {
    install
    configure
    runuser -u munge -- /usr/sbin/munged --pid-file=/run/munge/munged.pid --log-file=/run/munge/munged.log
    [ -d "$HOME_OF/db/mysql" ] || mariadb-install-db --user=mysql --datadir="$HOME_OF/db" > "$HOME_OF/log/install.log" 2>&1
    mariadbd --no-defaults --user=mysql --datadir="$HOME_OF/db" --socket="$HOME_OF/db/socket" --port=33306 \
        --bind-address=127.0.0.1 --pid-file="$HOME_OF/db/mariadbd.pid" > "$HOME_OF/log/mariadbd.log" 2>&1 &
    until_true 60 mariadb-admin --socket="$HOME_OF/db/socket" ping
    mariadb --socket="$HOME_OF/db/socket" -e "CREATE DATABASE IF NOT EXISTS slurm_acct_db;
        CREATE USER IF NOT EXISTS 'slurm'@'127.0.0.1' IDENTIFIED BY 'belt';
        GRANT ALL ON slurm_acct_db.* TO 'slurm'@'127.0.0.1';"
    slurmdbd
    until_true 60 sacctmgr -n show cluster
    sacctmgr -i add cluster belt > /dev/null 2>&1 || true
    slurmctld
    slurmd
    until_true 60 sh -c "sinfo -h -o %t | grep -q idle"
    sinfo
}

stop() {
    for name in slurmd slurmctld slurmdbd db/mariadbd; do
        [ -s "$HOME_OF/$name.pid" ] && kill "$(cat "$HOME_OF/$name.pid")" 2> /dev/null || true
    done
    [ -s /run/munge/munged.pid ] && kill "$(cat /run/munge/munged.pid)" 2> /dev/null || true
    rm -f /etc/slurm/slurm.conf /etc/slurm/slurmdbd.conf
}

case ${1:-} in
    start) start ;;
    stop) stop ;;
    *) echo "usage: slurm.sh start | stop" >&2; exit 2 ;;
esac
