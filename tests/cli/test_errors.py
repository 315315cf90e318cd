# SPDX-License-Identifier: MIT
"""Every exit code, each with its one line; and that a failed run leaves no file and changes none."""
import gzip
import json
import os
import resource
import shutil
import struct
import subprocess
import time

from harness import (LOXO, Skip, environment, files, fitting, loxo, main, moebius, needs, off, octahedron, read,
                     sphere, test, tetrahedron, three_at_an_edge, write)

UNTOUCHED = b"what was there before"


@test
def code_0_good():
    r = loxo("info", tetrahedron()).is_code(0)
    assert "warning" not in r.err and "error" not in r.err, r


@test
def code_1_warnings_under_strict():
    v = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (7, 7, 7)]
    mesh = off("unused.off", v, [(0, 1, 2)])
    pattern = r"^unused\.off: warning: 1 unreferenced vertices \(first: vertex 3\)$"
    loxo("info", mesh).is_code(0).has_err(pattern)
    loxo("info", mesh, "--strict").is_code(1).has_err(pattern)
    loxo("info", mesh, "--strict", "--quiet").is_code(1).has_err(pattern)
    loxo("info", tetrahedron(), "--strict").is_code(0)
    r = loxo("info", mesh, "--strict", "--json", "-").is_code(1)
    assert r.json["exit_code"] == 1 and r.json["status"] == "LOXO_OK"
    assert r.json["warnings"] == [{"count": 1, "text": "1 unreferenced vertices (first: vertex 3)"}]


@test
def code_1_still_writes():
    mesh = off("unused.off", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (7, 7, 7)], [(0, 1, 2)])
    loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", "--strict").is_code(1).has_err("warning: 1 vertices cannot be reached")
    assert "d.npy" in files()


@test
def code_3_cannot_read():
    loxo("info", "missing.ply").fails(3, r"^missing\.ply: error: .*No such file or directory$")
    loxo("info", ".").fails(3, r"^\.: error: ")
    loxo("info", "x" * 4096).fails(3, "error: ")
    loxo("geodesic", "missing.ply", "-s", "0", "-o", "d.npy").fails(3, "missing.ply")
    loxo("measure", "missing.npy", "missing2.npy").fails(3, "missing.npy")
    mesh = tetrahedron()
    loxo("geodesic", mesh, "-s", "0", "--exact", "missing.npy", "-o", "d.npy").fails(3, "missing.npy")
    loxo("geodesic", mesh, "--sources", "missing.txt", "-o", "d.npy").fails(3, "missing.txt")
    loxo("render", mesh, "--field", "missing.npy", "-o", "p.png").fails(3, "missing.npy")
    assert files() == [mesh]


@test
def code_3_unreadable():
    mesh = tetrahedron()
    os.chmod(mesh, 0)
    if os.access(mesh, os.R_OK):  # root reads everything
        return
    loxo("info", mesh).fails(3, "Permission denied")


@test
def code_4_malformed_text_names_the_line():
    write("bad.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 4\n")
    loxo("info", "bad.off").fails(4, r"^bad\.off:6: error: .*4.*0\.\.2")
    write("bad.off", "OFF\n3 1 0\n0 0 0\n1 0 x\n0 1 0\n3 0 1 2\n")
    loxo("info", "bad.off").fails(4, r"^bad\.off:4: error: ")
    write("empty.ply", "")
    loxo("info", "empty.ply").fails(4, r"^empty\.ply.*: error: .*empty")


@test
def code_4_malformed_binary_names_the_byte():
    head = (b"ply\nformat binary_little_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
            b"property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n")
    body = struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0)
    write("bad.ply", head + body + struct.pack("<B3i", 3, 0, 1, 9))
    loxo("info", "bad.ply").fails(4, r"^bad\.ply: byte \d+: error: .*9")
    write("cut.ply", head + body[:-5])
    loxo("info", "cut.ply").is_code(4)


@test
def code_4_from_standard_input():
    loxo("info", "-", stdin=b"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 4\n").fails(4, r"^standard input:6: error: ")


@test
def code_4_sources_file():
    mesh = tetrahedron()
    write("s.txt", "# first line\n0, 1\n\n2x\n")
    loxo("geodesic", mesh, "--sources", "s.txt", "-o", "d.npy").fails(4, r"^s\.txt:4: error: '2x' is not")
    write("s.txt", "0\n4\n")
    loxo("geodesic", mesh, "--sources", "s.txt", "-o", "d.npy").fails(2, r"^s\.txt:2: error: '4' is not in 0\.\.3")
    write("s.txt", "# nothing\n\n")
    loxo("geodesic", mesh, "--sources", "s.txt", "-o", "d.npy").fails(4, "no vertex in it")
    write("a.label", "#!ascii label\n1\n-1 0 0 0 0\n")
    loxo("geodesic", mesh, "--sources", "a.label", "-o", "d.npy").fails(5, r"^a\.label:3: error: an entry with vertex -1")
    write("a.label", "#!ascii label\n2\n1 0 0 0 0\n")
    loxo("geodesic", mesh, "--sources", "a.label", "-o", "d.npy").fails(4, r"^a\.label: error: 2 entries announced, 1 found")
    write("p.csv", "0,0\n")
    loxo("geodesic", mesh, "--source-points", "p.csv", "-o", "d.npy").fails(4, r"^p\.csv:1: error: point 0: 2 values")
    assert "d.npy" not in files()


