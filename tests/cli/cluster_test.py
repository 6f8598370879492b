"""Bricks by Snakemake on this machine, and through a Slurm cluster that is started for the test.

    COVOL=build/bin/covol python3 -m unittest tests/cli/cluster_test.py
"""
import csv
import json
import os
import pathlib
import random
import secrets
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import unittest

import numpy as np
import tifffile

from covol_case import COVOL, Case, write_xyz

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "houdini_free_examples"
WORKFLOW = EXAMPLES / "bricks"


def missing(*programs):
    return [program for program in programs if shutil.which(program) is None]


class Workflow(Case):
    """A torus in bricks, computed once without a scheduler; Snakemake's result has to be the same."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        image, marks = cls.inputs / "torus.nrrd", cls.inputs / "torus.xyz"
        cls.covol("phantom", "torus", "--size", "96", "--count", "5000", "-o", image, "--points", marks)
        cls.job = ["segment", image, "--points", marks, "--model", "paper", "--brick-voxels", "30000"]
        cls.covol("brick", "plan", *cls.job, "-o", cls.inputs / "plan")
        shutil.copytree(cls.inputs / "plan", cls.inputs / "calm")
        cls.covol("brick", "run", cls.inputs / "calm")
        cls.covol("brick", "join", cls.inputs / "calm", "-o", cls.inputs / "calm.vdb", "--mesh", cls.inputs / "calm.ply")
        cls.bricks = len(json.loads((cls.inputs / "plan/plan.json").read_text())["bricks"])

    @staticmethod
    def covol(*args):
        subprocess.run([COVOL, *map(str, args), "--quiet"], check=True, stdout=subprocess.DEVNULL)

    def setUp(self):
        super().setUp()
        shutil.copytree(self.inputs / "plan", self.out / "plan")

    def snakemake(self, *more, environment=None):
        command = ["snakemake", "-s", WORKFLOW / "Snakefile", "-j", "2", "--latency-wait", "30", *more, "--config", "plan=plan",
                   "out=joined.vdb", f"covol={pathlib.Path(COVOL).resolve()}", "threads=1", "join=--mesh joined.ply"]
        return subprocess.Popen(list(map(str, command)), cwd=self.out, env={**os.environ, **(environment or {})}, text=True,
                                stdout=subprocess.PIPE, stderr=subprocess.STDOUT, start_new_session=True)

    def check(self, run):
        output = run.communicate(timeout=600)[0]
        self.assertEqual(run.returncode, 0, output)
        self.assertEqual((self.out / "joined.ply").read_bytes().split(b"end_header")[1],
                         (self.inputs / "calm.ply").read_bytes().split(b"end_header")[1])
        return output


@unittest.skipIf(missing("snakemake"), "snakemake is not installed")
class Snakemake(Workflow):
    def test_two_slots(self):
        self.assertGreaterEqual(self.bricks, 4)
        self.check(self.snakemake())

    def test_killed_and_started_again(self):
        chance = random.Random(2)
        for _ in range(3):
            run = self.snakemake("--rerun-incomplete", "--nolock")
            time.sleep(chance.uniform(1, 6))
            os.killpg(run.pid, signal.SIGKILL)
            run.communicate()
        self.check(self.snakemake("--rerun-incomplete", "--nolock"))


@unittest.skipIf(missing("snakemake"), "snakemake is not installed")
class ManyImages(Case):
    """Each image, or frame, has the same result as with covol segment alone."""

    def run_workflow(self, *config):
        done = subprocess.run(["snakemake", "-s", str(EXAMPLES / "many/Snakefile"), "-j", "2", "--config", *map(str, config),
                               "out=many", f"covol={pathlib.Path(COVOL).resolve()}", "threads=1", "options=--max-steps 40"],
                              cwd=self.out, text=True, capture_output=True, timeout=600)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        with open(self.out / "many/table.csv", newline="") as table:
            return done.stderr, list(csv.DictReader(table))

    def compare(self, name, *job):
        self.run_covol("segment", *job, "--max-steps", "40", "-o", "own.vdb", "--mesh", "own.ply")
        mine, theirs = ((self.out / path).read_bytes().split(b"end_header")[1] for path in ("own.ply", f"many/{name}.ply"))
        self.assertEqual(mine, theirs)

    def test_folder(self):
        for shape in ("sphere", "torus", "two-spheres"):
            self.run_covol("phantom", shape, "--size", "40", "--count", "2000", "-o", f"{shape} a.nrrd", "--points", f"{shape} a.xyz")
        (self.out / "torus a.xyz").unlink()
        output, rows = self.run_workflow("images={name}.nrrd", "marks={name}.xyz")
        self.assertIn("torus a: no torus a.xyz, left out", output)
        self.assertEqual([row["name"] for row in rows], ["sphere a", "two-spheres a"])
        self.assertTrue(all(float(row["volume"]) > 0 for row in rows))
        self.compare("sphere a", "sphere a.nrrd", "--points", "sphere a.xyz")

    def test_frames(self):
        z, y, x = np.mgrid[0:24, 0:24, 0:24]
        marks = np.random.default_rng(1).normal(size=(800, 3))
        marks /= np.linalg.norm(marks, axis=1)[:, None]
        movie = []
        for frame in range(3):
            radius = 6 + frame
            movie.append(np.clip(128 + 40 * (radius - np.sqrt((x - 12) ** 2 + (y - 12) ** 2 + (z - 12) ** 2)), 0, 255))
            write_xyz(self.out / f"marks_{frame:03d}.xyz", map(tuple, 12 + radius * marks))
        tifffile.imwrite(self.out / "movie.tif", np.array(movie).astype(np.uint8), imagej=True, resolution=(1, 1),
                         metadata={"axes": "TZYX", "spacing": 1, "unit": "um"})
        _, rows = self.run_workflow("movie=movie.tif", "marks=marks_{name}.xyz")
        self.assertEqual([row["name"] for row in rows], ["000", "001", "002"])
        for frame, row in enumerate(rows):
            self.assertAlmostEqual((3 * float(row["volume (um^3)"]) / (4 * np.pi)) ** (1 / 3), 6 + frame, delta=0.3)
        self.compare("002", "movie.tif", "--frame", "2", "--points", "marks_002.xyz")


SLURM = """ClusterName=covol
SlurmctldHost={host}(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
SlurmctldPort={port}
SlurmdPort={next}
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=none
ReturnToService=2
SchedulerParameters=sched_min_interval=100000
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} State=UNKNOWN
PartitionName=main Nodes={host} Default=YES MaxTime=INFINITE State=UP
"""


@unittest.skipIf(missing("snakemake", "slurmctld", "slurmd", "munged", "sbatch"), "snakemake or slurm-wlm is not installed")
@unittest.skipIf(os.geteuid() != 0, "a Slurm of one's own needs root")
class Slurm(Workflow):
    def start_slurm(self):
        """@return the environment for Slurm's clients; None if Slurm cannot be run on this machine"""
        folder = pathlib.Path(tempfile.mkdtemp(prefix="covol-slurm-"))
        for name in ("munge", "state", "spool"):
            (folder / name).mkdir(mode=0o700)
        key = folder / "munge/key"
        key.write_bytes(secrets.token_bytes(1024))
        key.chmod(0o400)
        port = 20000 + os.getpid() % 20000
        config = folder / "slurm.conf"
        host = socket.gethostname().split(".")[0]
        config.write_text(SLURM.format(folder=folder, host=host, port=port, next=port + 1, cores=os.cpu_count()))
        environment = {"SLURM_CONF": str(config)}
        own = {**os.environ, **environment}
        self.addCleanup(shutil.rmtree, folder, ignore_errors=True)

        def stop():
            for pid in [folder / "slurmd.pid", folder / "slurmctld.pid", folder / "munge/pid"]:
                if pid.exists():
                    try:
                        os.kill(int(pid.read_text()), signal.SIGTERM)
                    except ProcessLookupError:
                        pass
            time.sleep(1)
        self.addCleanup(stop)
        munge = ["munged", "--force", f"--key-file={key}", f"--socket={folder}/munge/socket", f"--pid-file={folder}/munge/pid",
                 f"--log-file={folder}/munge/log", f"--seed-file={folder}/munge/seed"]
        for command in (munge, ["slurmctld"], ["slurmd"]):
            if subprocess.run(command, env=own, capture_output=True).returncode != 0:
                return None
        for _ in range(60):
            state = subprocess.run(["sinfo", "-h", "-o", "%t"], env=own, capture_output=True, text=True).stdout.strip()
            if state == "idle":
                return environment
            time.sleep(0.5)
        return None

    def test_a_job_is_killed_in_the_middle(self):
        environment = self.start_slurm()
        if environment is None:
            self.skipTest("Slurm does not start on this machine")
        own = {**os.environ, **environment}
        run = self.snakemake("-j", "20", "--cluster", "sbatch --parsable --cpus-per-task {threads} --output=/dev/null",
                             "--cluster-status", WORKFLOW / "slurm_status.sh", environment=environment)
        killed = []
        for _ in range(300):
            killed = subprocess.run(["squeue", "-h", "-t", "R", "-o", "%i"], env=own, capture_output=True, text=True).stdout.split()
            if killed:
                break
            time.sleep(0.2)
        self.assertTrue(killed, "no job ever ran")
        subprocess.run(["scancel", killed[0]], env=own, check=True)
        self.check(run)


if __name__ == "__main__":
    unittest.main()
