# SPDX-License-Identifier: MIT
"""Runs that are stopped from outside: signals and closed pipes. They leave nothing half done."""
import os
import pty
import re
import signal
import subprocess
import time

from harness import (LOXO, Skip, end, environment, files, fitting, loxo, main, needs_big_ids, npy, read, sphere, start,
                     test, write)

# Far more sweeps than anyone waits for: the solve goes on until it is stopped.
ENDLESS = ("--diffusion", "sweeps", "--sweeps", "1000000000")
UNTOUCHED = b"what was there before"


def mesh_and_run(*more):
    mesh = sphere("s.ply", 40000)
    return start("geodesic", mesh, "-s", "0", *ENDLESS, *more)


def wait_until_it_computes(process):
    """A second of its own processor time: reading and half-edges are over then; or two by the clock."""
    ticks = os.sysconf("SC_CLK_TCK")
    limit = time.monotonic() + 60
    while time.monotonic() < limit:
        assert process.poll() is None, end(process)
        try:
            with open(f"/proc/{process.pid}/stat", encoding="ascii", errors="replace") as f:
                fields = f.read().rsplit(")", 1)[1].split()
            if (int(fields[11]) + int(fields[12])) / ticks > 1.0:
                return
        except OSError:
            return time.sleep(2)
        time.sleep(0.05)


@test
def interrupted_solve_leaves_no_file():
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        p = mesh_and_run("-o", "d.npy", "-o", "d.ply", "--json", "r.json", "--picture", "p.png")
        wait_until_it_computes(p)
        before = time.monotonic()
        p.send_signal(number)
        end(p).fails(128 + number, rf"^loxo: error: stopped by signal {int(number)}; nothing was written$")
        assert time.monotonic() - before < 30
        assert files() == ["s.ply"]


@test
def interrupted_solve_leaves_the_old_file():
    write("d.npy", UNTOUCHED)
    p = mesh_and_run("-o", "d.npy")
    wait_until_it_computes(p)
    p.send_signal(signal.SIGINT)
    assert end(p).code == 130
    assert read("d.npy") == UNTOUCHED
    assert files() == ["d.npy", "s.ply"]


@test
def keep_partial_writes_what_there_is():
    p = mesh_and_run("-o", "d.npy", "--json", "-", "--keep-partial")
    wait_until_it_computes(p)
    p.send_signal(signal.SIGTERM)
    r = end(p)
    r.is_code(143).has_err("warning: stopped by the monitor; the last state was written")
    assert (r.json["status"], r.json["exit_code"]) == ("LOXO_STOPPED", 143)
    assert r.json["info"]["stop_reason"] == "stopped"
    assert len(npy("d.npy")) == r.json["mesh"]["n_vertices"]


@test
def a_signal_sent_twice_at_once_is_one_request():
    """As timeout(1) does: to the process, and to its group."""
    p = mesh_and_run("-o", "d.npy")
    wait_until_it_computes(p)
    p.send_signal(signal.SIGINT)
    try:  # it may be gone already
        p.send_signal(signal.SIGINT)
    except ProcessLookupError:
        pass
    end(p).fails(130, "stopped by signal 2; nothing was written")
    assert files() == ["s.ply"]


@test
def a_signal_that_the_parent_ignores_still_stops():
    """Shells start background jobs with SIGINT ignored."""
    mesh = sphere("s.ply", 10000)
    p = subprocess.Popen([LOXO, "geodesic", mesh, "-s", "0", *ENDLESS, "-o", "d.npy"], stdout=subprocess.PIPE,
                         stderr=subprocess.PIPE, env=environment(),
                         preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_IGN))
    wait_until_it_computes(p)
    p.send_signal(signal.SIGINT)
    assert end(p).code == 130


