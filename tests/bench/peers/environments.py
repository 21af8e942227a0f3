"""Virtual environments of the engines under build/peers, made on first use, with pinned
versions."""

import os
import re
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__)))))
HOME = os.path.join(ROOT, "build", "peers")
PACKAGES = {
    "bench": ("numpy==2.4.6", "httpx==0.28.1"),
    "mitsuba": ("mitsuba==3.9.1", "numpy==2.4.6"),
    "cycles": (
        "bpy==5.0.1",
    ),  # wheels only for Python 3.11; includes the numpy that it was built with
    "luxcore": ("pyluxcore==2.11.2", "numpy==2.4.6"),
}


class Missing(Exception):
    """An engine is missing; contains the reason."""


def python_of(name):
    """Returns the interpreter of an environment; installs these versions if they are missing."""
    folder = os.path.join(HOME, name)
    python, stamp = os.path.join(folder, "bin", "python"), os.path.join(folder, "installed")
    wanted = "\n".join(PACKAGES[name])
    if os.path.exists(stamp):
        with open(stamp) as file:
            if file.read() == wanted:
                return python
    print(
        f"installing {', '.join(PACKAGES[name])} into {os.path.relpath(folder, ROOT)}",
        file=sys.stderr,
    )
    commands = [
        [interpreter, "-m", "venv", "--clear", folder] for interpreter in ("python3.11", "python3")
    ]
    made = any(run(command) is None for command in commands)
    complaint = run([python, "-m", "pip", "--disable-pip-version-check", "--quiet", "install",
                     *PACKAGES[name]]) if made else "python3 -m venv fails"
    if complaint is not None:
        raise Missing(complaint)
    with open(stamp, "w") as file:
        file.write(wanted)
    return python


def run(command):
    """None, or the last line of the output of a failed command."""
    try:
        done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    except OSError as error:
        return str(error)
    if done.returncode == 0:
        return None
    return (done.stderr.strip().splitlines() or ["exit code %d" % done.returncode])[-1]


def newest_llvm():
    """Path of the newest libLLVM of the machine. Dr.Jit 1.5 needs 16 or newer: older ones abort the
    process at `fminimum`, which they cannot translate."""
    found = []
    for folder in (
        "/usr/lib/x86_64-linux-gnu",
        "/usr/lib/aarch64-linux-gnu",
        "/usr/lib64",
        "/usr/lib",
    ):
        for name in os.listdir(folder) if os.path.isdir(folder) else ():
            match = re.match(r"libLLVM(?:-|\.so\.)(\d+)", name)
            if match and ".so" in name and int(match[1]) >= 16:
                found.append((int(match[1]), os.path.join(folder, name)))
    if not found:
        raise Missing("no LLVM of version 16 or newer (Debian: apt-get install libllvm19)")
    return max(found)[1]