@test
def code_4_gzip_that_was_cut():
    needs("zlib (gzip)")
    write("t.off.gz", gzip.compress(read(tetrahedron()))[:-12])
    loxo("info", "t.off.gz").fails(4, r"^t\.off\.gz")


@test
def code_5_unsupported():
    loxo("convert", tetrahedron(), "-o", "x.stl").fails(5, ".stl cannot be written")


@test
def code_6_mesh_not_valid():
    for make in (three_at_an_edge, moebius):
        mesh = make()
        loxo("info", mesh).is_code(0)
        loxo("geodesic", mesh, "-s", "0", "-o", "d.npy").fails(6, rf"^{mesh}: error: ")
    write("points.off", "OFF\n2 0 0\n0 0 0\n1 0 0\n")
    loxo("geodesic", "points.off", "-s", "0", "-o", "d.npy").fails(6, "face")
    assert "d.npy" not in files()


@test
def code_6_is_mended_on_request():
    mesh = three_at_an_edge()
    loxo("geodesic", mesh, "-s", "0", "--repair", "--json", "-", "-o", "d.npy")
    loxo("convert", mesh, "--repair", "-o", "mended.off", "--json", "r.json").is_code(0)
    with open("r.json", encoding="utf-8") as f:
        report = json.load(f)
    assert report["status"] == "LOXO_REPAIRED" and report["repair"]["n_vertices_split"] > 0, report
    assert loxo("info", "mended.off", "--json", "-").json["mesh"]["is_manifold"] is True


@test
def code_7_memory():
    n = fitting(200000)
    little = "1M" if n > 100000 else "64K"
    mesh = sphere("big.ply", n)
    before = time.monotonic()
    loxo("geodesic", mesh, "-s", "0", "--max-memory", little, "-o", "d.npy").fails(7, r"bytes|memory")
    loxo("info", mesh, "--max-memory", little).fails(7, r"bytes|memory")
    assert time.monotonic() - before < 20  # at once; far less than the work would take under a sanitizer
    loxo("geodesic", mesh, "-s", "0", "--max-memory", f"{n // 12}K", "-o", "d.npy").is_code(7)
    assert files() == [mesh]


@test
def code_8_not_within_its_checks():
    mesh = sphere("s.ply", 2500)
    r = loxo("geodesic", mesh, "-s", "0", "--method", "face", "--check-breach", "0", "-o", "d.npy", "--json", "r.json").is_code(8)
    r.has_err(r"^s\.ply: warning: the result does not pass its own check")
    r.has_err(r"^answer +FAILED")
    with open("r.json", encoding="utf-8") as f:
        report = json.load(f)
    assert (report["status"], report["exit_code"], report["info"]["check_passed"]) == ("LOXO_CHECK_FAILED", 8, False)
    assert "d.npy" in files()


@test
def code_9_cannot_write():
    mesh = tetrahedron()
    for out in ("nowhere/d.npy", "/dev/full/d.npy"):
        loxo("geodesic", mesh, "-s", "0", "-o", out).fails(9, "error: cannot")
    for out in ("nowhere/x.ply", mesh + "/x.ply"):
        loxo("convert", mesh, "-o", out).fails(9, "error: cannot")
    os.mkdir("folder.ply")
    loxo("convert", mesh, "-o", "folder.ply").fails(9, "a directory")
    loxo("convert", mesh, "-o", "/dev/full", "--format", "ply").fails(9, "special file")
    loxo("render", mesh, "-o", "nowhere/p.png").fails(9, "nowhere")
    loxo("info", mesh, "--json", "nowhere/r.json").fails(9, "nowhere")
    loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", "--picture", "nowhere/p.png").fails(9, "nowhere")
    loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", "--json", "nowhere/p.json").fails(9, "nowhere")
    assert files() == ["folder.ply", mesh]


@test
def code_9_is_found_before_anything_is_read():
    loxo("geodesic", "missing.ply", "-s", "0", "-o", "nowhere/d.npy").fails(9, "nowhere")
    loxo("convert", "missing.ply", "-o", "nowhere/d.ply").fails(9, "nowhere")


@test
def code_9_disk_full():
    """A limit on the size of files stands for the full disk."""
    mesh = sphere("s.ply", 20000)
    write("d.ply", UNTOUCHED)
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (30000, 30000))
    loxo("convert", mesh, "-o", "d.ply", preexec=limit).fails(9, r"^d\.ply: error: cannot write")
    loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", preexec=limit).fails(9, r"^d\.npy: error: cannot write")
    loxo("generate", "grid", "--vertices", fitting(20000), "-o", "g.ply", preexec=limit).fails(9, r"^g\.ply: error: ")
    assert read("d.ply") == UNTOUCHED
    assert files() == ["d.ply", mesh]


