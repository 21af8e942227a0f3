"""The engines of the benchmark, and the processes they run in."""
import json
import os
import shutil
import subprocess
import sys
from dataclasses import dataclass

from environments import Missing, newest_llvm, python_of

HERE = os.path.dirname(os.path.abspath(__file__))


@dataclass
class Kind:
    name: str
    adapter: str
    environment: str | None  # a key of environments.PACKAGES
    variant: str = ""
    mode: str = ""  # Mitsuba's mode; empty: llvm_ad_rgb


MITSUBA_SCALAR = Kind("mitsuba-scalar", "engine_mitsuba", "mitsuba", "independent", "scalar_rgb")

KINDS = (Kind("tessera", "engine_tessera", "bench"),
         Kind("mitsuba-multijitter", "engine_mitsuba", "mitsuba", "multijitter"),
         Kind("mitsuba-independent", "engine_mitsuba", "mitsuba", "independent"),
         Kind("cycles-bpy", "engine_cycles", "cycles"),
         Kind("cycles-blender", "engine_cycles", None),
         Kind("luxcore", "engine_luxcore", "luxcore", "sobol"),
         Kind("bdpt-tessera", "engine_tessera", "bench", "bdpt"),
         Kind("bdpt-luxcore", "engine_luxcore", "luxcore", "bidirectional"))


def command_of(kind):
    """Command and variables that start a worker of this kind; raises Missing."""
    variables = dict(os.environ)
    worker = os.path.join(HERE, "worker.py")
    if kind.environment is None:
        blender = shutil.which("blender")
        if blender is None:
            raise Missing("no blender in PATH (Debian: apt-get install blender)")
        return [blender, "--background", "--factory-startup", "--python", worker, "--"], variables
    if kind.mode:
        variables["MITSUBA_MODE"] = kind.mode
    elif kind.environment == "mitsuba":
        variables["DRJIT_LIBLLVM_PATH"] = os.environ.get("DRJIT_LIBLLVM_PATH") or newest_llvm()
    return [python_of(kind.environment), worker], variables


class Broken(Exception):
    """An engine failed at a scene; contains its message."""


class Worker:
    """An engine's process. Its output goes to a file."""

    def __init__(self, kind, log):
        command, variables = command_of(kind)
        self.name = kind.name
        read_end, write_end = os.pipe()
        with open(log, "ab") as said:
            self.process = subprocess.Popen(
                [*command, kind.adapter, str(write_end)],
                stdin=subprocess.PIPE,
                stdout=said,
                stderr=said,
                pass_fds=(write_end,),
                env=variables,
                text=True,
            )
        os.close(write_end)
        self.replies = os.fdopen(read_end)
        self.log = log

    def ask(self, do, **request):
        try:
            self.process.stdin.write(json.dumps({"do": do, **request}) + "\n")
            self.process.stdin.flush()
            line = self.replies.readline()
        except BrokenPipeError:
            line = ""
        if not line:
            raise Broken(f"ended with {self.process.wait()}; see {os.path.relpath(self.log)}")
        answer = json.loads(line)
        if "error" in answer:
            raise Broken(answer["error"])
        return answer

    def close(self):
        self.process.stdin.close()
        try:
            self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.replies.close()


def available(wanted):
    """The kinds that can be started; reports the others."""
    out = []
    for kind in KINDS:
        if wanted and not any(kind.name.startswith(name) for name in wanted):
            continue
        try:
            command_of(kind)
            out.append(kind)
        except Missing as why:
            print(f"left out: {kind.name}: {why}", file=sys.stderr)
    return out