@test
def progress_on_a_terminal():
    """A bar with phase, share and seconds, gone when the error line comes."""
    mesh = sphere("s.ply", 10000)
    try:
        ours, theirs = pty.openpty()
    except OSError as e:  # a bare chroot
        raise Skip("no terminal to be had") from e
    p = subprocess.Popen([LOXO, "geodesic", mesh, "-s", "0", *ENDLESS, "-o", "d.npy"], stderr=theirs,
                         env=environment(), preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL))
    os.close(theirs)
    seen = b""
    try:
        while b"\r" not in seen:
            seen += os.read(ours, 4096)
        p.send_signal(signal.SIGINT)
        while True:
            seen += os.read(ours, 4096)
    except OSError:  # the other side was closed
        pass
    os.close(ours)
    assert p.wait(timeout=240) == 130
    assert re.search(rb"\r\w+[ -]+.*\d\.\d+ s\x1b\[K", seen), seen[:500]
    assert re.search(rb"\r\x1b\[Kloxo: error: stopped by signal 2; nothing was written\r?\n$", seen), seen[-200:]


@test
def killed_while_writing_leaves_the_old_file():
    """At random moments, also inside the write: the old file, or the whole new one."""
    needs_big_ids()
    mesh = sphere("s.ply", 200000)
    loxo("convert", mesh, "-o", "good.ply").is_code(0)
    good = read("good.ply")
    for i in range(12):
        write("d.ply", UNTOUCHED)
        p = start("convert", mesh, "-o", "d.ply")
        time.sleep(0.01 * i)
        p.kill()
        p.wait()
        p.stdout.close()
        p.stderr.close()
        assert read("d.ply") in (UNTOUCHED, good), i
        for name in files():
            if name.endswith(".tmp"):
                os.unlink(name)


@test
def stopped_while_writing_leaves_nothing():
    needs_big_ids()
    mesh = sphere("s.ply", 200000)
    loxo("convert", mesh, "-o", "good.ply").is_code(0)
    good = read("good.ply")
    for i in range(8):
        p = start("convert", mesh, "-o", "d.ply")
        time.sleep(0.02 * i)
        p.send_signal(signal.SIGTERM)
        r = end(p)
        # before the handler stands the signal simply kills
        assert r.code in (143, 0, -signal.SIGTERM), r
        left = [n for n in files() if n not in ("s.ply", "good.ply")]
        assert left == (["d.ply"] if r.code == 0 else []), (r, left)
        if r.code == 0:
            assert read("d.ply") == good
            os.unlink("d.ply")


def into_closed_pipe(*argv):
    """The reader takes a few bytes and goes."""
    p = subprocess.Popen([LOXO, *argv], stdout=subprocess.PIPE, stderr=subprocess.PIPE, env=environment())
    p.stdout.read(10)
    p.stdout.close()
    err = p.stderr.read()
    p.stderr.close()
    return p.wait(timeout=240), err


@test
def closed_pipe_is_quiet():
    mesh = sphere("s.ply", 20000)  # the output is larger than a pipe holds
    for words in (["convert", mesh, "-o", "-", "--format", "ply"], ["convert", mesh, "-o", "-", "--format", "obj"],
                  ["geodesic", mesh, "-s", "0", "-o", "-", "--format", "csv"],
                  ["generate", "grid", "--vertices", str(fitting(20000)), "-o", "-", "--format", "ply"]):
        code, err = into_closed_pipe(*words, "--quiet")
        assert code in (141, -signal.SIGPIPE), (words, code, err)
        assert err == b"", (words, err)
    assert files() == ["s.ply"]


@test
def closed_pipe_of_help_is_quiet():
    code, err = into_closed_pipe("help", "geodesic")
    assert code in (0, 141, -signal.SIGPIPE) and err == b"", (code, err)


@test
def nobody_reads_the_rows():
    """The result is not lost because the log is."""
    mesh = sphere("s.ply", 2500)
    p = subprocess.Popen([LOXO, "geodesic", mesh, "-s", "0", "-o", "d.npy"], stderr=subprocess.PIPE, env=environment())
    p.stderr.close()
    assert p.wait(timeout=240) == 0
    assert len(npy("d.npy")) > 2000


main()