@test
def a_full_disk_leaves_none_of_several_files():
    """Whichever of them does not fit; the report is one of them."""
    mesh = sphere("s.ply", 5000)
    n = loxo("info", mesh, "--json", "-").json["mesh"]["n_vertices"]
    write("d.npy", UNTOUCHED)
    for fits, outputs in ((9 * n, ["-o", "d.npy", "-o", "d.ply"]), (9 * n, ["-o", "d.npy", "-o", "d.csv"]),
                          (9 * n, ["-o", "d.ply", "-o", "d.npy"]), (1000, ["--json", "r.json", "-o", "d.npy"])):
        limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (fits, fits))
        loxo("geodesic", mesh, "-s", "0", *outputs, preexec=limit).fails(9, r"error: cannot write")
        assert read("d.npy") == UNTOUCHED and files() == ["d.npy", mesh], (outputs, files())
    mesh = tetrahedron()
    os.unlink("d.npy")
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))
    r = loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", "--json", "r.json", preexec=limit).is_code(9)
    r.has_err(r"^r\.json: error: cannot write")
    assert files() == ["s.ply", mesh]


@test
def code_9_standard_output_full():
    if not os.path.exists("/dev/full"):
        raise Skip("no /dev/full")
    mesh = tetrahedron()
    for words in (["help"], ["info", mesh, "--json", "-"], ["convert", mesh, "-o", "-", "--format", "ply"],
                  ["geodesic", "--settings"]):
        with open("/dev/full", "wb") as full:
            p = subprocess.run([LOXO, *words], stdout=full, stderr=subprocess.PIPE, env=environment(), check=False)
        assert p.returncode == 9 and p.stderr.count(b"\n") == 1, (words, p)


@test
def a_failed_run_leaves_the_old_file():
    mesh = three_at_an_edge()
    write("d.npy", UNTOUCHED)
    write("r.json", UNTOUCHED)
    loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", "--json", "r.json").is_code(6)
    loxo("geodesic", "missing.ply", "-s", "0", "-o", "d.npy", "--json", "r.json").is_code(3)
    assert read("d.npy") == read("r.json") == UNTOUCHED
    assert files() == ["d.npy", mesh, "r.json"]


@test
def a_failed_run_tells_the_machine_on_standard_output():
    r = loxo("info", "missing.ply", "--json", "-").is_code(3)
    assert r.json["status"] == "LOXO_ERR_READ" and r.json["exit_code"] == 3
    assert r.json["failure"]["file"] == "missing.ply"
    assert r.err.count("\n") == 1
    write("bad.off", "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 4\n")
    assert loxo("info", "bad.off", "--json", "-").is_code(4).json["failure"]["line"] == 6


@test
def output_may_be_the_input():
    mesh = octahedron("o.off")
    before = loxo("info", mesh, "--json", "-").json["mesh"]
    loxo("convert", mesh, "-o", mesh, "--subdivide", "1").is_code(0)
    after = loxo("info", mesh, "--json", "-").json["mesh"]
    assert (before["n_faces"], after["n_faces"]) == (8, 32)
    assert files() == [mesh]


@test
def output_through_a_link():
    mesh = octahedron("o.off")
    os.mkdir("folder")
    os.symlink("folder/real.ply", "link.ply")
    write("folder/real.ply", "old")
    loxo("convert", mesh, "-o", "link.ply").is_code(0)
    assert os.path.islink("link.ply") and read("folder/real.ply").startswith(b"ply")


@test
def the_locale_changes_nothing():
    mesh = tetrahedron()
    names = subprocess.run(["locale", "-a"], stdout=subprocess.PIPE, check=False).stdout.decode().split() \
        if shutil.which("locale") else []
    env = [environment(LC_ALL=n) for n in ["de_DE.UTF-8", "tr_TR.UTF-8", *names[:8]]]
    want = loxo("info", mesh, "--json", "-").is_code(0).json["mesh"]
    for e in env:
        r = loxo("info", mesh, "--json", "-", env=e).is_code(0)
        assert r.json["mesh"] == want, r
        assert "time-factor = 1.5\n" in loxo("geodesic", "--settings", "--time-factor", "1.5", env=e).out


@test
def sources_out_of_range():
    mesh = tetrahedron()
    for bad in ("4", "-1", "0,99", "2147483647", "2147483648", "4294967296", "9223372036854775807"):
        r = loxo("geodesic", mesh, "-s", bad, "-o", "d.npy")
        r.fails(2, rf"^loxo: error: source {bad.split(',')[-1]} is not in 0\.\.3$")
    assert files() == [mesh]


@test
def fields_of_another_mesh():
    a, b = tetrahedron(), octahedron()
    loxo("geodesic", a, "-s", "0", "-o", "a.npy", "--quiet")
    loxo("geodesic", b, "-s", "0", "-o", "b.npy", "--quiet")
    loxo("measure", "a.npy", "b.npy").fails(2, r"^b\.npy: error: holds 6 values, not 4$")
    loxo("render", a, "--field", "b.npy", "-o", "p.png").fails(2, "holds 6 values, the mesh has 4 vertices")


main()
