# SPDX-License-Identifier: MIT
"""What the tests of the command share: running it in a scratch folder, small meshes, checks, and TAP at the end.

A test is a function marked @test; it fails by an exception. `python3 test_x.py LOXO [SHARED]`.
"""
import functools
import json
import os
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import traceback

LOXO = os.path.abspath(sys.argv[1])
SHARED = os.path.abspath(sys.argv[2]) if len(sys.argv) > 2 else ""
TIMEOUT_S = 240
with open(LOXO, "rb") as _program:
    IS_SANITIZED = re.search(rb"__[at]san_init", _program.read()) is not None

_tests = []


class Skip(Exception):
    """The test cannot run here; says why."""


def test(function):
    _tests.append(function)
    return function


class Result:
    def __init__(self, argv, code, out, err):
        self.argv, self.code, self.out_bytes, self.err = argv, code, out, err.decode("utf-8", "replace")

    @property
    def out(self):
        return self.out_bytes.decode("utf-8", "replace")

    @property
    def json(self):
        return json.loads(self.out)

    def __str__(self):
        return f"loxo {' '.join(self.argv)}\n  exit {self.code}\n  out {self.out[:1500]!r}\n  err {self.err[:1500]!r}"

    def is_code(self, code):
        assert self.code == code, f"exit code {code} wanted: {self}"
        return self

    def has_err(self, pattern):
        assert re.search(pattern, self.err, re.M), f"{pattern!r} wanted on standard error: {self}"
        return self

    def has_out(self, pattern):
        assert re.search(pattern, self.out, re.M), f"{pattern!r} wanted on standard output: {self}"
        return self

    def fails(self, code, pattern):
        """Nothing but one line that says where and why."""
        self.is_code(code)
        assert self.err.count("\n") == 1 and self.err.endswith("\n"), f"one line wanted: {self}"
        assert ": error: " in self.err, f"an error line wanted: {self}"
        assert not re.search(r"[\x00-\x09\x0b-\x1f\x7f]", self.err), f"no control bytes wanted: {self}"
        return self.has_err(pattern)


def environment(**changes):
    env = {k: v for k, v in os.environ.items() if not k.startswith(("OMP_NUM_THREADS", "LC_", "LANG"))}
    env.setdefault("ASAN_OPTIONS", "detect_leaks=1")
    env.update(changes)
    return env


def loxo(*argv, stdin=b"", env=None, preexec=None):
    argv = [str(a) for a in argv]
    p = subprocess.run([LOXO, *argv], input=stdin, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                       env=env or environment(), timeout=TIMEOUT_S, preexec_fn=preexec, check=False)
    return Result(argv, p.returncode, p.stdout, p.stderr)


def signals_as_in_a_terminal():
    """Whatever this process inherited: background jobs ignore SIGINT, nohup SIGHUP."""
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)


def start(*argv):
    """A run to be disturbed."""
    return subprocess.Popen([LOXO, *[str(a) for a in argv]], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                            env=environment(), preexec_fn=signals_as_in_a_terminal)


def end(process, argv=()):
    out, err = process.communicate(timeout=TIMEOUT_S)
    return Result(list(argv), process.returncode, out, err)


@functools.lru_cache(None)
def has_small_ids():
    return "ids 16 bits" in loxo("--version", "--verbose").out


def fitting(n):
    """As many vertices as are wanted, or as 16-bit ids can bear: 3 * 2 half-edges each."""
    return min(n, 5000) if has_small_ids() else n


def has_feature(name):
    return not re.search(rf"^{re.escape(name)} off$", loxo("--version", "--verbose").out, re.M)


def needs(feature):
    if not has_feature(feature):
        raise Skip(f"built without {feature}")


def needs_big_ids():
    if has_small_ids():
        raise Skip("needs more than 32767 elements")


def write(path, content):
    with open(path, "wb") as f:
        f.write(content.encode() if isinstance(content, str) else content)
    return path


def read(path):
    with open(path, "rb") as f:
        return f.read()


def off(path, vertices, faces):
    lines = ["OFF", f"{len(vertices)} {len(faces)} 0"]
    lines += [" ".join(repr(float(x)) for x in v) for v in vertices]
    lines += [" ".join(str(i) for i in (len(f), *f)) for f in faces]
    return write(path, "\n".join(lines) + "\n")


TETRAHEDRON = ([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)])


def tetrahedron(path="tetrahedron.off"):
    return off(path, *TETRAHEDRON)


def octahedron(path="octahedron.off"):
    v = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    return off(path, v, [(4, 0, 2), (4, 2, 1), (4, 1, 3), (4, 3, 0), (5, 2, 0), (5, 1, 2), (5, 3, 1), (5, 0, 3)])


def three_at_an_edge(path="edge3.off"):
    v = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1)]
    return off(path, v, [(0, 1, 2), (1, 0, 3), (0, 1, 4)])


def moebius(path="moebius.off", n=12):
    from math import cos, pi, sin
    v = []
    for i in range(n):
        a = 2 * pi * i / n
        for s in (-0.3, 0.3):
            v.append(((1 + s * cos(a / 2)) * cos(a), (1 + s * cos(a / 2)) * sin(a), s * sin(a / 2)))
    f = []
    for i in range(n):
        a, b = 2 * i, 2 * i + 1
        c, d = (2 * i + 2, 2 * i + 3) if i + 1 < n else (1, 0)
        f += [(a, c, b), (b, c, d)]
    return off(path, v, f)


def sphere(path="sphere.ply", n=2500, *more):
    loxo("generate", "icosphere", "--vertices", fitting(n), "-o", path, "--quiet", *more).is_code(0)
    return path


def npy(path):
    """The numbers of a one-dimensional .npy of doubles."""
    data = read(path)
    assert data[:6] == b"\x93NUMPY", data[:16]
    n_header = struct.unpack_from("<H", data, 8)[0] if data[6] == 1 else struct.unpack_from("<I", data, 8)[0]
    begin = (10 if data[6] == 1 else 12) + n_header
    assert b"'<f8'" in data[:begin], data[:begin]
    return list(struct.unpack(f"<{(len(data) - begin) // 8}d", data[begin:]))


def files():
    """What lies in the scratch folder, hidden files too."""
    return sorted(os.listdir("."))


def main():
    failed = 0
    print(f"1..{len(_tests)}")
    for number, function in enumerate(_tests, 1):
        name = function.__name__
        folder = tempfile.mkdtemp(prefix="loxo-cli-")
        os.chdir(folder)
        try:
            function()
            print(f"ok {number} - {name}")
        except Skip as why:
            print(f"ok {number} - {name} # SKIP {why}")
        except Exception:  # pylint: disable=broad-except
            failed += 1
            print(f"not ok {number} - {name}")
            print("".join("# " + line + "\n" for line in traceback.format_exc().splitlines()), end="")
        finally:
            os.chdir("/")
            shutil.rmtree(folder, ignore_errors=True)
        sys.stdout.flush()
    sys.exit(1 if failed else 0)
