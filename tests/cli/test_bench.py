# SPDX-License-Identifier: MIT
"""What loxo-bench refuses before it works, which meshes it takes, and what it leaves when it is ended. Here LOXO is loxo-bench."""
import json
import os
import subprocess

from harness import LOXO, environment, files, loxo, main, read, test

SMALL = ["--repeats", "1", "--threads", "1", "--method", "fast"]


@test
def refused_before_any_work():
    for words, code, text in (
            (["paper", "all", "--out", "nowhere"], 9, "--out: there is no folder nowhere; make it first: mkdir -p nowhere"),
            (["paper", "tao2021-fig7", "--case", "igea"], 2, "--case: no mesh of these has 'igea' in its name"),
            (["paper", "all", "--case", "xyz"], 2, "--case: no mesh of these has 'xyz' in its name"),
            (["paper", "all", "--mesh", "own.ply"], 2, "--mesh is not of paper"),
            (["paper", "fig7"], 2, "no such table or figure: fig7"), (["time", "--shared", "nowhere"], 3, "no such folder")):
        r = loxo(*words).fails(code, text)
        assert r.out == "", r


@test
def the_folder_of_the_meshes():
    os.makedirs("root/meshes")
    for changes, words, want in (({"LOXO_SHARED": "root"}, [], "root/meshes"),
                                 ({"LOXO_SHARED": "root"}, ["--shared", "."], r"\."), ({}, ["--shared", "root"], "root")):
        loxo("list", *words, env=environment(**changes)).is_code(0).has_out(f"^Meshes of others: {want}$")
    os.makedirs("a/b/shared/meshes")
    os.makedirs("a/b/here")
    os.chdir("a/b/here")
    loxo("list", env=environment(LOXO_SHARED="missing")).is_code(0).has_out(r"^Meshes of others: \.\./shared/meshes$")


@test
def cases_of_papers():
    r = loxo("paper", "tao2021-fig8", "tao2021-fig4", "--case", "sphere", "--share", "0.01", *SMALL).is_code(0)
    r.has_out(r"^tao2021-fig4: left out, none of its meshes has 'sphere' in its name$")
    r.has_out(r"^igea: skipped: left out by --case$").has_out(r"^  sphere +\d+ +edge ")


@test
def a_peer_that_writes_nothing_is_named():
    for command, wanted in (("time", "icosphere"), ("accuracy", "sphere")):
        r = loxo(command, "--vertices", "1000", "--case", wanted, *SMALL, "--compare-with", "lazy=echo seconds 1")
        r.is_code(0).has_out(r"^lazy: wrote no distances to \S+: their error is not known$").has_out(rf"^  {wanted} +")
        assert r.err == "", r
    r = loxo("paper", "tao2021-table1", "--case", "bumpy", "--share", "0.001", "--largest", "1500", *SMALL, "--compare-with",
             "lazy=echo seconds 1 && echo rubbish >{out}").is_code(0)
    r.has_out(r"^lazy: .*: their error is not known$").has_out(r"^  bumpy +\d+ +lazy ")


@test
def rows_stay_when_it_is_ended():
    os.mkdir("out")
    with subprocess.Popen([LOXO, "paper", "tao2021-table1", "--case", "b", "--share", "0.001", "--largest", "5000", "--out", "out",
                           *SMALL], stdout=subprocess.PIPE, env=environment(), text=True) as process:
        for line in process.stdout:
            if line.startswith("  brain"):
                break
        process.kill()
    rows = read("out/tao2021-table1.txt").decode()
    assert "  bumpy " in rows and "  paper: Triomphe " in rows and "  brain " in rows, rows
    kept = json.loads(read("out/tao2021-table1.json"))["table1"]
    assert kept[0]["mesh"] == "bumpy" and kept[0]["failure"] == "", kept
    assert files() == ["out"]


main()
