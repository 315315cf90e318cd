# SPDX-License-Identifier: MIT
"""Every allocation of a run fails once, and then all that follow: exit 7, or 0 with the same result; never a signal,
never a file of a run that failed."""
import json
import os
import re
import sys

from harness import IS_SANITIZED, environment, files, loxo, main, octahedron, read, test, write

SHIM = os.path.abspath(sys.argv[3]) if len(sys.argv) > 3 else ""

def without_measurements(report):
    return {k: v for k, v in report.items() if k not in ("seconds", "memory")}


def run(words, **changes):
    return loxo(*words, "--threads", "1", env=environment(LD_PRELOAD=SHIM, OMP_NUM_THREADS="1", **changes))


def fail_each(words, made, result):
    """result() is what a good run leaves."""
    if IS_SANITIZED or not SHIM:  # a sanitizer has its own allocator
        return
    n = int(re.search(r"^(\d+) allocations$", run(words, FAIL_LOG="1").is_code(0).err, re.M).group(1))
    want = result(run(words))
    before = [f for f in files() if f not in made]
    n_good = n_refused = 0
    for keep in ({}, {"FAIL_KEEP": "1"}):
        for i in range(1, n + 1, 7 if keep else 1):
            for name in made:
                if os.path.exists(name):
                    os.unlink(name)
            r = run(words, FAIL_AT=str(i), **keep)
            if r.code == 1 and r.err.startswith("\nlibgomp: Out of memory"):
                continue  # before main, and in the runtime of OpenMP: not ours
            if r.code == 0:
                n_good += 1
                assert result(r) == want, (i, keep, r)
            else:
                n_refused += 1
                r.is_code(7)
                assert r.err.count("\n") == 1 and ": error: " in r.err, (i, keep, r)
                assert files() == before, (i, keep, files())
    assert n_refused > 20, (n, n_good, n_refused)


@test
def info():
    fail_each(["info", octahedron(), "--json", "-"], [], lambda r: without_measurements(json.loads(r.out)))


@test
def convert():
    mesh = octahedron()
    fail_each(["convert", mesh, "--repair", "--subdivide", "2", "-o", "x.ply"], ["x.ply"], lambda r: read("x.ply"))


@test
def generate():
    fail_each(["generate", "noisy", "--vertices", "300", "-o", "x.off"], ["x.off"], lambda r: read("x.off"))


@test
def geodesic():
    mesh = octahedron()
    loxo("convert", mesh, "--subdivide", "3", "-o", "o.ply").is_code(0)
    for more in ([], ["--method", "edge"]):
        fail_each(["geodesic", "o.ply", "-s", "0,3", "-o", "d.npy", *more], ["d.npy"], lambda r: read("d.npy"))


@test
def measure():
    mesh = octahedron()
    fail_each(["measure", mesh, "--sphere", mesh, "-o", "x.ply", "--json", "r.json"], ["x.ply", "r.json"],
              lambda r: (read("x.ply"), *[json.loads(read("r.json"))[key] for key in ("map", "centred")]))


@test
def sphere_maps():
    mesh = octahedron()
    fail_each(["sphere", mesh, "-o", "x.ply", "--json", "r.json"], ["x.ply", "r.json"], lambda r: read("x.ply"))


@test
def center_and_extend():
    mesh = octahedron()
    fail_each(["center", mesh, "--mesh", mesh, "-o", "x.ply"], ["x.ply"], lambda r: read("x.ply"))
    write("curve.csv", b"1,0,0\n0,1,0\n0,0,1\n0,-0.6,0.8\n")
    fail_each(["extend", "curve.csv", "--points", "20", "--by", "length", "-o", "x.ply", "-o", "x.csv"], ["x.ply", "x.csv"],
              lambda r: (read("x.ply"), read("x.csv")))
    write("at.csv", b"0,0,0\n0.1,0.2,0.3\n")
    fail_each(["extend", mesh, "--map", mesh, "--at", "at.csv", "-o", "x.csv"], ["x.csv"], lambda r: read("x.csv"))


main()
