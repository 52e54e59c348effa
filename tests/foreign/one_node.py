"""A Slurm of one node, in a folder of its own: no file, port or socket of another one is touched."""

import os
import pathlib
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "scontrol", "scancel", "squeue", "runuser")
# Tasks that run at a time, whatever the machine has.
CPUS = 4

CONF = """
ClusterName=gonio
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
SlurmUser=root
AuthType=auth/munge
CredType=cred/munge
# A job that is begun again waits as long as its first credential was good for.
AuthInfo=socket={folder}/munge/socket,cred_expire=5
StateSaveLocation={folder}/ctld
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
JobCompType=jobcomp/filetxt
JobCompLoc={folder}/jobs.log
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SwitchType=switch/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
SchedulerParameters=batch_sched_delay=0,sched_interval=1,sched_min_interval=0,bf_interval=1
ReturnToService=2
KillWait=10
BatchStartTimeout=1
MessageTimeout=5
SlurmdTimeout=30
SlurmdParameters=config_overrides
NodeName={host} NodeAddr=127.0.0.1 CPUs={cpus} RealMemory=16000 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def missing():
    """Why there can be no Slurm here, or None."""
    if sys.platform != "linux":
        return "this is no Linux"
    gone = [name for name in PROGRAMS if shutil.which(name) is None]
    if gone:
        return f"no {', '.join(gone)}"
    return None if os.geteuid() == 0 else "slurmd needs root"


def until(true, seconds, what):
    """Waits until something is true, and returns it."""
    end = time.monotonic() + seconds
    while not (found := true()):
        assert time.monotonic() < end, f"{what}: not within {seconds} s"
        time.sleep(0.02)
    return found


def free_ports(count):
    sockets = [socket.socket() for _ in range(count)]
    for s in sockets:
        s.bind(("127.0.0.1", 0))
    ports = [s.getsockname()[1] for s in sockets]
    for s in sockets:
        s.close()
    return ports


def state(pid):
    """What a process does, as one letter: R, S, T (stopped), …; Z, also of one that is gone."""
    try:
        return pathlib.Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return "Z"


class Slurm:
    """Started as it is made; `stop` ends all of it, also what was only half started."""

    def __init__(self):
        # munged wants to be reached by every user, which the folders of tests are not.
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="gonio-slurm-", dir="/tmp"))
        self.folder.chmod(0o755)
        self.conf = self.folder / "slurm.conf"
        # All that is started inherits it: by this it is known again.
        others = {name: value for name, value in os.environ.items() if not name.startswith("SLURM_")}
        self.environment = {**others, "SLURM_CONF": str(self.conf)}

    def start(self):
        (self.folder / "ctld").mkdir()
        (self.folder / "spool").mkdir()
        munge = self.folder / "munge"
        munge.mkdir()
        (munge / "key").write_bytes(os.urandom(128))
        (munge / "key").chmod(0o600)
        for path in (munge / "key", munge):
            shutil.chown(path, "munge", "munge")
        options = {"socket": "socket", "key-file": "key", "pid-file": "pid", "log-file": "log", "seed-file": "seed"}
        options = [f"--{option}={munge / file}" for option, file in options.items()]
        self.command("runuser", "-u", "munge", "--", shutil.which("munged"), *options)
        host = socket.gethostname().split(".")[0]
        text = CONF.format(host=host, ports=free_ports(2), folder=self.folder, cpus=CPUS)
        self.conf.write_text(text)
        self.command("slurmctld")
        self.command("slurmd")
        until(lambda: self.command("sinfo", "--noheader", "--format=%t") == "idle", 30, "the node is idle")

    def command(self, *args, cwd=None):
        """What a command prints."""
        done = subprocess.run(
            [str(a) for a in args], env=self.environment, cwd=cwd, capture_output=True, text=True, timeout=60
        )
        assert done.returncode == 0, f"{args}: {done.stdout}{done.stderr}{self.logs()}"
        return done.stdout.strip()

    def logs(self):
        """The ends of the logs."""
        logs = sorted(self.folder.glob("*.log"))
        return "".join(f"\n== {log.name}\n" + "".join(log.read_text().splitlines(True)[-20:]) for log in logs)

    def states(self, job):
        """State and reason of every task of a job, by its number; of a job without tasks by None."""
        lines = self.command("squeue", "--noheader", "--array", "--states=all", f"--jobs={job}", "--format=%K %T %r")
        rows = (line.split(None, 2) for line in lines.splitlines())
        return {int(task) if task.isdigit() else None: (state, reason) for task, state, reason in rows}

    def ended(self, job, seconds=60):
        """The states of the tasks of a job once all of them have ended."""
        running = ("PENDING", "RUNNING", "COMPLETING", "CONFIGURING", "REQUEUED")

        def states():
            found = self.states(job)
            return found if all(state not in running for state, _ in found.values()) else None

        return {task: state for task, (state, _) in until(states, seconds, f"job {job} ends").items()}

    def processes(self, **variables):
        """Numbers of the processes here whose environment has these values, those of this Slurm."""
        wanted = {f"{k}={v}".encode() for k, v in {"SLURM_CONF": self.conf, **variables}.items()}
        found = []
        for entry in pathlib.Path("/proc").iterdir():
            if entry.name.isdigit():
                try:
                    has = set((entry / "environ").read_bytes().split(b"\0"))
                except OSError:
                    continue
                if wanted <= has and int(entry.name) != os.getpid():
                    found.append(int(entry.name))
        return found

    def fail(self, process):
        """What is left of a task when its node dies: nothing, and nobody tells."""
        status = pathlib.Path(f"/proc/{process}/status").read_text()
        parent = int(status.split("PPid:")[1].split()[0])
        assert pathlib.Path(f"/proc/{parent}/comm").read_text().strip() == "slurmstepd"
        os.kill(parent, signal.SIGKILL)
        os.kill(process, signal.SIGKILL)

    def reboot(self):
        """A node that comes back says what runs on it, and Slurm learns what does not."""
        # Of a task that has just begun nothing need be there yet: BatchStartTimeout and MessageTimeout, in whole seconds.
        time.sleep(7)
        self.end("slurmd.pid")
        self.command("slurmd")

    def end(self, file):
        """Ends the daemon of a pid file."""
        path = self.folder / file
        if path.exists():
            pid = int(path.read_text())
            os.kill(pid, signal.SIGTERM)
            until(lambda: state(pid) == "Z", 20, f"{file} ends")

    def stop(self):
        """Ends all that was started, and removes the folder."""
        try:
            if (self.folder / "slurmctld.pid").exists():
                self.command("scancel", "--user=root")
                until(lambda: not self.command("squeue", "--noheader"), 30, "no job is left")
        finally:
            self.end_all()

    def end_all(self):
        try:
            for file in ("slurmctld.pid", "slurmd.pid", "munge/pid"):
                self.end(file)
        finally:
            # Tasks that did not hear of it.
            for process in self.processes():
                os.kill(process, signal.SIGKILL)
            shutil.rmtree(self.folder)
