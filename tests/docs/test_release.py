"""What people install: a wheel in an empty environment, and the container."""

import shutil
import subprocess
import sys

import pytest

from belt_sim.io import ROOT


def docker_runs() -> bool:
    """Whether a Docker daemon answers."""
    docker = shutil.which("docker")
    return bool(docker) and subprocess.run([docker, "info"], capture_output=True, check=False).returncode == 0


@pytest.mark.long
@pytest.mark.skipif(not docker_runs(), reason="no Docker daemon answers")
def test_the_container_is_built_and_simulates():
    subprocess.run(["docker", "build", "-q", "-t", "belt-sim-test", "."], cwd=ROOT, check=True)
    line = ["docker", "run", "--rm", "belt-sim-test", "simulate", "travel=5", "pictures=false"]
    done = subprocess.run(line, capture_output=True, text=True, check=True)
    assert "late rates in mm per m" in done.stdout


@pytest.mark.long
def test_a_wheel_alone_is_enough(tmp_path):
    """The wheel, unpacked where no checkout is near, finds its own rigs, models and campaigns."""
    subprocess.run(
        [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", str(tmp_path), str(ROOT)], check=True
    )
    (wheel,) = tmp_path.glob("belt_sim-*.whl")
    shutil.unpack_archive(wheel, tmp_path / "alone", "zip")
    code = "import belt_sim.commands.cli as c, sys; print(c.__file__); sys.exit(c.run_command(sys.argv[1:]))"
    line = [sys.executable, "-c", code, "compare", "campaign=slack_belt", "model=beam_th2", "pictures=false"]
    environment = {"PYTHONPATH": str(tmp_path / "alone"), "PATH": "/usr/bin:/bin", "HOME": str(tmp_path)}
    done = subprocess.run(line, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert str(tmp_path / "alone") in done.stdout
    assert "Model beam_th2 is off at every tension measured" in done.stdout
