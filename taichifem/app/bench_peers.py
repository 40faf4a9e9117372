"""Other programs on the bar of `taichifem bench`: which there are, how each is run, how far its result is ours."""

from __future__ import annotations

import json
import math
import os
import subprocess
import tempfile
from dataclasses import dataclass
from pathlib import Path

from taichifem.app.peers.common import REACH

SCRIPTS = Path(__file__).with_name("peers")
TAIL = 20  # frames at the end whose mean deflection is compared


@dataclass(frozen=True, kw_only=True)
class Peer:
    """A script in `peers/`, which of its methods, and the packages it needs besides NumPy."""

    script: str
    packages: str
    mode: str = ""


PEERS = {
    "mujoco": Peer(script="mujoco_flex.py", packages="mujoco"),
    "pybullet": Peer(script="pybullet_soft.py", packages="pybullet"),
    "newton": Peer(script="newton_soft.py", packages="newton", mode="vbd"),
    "newton-semi-implicit": Peer(script="newton_soft.py", packages="newton", mode="semi-implicit"),
    "genesis": Peer(script="genesis_fem.py", packages="torch genesis-world"),
    "taichi-example": Peer(script="taichi_example.py", packages="taichi"),
}


def measure_peer(name: str, task: dict, *, python: str, limit: float) -> dict:
    """Run a peer in a process of its own and give its figures, or `status` and `reason` of why there are none.

    task: the fields of `peers.common.Task` but the mode, its mesh as the path of an .npz.  limit: [s].
    """
    peer = PEERS[name]
    command = [python, str(SCRIPTS / peer.script), json.dumps({**task, "mode": peer.mode})]
    threads = {"OMP_NUM_THREADS": str(task["threads"])} if task["threads"] else {}
    with tempfile.TemporaryDirectory(prefix="taichifem-peer-") as folder:  # for what a peer leaves behind
        try:
            done = subprocess.run(
                command,
                capture_output=True,
                text=True,
                errors="replace",
                stdin=subprocess.DEVNULL,
                cwd=folder,
                env={**os.environ, **threads},
                timeout=limit,
            )
        except subprocess.TimeoutExpired:
            return {"status": "too slow", "reason": f"not ready within {limit:g} s: see --peer-limit"}
        except OSError as error:
            return {"status": "failed", "reason": f"{python}: {error.strerror or error}"}
    if done.returncode:
        return _why(done, name)
    return _figures(done.stdout)


def beside(ours: dict, peer: dict) -> dict:
    """How a peer's figures stand to ours: the time of a frame, and the tip [m] over the frames that both made."""
    if peer["status"] != "measured":
        return {}
    frames = min(len(ours["tips_m"]), len(peer["tips_m"]))
    mine = {f"our_{name}": value for name, value in tip_figures(ours["tips_m"][:frames]).items()}
    ratio = peer["ms"]["median"] / ours["ms"]["median"]
    return {"times_ours": ratio, "frames_compared": frames, **tip_figures(peer["tips_m"][:frames]), **mine}


def tip_figures(tips: list[float]) -> dict[str, float]:
    """The lowest deflection [m] and the mean of the last ones."""
    last = tips[-TAIL:]
    return {"tip_lowest_m": min(tips), "tip_mean_m": sum(last) / len(last)}


def _why(done: subprocess.CompletedProcess, name: str) -> dict:
    """What a process that failed says about it."""
    said = next(reversed(done.stderr.strip().splitlines()), "")
    if said.startswith("ModuleNotFoundError"):
        get = f"pip install {PEERS[name].packages}"
        return {"status": "not installed", "reason": f"{get}, or --peer-python {name}=PYTHON of where it is"}
    if done.returncode < 0:
        said = f"ended by signal {-done.returncode}"
    return {"status": "failed", "reason": said or f"it ended with code {done.returncode}"}


def _figures(output: str) -> dict:
    """The line of JSON among whatever a program prints."""
    lines = [line for line in output.splitlines() if line.startswith("{")]
    try:
        figures = json.loads(lines[-1])
        tips = figures["tips_m"]
    except (IndexError, ValueError, KeyError, TypeError):
        return {"status": "failed", "reason": "it printed no figures"}
    lost = next((i for i, tip in enumerate(tips, 1) if not math.isfinite(tip) or abs(tip) >= REACH), None)
    if lost is not None:
        return {"status": "diverged", "reason": f"the tip is nowhere after frame {lost}"}
    return {"status": "measured", "reason": "", **figures}
