# SPDX-License-Identifier: MIT
"""What each command does when all is well: numbers, files, rows and JSON."""
import gzip
import json
import math
import os
import struct

from harness import (IS_SANITIZED, SHARED, Skip, files, fitting, has_feature, loxo, main, needs, needs_big_ids, npy,
                     octahedron, off, read, sphere, test, three_at_an_edge, write)


def report(path):
    with open(path, encoding="utf-8") as f:
        return json.load(f)


@test
def info_of_an_octahedron():
    m = loxo("info", octahedron(), "--json", "-").is_code(0).json["mesh"]
    want = {"n_vertices": 6, "n_edges": 12, "n_faces": 8, "n_components": 1, "euler": 2, "genus": 0,
            "n_boundary_loops": 0, "is_manifold": True, "is_orientable": True, "is_oriented": True, "is_closed": True}
    assert {k: m[k] for k in want} == want, m
    assert math.isclose(m["area"], 4 * math.sqrt(3), rel_tol=1e-14)
    assert math.isclose(m["volume"], 4 / 3, rel_tol=1e-14)
    assert math.isclose(m["angle_rad"]["min"], math.pi / 3, rel_tol=1e-12)
    assert math.isclose(m["edge_length"]["mean"], math.sqrt(2), rel_tol=1e-12)
    assert m["bounding_box"] == [[-1, -1, -1], [1, 1, 1]]
    assert all(f["count"] == 0 and f["first"] == [] for f in m["faults"].values())


@test
def info_counts_faults_and_names_the_first():
    v = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0), (5, 5, 5)]
    mesh = off("faults.off", v, [(0, 1, 2), (0, 3, 3), (2, 1, 0)])
    r = loxo("info", mesh, "--json", "-").is_code(0)
    faults = r.json["mesh"]["faults"]
    for key, first in (("duplicate_vertices", [3]), ("unreferenced_vertices", None), ("degenerate_faces", [1]),
                       ("duplicate_faces", [2])):
        assert faults[key]["count"] >= 1, (key, faults)
        assert first is None or faults[key]["first"] == first, (key, faults)
    r.has_err(r"^faults\.off: warning: 1 degenerate faces \(first: face 1\)$")


@test
def options_that_change_nothing_are_told():
    mesh = sphere("s.ply", 600)
    geodesic, sample = ["geodesic", mesh, "-s", "0", "--json", "-"], ["sample", mesh, "-n", "3", "--json", "-"]
    for words, name, why in (
            (geodesic + ["--sweeps", "7"], "sweeps", "without --diffusion sweeps"),
            (geodesic + ["--method", "heat", "--sweeps", "7"], "sweeps", "without --diffusion sweeps"),
            (geodesic + ["--diffusion", "sweeps", "--diffusion-tolerance", "0.1"], "diffusion-tolerance",
             "without --diffusion marching"),
            (geodesic + ["--recovery", "unfold", "--penalty", "3"], "penalty", "without --recovery auto|admm"),
            (geodesic + ["--check-gradient-share", "0.1"], "check-gradient-share",
             "without --method edge|face|heat|variational"),
            (geodesic + ["--nearest"], "nearest", "without --nearest-output"),
            (geodesic + ["--traceable", "--method", "fast"], "traceable", "without --intrinsic"),
            (geodesic + ["--max-flips", "9"], "max-flips", "without --intrinsic"),
            (geodesic + ["--title", "t"], "title", "without --picture"),
            (geodesic + ["--azimuth", "3", "--azimuth", "4"], "azimuth", "without --picture"),
            (geodesic + ["--format", "npy"], "format", "without --output"),
            (["info", mesh, "--mollify", "1e-5", "--json", "-"], "mollify", "without --intrinsic"),
            (["convert", mesh, "-o", "c.ply", "--seed", "3", "--json", "-"], "seed", "without --shuffle"),
            (["convert", mesh, "-o", "c.ply", "--weld=no", "--json", "-"], "weld", "without --repair"),
            (sample + ["--nearest"], "nearest", "in loxo sample")):
        r = loxo(*words).is_code(0)
        texts = [w["text"] for w in r.json["warnings"]]
        assert texts == [f"--{name} changes nothing {why}"], (words, texts)
        loxo(*words, "--strict").is_code(1)
    for words in (geodesic + ["--sweeps", "7", "--diffusion", "sweeps"], geodesic + ["--method", "face", "--penalty", "3"],
                  geodesic + ["--nearest", "--nearest-output", "n.npy"], geodesic + ["--intrinsic", "--max-flips", "9"],
                  geodesic + ["--method", "face", "--check-gradient-share", "0.9"],
                  ["convert", mesh, "-o", "c.ply", "--repair", "--weld", "--json", "-"]):
        assert not any("changes nothing" in w["text"] for w in loxo(*words).is_code(0).json["warnings"]), words
    loxo("geodesic", mesh, "-s", "0", "--title", "t", "--settings").is_code(0)


@test
def info_of_an_edge_with_three_faces():
    m = loxo("info", three_at_an_edge(), "--json", "-").is_code(0).json["mesh"]
    assert m["is_manifold"] is False and m["faults"]["nonmanifold_edges"]["count"] == 1


@test
def info_from_standard_input_and_gzip():
    mesh = octahedron()
    r = loxo("info", "-", "--json", "-", stdin=read(mesh)).is_code(0)
    assert r.json["mesh"]["n_faces"] == 8
    needs("zlib (gzip)")
    write("o.off.gz", gzip.compress(read(mesh)))
    assert loxo("info", "o.off.gz", "--json", "-").is_code(0).json["mesh"]["n_faces"] == 8


@test
def intrinsic_triangulations():
    # A square grid whose rows are triangulated by two fans of needles.
    n = 20
    v = [(i, j, 0) for j in range(n) for i in range(n)]
    f = []
    for low in range(0, n * (n - 1), n):
        f += [(low + i, low + i + 1, low + n) for i in range(n - 1)]
        f += [(low + n - 1, low + n + i + 1, low + n + i) for i in range(n - 1)]
    mesh = off("needles.off", v, f)
    r = loxo("info", mesh, "--intrinsic", "--json", "-").is_code(0)
    r.has_err(r"^intrinsic +[0-9.]+ s, [0-9,]+ flips, non-Delaunay edges [0-9.]+ % to 0.00 %, quality 0.0[0-9]+ to 0")
    i = r.json["intrinsic"]
    assert i["n_flips"] > 100 and i["share_nondelaunay_after"] == 0 and i["quality_after"] > 5 * i["quality_before"], i
    assert "intrinsic" not in loxo("info", mesh, "--json", "-").json
    error = {}
    for flag in ("--verbose", "--intrinsic"):
        loxo("geodesic", mesh, "-s", "0", "--method", "edge", flag, "-o", "d.npy", "-o", "d.ply", "--json", "r.json")
        assert report("r.json")["exit_code"] in (0, 8)
        d = npy("d.npy")
        truth = [math.hypot(x, y) for x, y, _ in v]
        error[flag] = sum(abs(a / b - 1) for a, b in zip(d[1:], truth[1:])) / (len(v) - 1)
        assert ("intrinsic" in report("r.json")) == (flag == "--intrinsic")
    assert error["--intrinsic"] < 0.3 * error["--verbose"], error
    assert loxo("info", "d.ply", "--json", "-").json["mesh"]["area"] == (n - 1) ** 2
    loxo("geodesic", mesh, "--source-point", "7.3,6.6,0", "--method", "exact", "--intrinsic", "-o", "d.npy").is_code(0)
    assert all(abs(a - math.hypot(x - 7.3, y - 6.6)) < 1e-9 for a, (x, y, _) in zip(npy("d.npy"), v))
    loxo("geodesic", mesh, "-s", "0", "--intrinsic", "--max-flips", "5", "-o", "d.npy").is_code(8)
    loxo("geodesic", mesh, "-s", "0", "--intrinsic", "--mollify", "0", "-o", "d.npy").is_code(2)
    a, b = (loxo("geodesic", mesh, "-s", "0", *more, "-o", "d.npy", "--estimate", "--json", "-").json
            for more in ([], ["--intrinsic"]))
    assert str(a) != str(b)


@test
def convert_there_and_back():
    mesh = octahedron()
    want = loxo("info", mesh, "--json", "-").json["mesh"]
    for suffix in ("ply", "obj", "off", "surf.gii"):
        if suffix == "surf.gii":
            try:
                needs("expat (GIFTI)")
            except Skip:
                continue
        loxo("convert", mesh, "-o", f"x.{suffix}", "--quiet").is_code(0)
        got = loxo("info", f"x.{suffix}", "--json", "-").is_code(0).json["mesh"]
        assert got["n_faces"] == 8 and math.isclose(got["area"], want["area"], rel_tol=1e-6), (suffix, got)
    r = loxo("convert", mesh, "-o", "-", "--format", "off").is_code(0)
    assert r.out_bytes == read("x.off")


@test
def convert_subdivides_without_changing_the_surface():
    mesh = octahedron()
    loxo("convert", mesh, "-o", "x.ply", "--subdivide", "3").is_code(0).has_err(r"^result +258 vertices, 512 faces$")
    m = loxo("info", "x.ply", "--json", "-").json["mesh"]
    assert (m["n_vertices"], m["n_faces"], m["euler"]) == (258, 512, 2)
    assert math.isclose(m["area"], 4 * math.sqrt(3), rel_tol=1e-12)


@test
def convert_shuffles_by_seed():
    mesh = sphere("s.ply", 640)
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        loxo("convert", mesh, "-o", f"{name}.ply", "--shuffle", "--seed", seed).is_code(0)
    assert read("a.ply") == read("b.ply") != read("c.ply")
    m, n = (loxo("info", x, "--json", "-").json["mesh"] for x in (mesh, "a.ply"))
    assert m["n_edges"] == n["n_edges"] and math.isclose(m["area"], n["area"], rel_tol=1e-12)


@test
def convert_repairs_only_when_asked():
    v = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0), (9, 9, 9)]
    mesh = off("torn.off", v, [(0, 1, 2), (3, 5, 4)])
    loxo("convert", mesh, "-o", "same.off").is_code(0)
    assert loxo("info", "same.off", "--json", "-").json["mesh"]["faults"]["duplicate_vertices"]["count"] == 2
    loxo("convert", mesh, "-o", "mended.off", "--repair", "--drop-unreferenced", "--json", "r.json").is_code(0)
    r = report("r.json")
    assert r["status"] == "LOXO_REPAIRED"
    assert r["repair"]["n_vertices_welded"] == 2 and r["repair"]["n_unreferenced_dropped"] >= 1, r["repair"]
    m = loxo("info", "mended.off", "--json", "-").json["mesh"]
    assert (m["n_vertices"], m["n_components"], m["n_boundary_loops"]) == (4, 1, 1), m


@test
def generate_shapes():
    shapes = loxo("generate", "?", "-o", "x.ply").err.split("one of")[1].split()
    assert "icosphere" in shapes and len(shapes) >= 10, shapes
    for shape in shapes:
        loxo("generate", shape, "--vertices", "1000", "-o", "x.ply", "--json", "r.json").is_code(0)
        made, m = report("r.json")["mesh"], loxo("info", "x.ply", "--json", "-").json["mesh"]
        assert (made["n_vertices"], made["n_faces"]) == (m["n_vertices"], m["n_faces"]), shape
        assert 500 <= m["n_vertices"] <= 2000 and m["n_components"] == 1, (shape, m["n_vertices"])
        assert m["is_manifold"] and m["is_orientable"] and m["is_oriented"], shape


@test
def generate_is_seeded():
    for name, seed in (("a", 3), ("b", 3), ("c", 4)):
        loxo("generate", "noisy", "--vertices", "700", "--seed", seed, "-o", f"{name}.ply").is_code(0)
    assert read("a.ply") == read("b.ply") != read("c.ply")


@test
def generate_in_other_formats_and_widths():
    loxo("generate", "icosphere", "--vertices", "600", "-o", "d.ply").is_code(0)
    loxo("generate", "icosphere", "--vertices", "600", "-o", "f.ply", "--float").is_code(0)
    loxo("generate", "icosphere", "--vertices", "600", "-o", "o.off").is_code(0)
    d, f, o = (loxo("info", x, "--json", "-").is_code(0).json["mesh"] for x in ("d.ply", "f.ply", "o.off"))
    assert d["n_faces"] == f["n_faces"] == o["n_faces"]
    assert math.isclose(d["area"], o["area"], rel_tol=1e-12) and math.isclose(d["area"], f["area"], rel_tol=1e-5)
    assert os.path.getsize("f.ply") < os.path.getsize("d.ply")
    r = loxo("generate", "icosphere", "--vertices", "600", "-o", "-", "--format", "ply").is_code(0)
    assert r.out_bytes.startswith(b"ply\n")


@test
def generate_with_exact_distances():
    loxo("generate", "icosphere", "--vertices", "2000", "-o", "s.ply", "--exact-from", "5", "exact.npy").is_code(0)
    d = npy("exact.npy")
    assert d[5] == 0 and math.isclose(max(d), math.pi, rel_tol=0.02) and min(d) == 0
    loxo("generate", "bumpy", "--vertices", "2000", "-o", "b.ply", "--exact-from", "0", "b.npy").is_code(5)
    loxo("generate", "grid", "--vertices", "100", "-o", "g.ply", "--exact-from", "100000", "g.npy").fails(2, "not in 0")
    assert files() == ["exact.npy", "s.ply"]


@test
def geodesic_on_a_sphere():
    loxo("generate", "icosphere", "--vertices", fitting(10000), "-o", "s.ply", "--exact-from", "0",
         "exact.npy").is_code(0)
    for method in ("edge", "face"):
        r = loxo("geodesic", "s.ply", "-s", "0", "--method", method, "-o", "d.npy", "--exact", "exact.npy", "--json",
                 "r.json").is_code(0)
        r.has_err(r"^true error +mean \d+\.\d+ % \(eq\. 29\)").has_err(r"^answer +passed")
        j = report("r.json")
        assert j["error"]["mean_relative"] < 0.02, (method, j["error"])
        assert j["settings"]["geodesic"]["method"] == method
        info = j["info"]
        assert info["check_passed"] and info["diffusion_converged"] and info["n_sources"] == 1
        assert set(info["phase_s"]) >= {"diffusion"} and info["total_s"] > 0
        assert [f["file"] for f in j["files"]] == ["d.npy"] and j["files"][0]["bytes"] == os.path.getsize("d.npy")
        d = npy("d.npy")
        assert d[0] == 0 and math.isclose(max(d), info["distance_max"]) and 3.0 < max(d) < 3.3
        m = loxo("measure", "d.npy", "exact.npy", "--json", "-").is_code(0).json["error"]
        assert m == j["error"]


@test
def geodesic_chooses_its_method():
    mesh = sphere("s.ply", 2500)
    for words, method, because in (([], "exact", "small enough"), (["--method", "auto"], "exact", "small enough"),
                                   (["--iterations", "10"], "edge", "--iterations is an option of edge, face, variational"),
                                   (["--factor", "multigrid", "--sweeps", "9"], "heat",
                                    "--sweeps, --factor are options of heat, variational"),
                                   (["--factor", "multigrid", "--penalty", "9"], "variational", "are options of variational")):
        for command in (["geodesic", mesh, "-s", "0", "-o", "d.npy"], ["sample", mesh, "--count", "3", "-o", "p.csv"]):
            r = loxo(*command, *words, "--json", "-").is_code(0).has_err(rf"^method +{method}: .*{because}")
            assert r.json["choice"]["method"] == method and because in r.json["choice"]["reason"], r.json["choice"]
            assert r.json["settings"]["geodesic"]["method"] == "auto"
    loxo("geodesic", mesh, "-s", "0", "-o", "x.npy", "--factor", "multigrid", "--global-constraints").fails(
        2, "geodesic: no method has all of --factor, --global-constraints")
    r = loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", "--method", "fast", "--penalty", "3", "--strict").is_code(1)
    r.has_err("warning: --penalty changes nothing in method fast; it is an option of edge, face, variational$")
    if loxo("generate", "icosphere", "--vertices", fitting(25000), "-o", "l.ply").is_code(0) and fitting(25000) == 25000:
        loxo("geodesic", "l.ply", "-s", "0", "-o", "d.npy").has_err(r"^method +fast: ")
    with open("many.txt", "w", encoding="ascii") as f:
        f.write(" ".join(str(i) for i in range(1000)))
    loxo("geodesic", mesh, "--sources", "many.txt", "-o", "d.npy").is_code(0).has_err(r"^method +exact: ")
    r = loxo("geodesic", mesh, "--sources", "many.txt", "--matrix", "m.npy").is_code(0)
    r.has_err(r"^method +fast: the mesh is small enough for exact distances, but not for so many solves$")


@test
def geodesic_writes_every_format():
    mesh = sphere("s.ply", 700)
    words = [w for n in ("d.npy", "d.csv", "d.ply", "d.vtp", "d.shape.gii", "d.surf.gii") for w in ("-o", n)]
    loxo("geodesic", mesh, "-s", "0", *words, "--quiet").is_code(0)
    assert files() == ["d.csv", "d.npy", "d.ply", "d.shape.gii", "d.surf.gii", "d.vtp", "s.ply"]
    d = npy("d.npy")
    csv = read("d.csv").decode().splitlines()
    assert csv[0] == "vertex,distance" and len(csv) == len(d) + 1
    assert all(float(line.split(",")[1]) == x for line, x in zip(csv[1:], d))
    assert loxo("measure", "d.ply:distance", "d.npy", "--json", "-").is_code(0).json["error"]["max_absolute"] == 0
    m, n = (loxo("info", x, "--json", "-").json["mesh"] for x in (mesh, "d.ply"))
    assert m["area"] == n["area"] and m["n_faces"] == n["n_faces"]
    loxo("geodesic", mesh, "-s", "0", "-o", "-", "--format", "npy").is_code(0)


@test
def geodesic_comes_back_in_the_callers_order():
    mesh = sphere("s.ply", 2500)
    results = []
    for order in ("given", "hilbert", "morton", "bfs"):
        loxo("geodesic", mesh, "-s", "3", "--order", order, "-o", "d.npy", "-o", "d.ply", "--quiet").is_code(0)
        results.append(npy("d.npy"))
        assert results[-1][3] == 0
        assert loxo("measure", "d.ply:distance", "d.npy", "--json", "-").json["error"]["max_absolute"] == 0
        positions = [read(x) for x in (mesh, "d.ply")]
        rows = []
        for data in positions:  # the first vertices: x y z are the first three doubles of a row
            head = data.index(b"end_header\n") + len(b"end_header\n")
            stride = 24 if b"distance" not in data[:head] else 32
            rows.append([struct.unpack_from("<3d", data, head + stride * i) for i in range(50)])
        assert rows[0] == rows[1], order
    for other in results[1:]:
        assert max(abs(a - b) for a, b in zip(results[0], other)) < 0.05


@test
def geodesic_sources_in_all_ways():
    mesh = octahedron()
    loxo("convert", mesh, "-o", "o.ply", "--subdivide", "3")
    write("s.txt", "# poles\n4\n5 4\r\n5,4")
    runs = [("-s", "4,5"), ("-s", "4", "-s", "5"), ("--source=5,4,4",), ("--sources", "s.txt"),
            ("--source-point", "0,0,1.1", "--source-point", "0.001,0,-2"), ("-s", "4", "--source-point", "0,0,-1")]
    results = []
    for words in runs:
        r = loxo("geodesic", "o.ply", *words, "-o", "d.npy", "--json", "-").is_code(0)
        assert r.json["info"]["n_sources"] == 2, (words, r.json["info"])
        results.append(read("d.npy"))
    assert all(r == results[0] for r in results)
    r = loxo("geodesic", "o.ply", "--source-point", "0,0,1.5", "-o", "d.npy").is_code(0)
    r.has_err(r"^nearest +vertex 4 to 0,0,1\.5, 0\.5 away$")
    r = loxo("geodesic", "o.ply", "--source-point", "1,1,1", "-o", "d.npy", "--json", "-").is_code(0)
    assert len(r.json["sources"][0]["vertex"]) > 1 and abs(sum(r.json["sources"][0]["weight"]) - 1) < 1e-12, r.json
    assert abs(r.json["source_points"][0]["away"] - 2 / math.sqrt(3)) < 1e-12
    write("p.csv", "x,y,z\n0,0,1.5\n0,0,-1\n")
    r = loxo("geodesic", "o.ply", "--source-points", "p.csv", "-o", "d.npy", "--json", "-")
    assert r.json["sources"] == [4, 5] and read("d.npy") == results[0]
    write("poles.label", "#!ascii label\n2\n4 0 0 1 0\n5 0 0 -1 0\n")
    loxo("geodesic", "o.ply", "--sources", "poles.label", "-o", "d.npy").is_code(0)
    assert read("d.npy") == results[0]
    r = loxo("geodesic", "o.ply", "--sources", "-", "-o", "d.npy", "--json", "-", stdin=b"4 5")
    assert r.json["sources"] == [4, 5]


@test
def geodesic_paths_and_lines():
    mesh = sphere("s.ply", fitting(2500))
    r = loxo("geodesic", mesh, "-s", "0", "--path", "40", "--path", "0.1,0.2,-3", "--path-output", "w.csv",
             "--lines-output", "l.obj", "--level", "0.5,1", "--level", "2", "--json", "-").is_code(0)
    assert [p["from"] for p in r.json["paths"]] == ["40", "0.1,0.2,-3"]
    for p in r.json["paths"]:
        assert abs(p["length"] - p["distance"]) < 0.05 * p["distance"], p
    assert [i["level"] for i in r.json["isolines"]] == [0.5, 1, 2] and all(i["is_closed"] for i in r.json["isolines"])
    for i in r.json["isolines"]:
        assert abs(i["length"] / (2 * math.pi * math.sin(i["level"])) - 1) < 0.05, i
    r.has_err(r"^path +from 40: \S+ long, distance \S+$").has_err(r"^isolines +3 at 3 levels, 3 closed, ")
    rows = read("w.csv").decode().splitlines()
    assert rows[0] == "line,value,x,y,z" and rows[-1].startswith("1,") and len(rows) > 20
    assert read("l.obj").count(b"\nl ") == 3
    r = loxo("geodesic", mesh, "-s", "0", "--lines-output", "l.vtp").is_code(0).has_err(r"^isolines +10 at 10 levels")
    loxo("geodesic", mesh, "-s", "0", "--intrinsic", "--path", "40").is_code(0).has_err(r"^path +from 40: ")
    loxo("geodesic", mesh, "-s", "0", "--method", "exact", "--path", "40").is_code(0).has_err(r"^path +from 40: ")


@test
def geodesic_nearest_and_matrix():
    mesh = sphere("s.ply", fitting(2500))
    r = loxo("geodesic", mesh, "-s", "0,11,70", "--nearest-output", "n.npy", "--matrix", "m.csv", "--json", "-",
             "-o", "d.npy").is_code(0)
    near, d = npy("n.npy"), npy("d.npy")
    assert [near[0], near[11], near[70]] == [0, 1, 2] and set(near) == {0, 1, 2} and len(near) == len(d)
    rows = [[float(x) for x in row.split(",")] for row in read("m.csv").decode().splitlines()]
    assert len(rows) == 3 and all(len(row) == 3 for row in rows) and all(rows[i][i] == 0 for i in range(3))
    assert max(abs(rows[i][j] - rows[j][i]) for i in range(3) for j in range(3)) == r.json["matrix"]["asymmetry"]
    r = loxo("geodesic", mesh, "-s", "0", "--max-distance", "0.5", "-o", "d.npy", "--json", "-").is_code(0)
    d = npy("d.npy")
    assert r.json["info"]["n_unreached"] == sum(math.isinf(x) for x in d) > 0 and max(x for x in d if x < 9) <= 0.5
    assert r.json["warnings"] == []


@test
def geodesic_queries_that_are_wrong():
    mesh = octahedron()
    for words, code, text in (
            (["--path", "x"], 2, "--path takes a vertex number or x,y,z"), (["--path", "1,2"], 2, "--path takes"),
            (["--path", "6"], 2, "--path 6 is not in 0..5"), (["--level", "1"], 2, "--level is for --lines-output"),
            (["--lines-output", "l.csv", "--level", "a"], 2, "--level takes distances"),
            (["--lines-output", "l.csv", "--level", "0.5,-1"], 2, "--level takes distances from 0 on"),
            (["--lines-output", "l.csv", "--level", ",".join(["1"] * 10001)], 2, "--level takes .* 10000 at most"),
            (["--sources", "-", "--exact", "-"], 2, "standard input can be read only once"),
            (["--lines-output", "l.ply"], 5, "--lines-output writes .obj, .vtp, .csv"),
            (["--nearest-output", "n.obj"], 5, "--nearest-output writes"), (["--matrix", "m.obj"], 5, "--matrix writes"),
            (["--path-output", "w.obj"], 2, "--path-output needs a --path"),
            (["--path", "1", "--path-output", "nowhere/w.obj"], 9, "nowhere"),
            (["--max-distance", "0"], 2, "max-distance"), (["--max-distance", "nan"], 2, "max-distance")):
        loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", *words).fails(code, text)
    assert "d.npy" not in files()
    loxo("geodesic", "-", "--sources", "-", "-o", "d.npy").fails(2, "geodesic: standard input can be read only once")
    loxo("measure", "-", "-").fails(2, "standard input can be read only once")


@test
def paths_from_where_no_source_reaches():
    # two strips that do not touch, and a vertex of no face: the other ways and all files are there, one line tells why
    strip = [(i // 2, i % 2, 0) for i in range(12)]
    faces = [t for i in range(0, 10, 2) for t in ((i, i + 2, i + 1), (i + 1, i + 2, i + 3))]
    mesh = off("two.off", strip + [(x, y, 5) for x, y, _ in strip] + [(9, 9, 9)],
               faces + [tuple(i + 12 for i in t) for t in faces])
    elsewhere, beyond, nowhere = ("on another piece of the surface than every source", "beyond --max-distance",
                                  "in no face")
    for method in ("exact", "fast", "edge", "heat"):
        for more in ([], ["--intrinsic"]):
            r = loxo("geodesic", mesh, "-s", "0", "--method", method, *more, "--path", "4", "--path", "20", "--path",
                     "2.2,0.1,5", "--path", "24", "--path", "1", "--path-output", "w.csv", "-o", "d.npy", "--json",
                     "-").is_code(0)
            assert files() == ["d.npy", "two.off", "w.csv"]
            paths = r.json["paths"]
            assert [p["is_reached"] for p in paths] == [True, False, False, False, True], paths
            assert [p.get("reason") for p in paths] == [None, elsewhere, elsewhere, nowhere, None], paths
            assert paths[1]["length"] is None and paths[1]["distance"] is None and paths[1]["n_points"] == 0
            assert abs(paths[0]["length"] - 2) < 0.1 and abs(paths[4]["length"] - 1) < 1e-9, paths
            r.has_err(rf"^two\.off: warning: --path 20 and 1 more are not reached: they are {elsewhere}$")
            r.has_err(rf"^two\.off: warning: --path 24 is not reached: it is {nowhere}$")
            r.has_err(rf"^path +from 20: none, it is {elsewhere}$")
            assert {row.split(",")[0] for row in read("w.csv").decode().splitlines()[1:]} == {"0", "4"}
    words = ["geodesic", mesh, "-s", "0", "--max-distance", "2.5", "-o", "d.npy", "--path", "10", "--path", "20"]
    r = loxo(*words, "--json", "-").is_code(0)
    assert [p["reason"] for p in r.json["paths"]] == [beyond, elsewhere], r.json["paths"]
    assert sum("is not reached" in w["text"] for w in r.json["warnings"]) == 2, r.json["warnings"]
    loxo(*words, "--strict").is_code(1)
    # nothing but ways that are none: still written, and empty
    loxo("geodesic", mesh, "-s", "0", "--path", "24", "--path-output", "w.obj").is_code(0)
    assert read("w.obj") == b""


@test
def levels_that_cut_nothing():
    r = loxo("geodesic", octahedron(), "-s", "0", "--lines-output", "l.csv", "--level", "0.5,99", "--json", "-")
    r.is_code(0).has_err(r"octahedron\.off: warning: 1 of 2 levels meet no face$")
    assert {line["level"] for line in r.json["isolines"]} == {0.5}


@test
def sample_of_a_sphere():
    mesh = sphere("s.ply", fitting(2500))
    r = loxo("sample", mesh, "--count", "20", "-o", "p.csv", "-o", "p.txt", "-o", "p.npy", "--json", "-").is_code(0)
    radius = r.json["radius"]
    assert len(r.json["points"]) == len(set(r.json["points"])) == 20 and r.json["points"][0] == 0
    assert all(a >= b for a, b in zip(radius, radius[1:])) and 0.3 < radius[-1] < 0.8
    assert [int(x) for x in read("p.txt").split()] == r.json["points"]
    r.has_err(r"^points +20, every vertex within \S+ of one$")
    loxo("geodesic", mesh, "--sources", "p.txt", "-o", "a.npy", "--quiet")
    loxo("geodesic", mesh, "--source-points", "p.csv", "-o", "b.npy", "--quiet")
    assert read("a.npy") == read("b.npy") and abs(max(npy("a.npy")) - radius[-1]) < 0.1
    loxo("sample", mesh, "--count", "3", "-s", "7,8", "-o", "q.txt").is_code(0)
    assert [int(x) for x in read("q.txt").split()][:2] == [7, 8]
    loxo("sample", mesh, "--count", "4", "-s", "7,8,7", "-s", "8", "-o", "q.txt").is_code(0)
    assert [int(x) for x in read("q.txt").split()][:2] == [7, 8] and len(set(read("q.txt").split())) == 4
    loxo("sample", mesh, "-o", "q.txt").fails(2, "--count N")
    loxo("sample", mesh, "--count", "0", "-o", "q.txt").fails(2, "--count N")
    loxo("sample", mesh, "--count", "5").fails(2, "no output")
    loxo("sample", mesh, "--count", "5", "-o", "q.ply").fails(5, "sample: -o writes")
    loxo("sample", mesh, "--count", "999999", "-o", "r.txt").fails(2, "999999 points of")
    loxo("sample", mesh, "--count", "1", "-s", "0,1", "-o", "r.txt").fails(2, "fewer points are wanted")
    loxo("sample", mesh, "--count", "5", "--estimate").is_code(0).has_out(r"^peak_bytes ")


@test
def geodesic_many_sources():
    mesh = sphere("s.ply", 2500)
    write("all.txt", "\n".join(str(i) for i in range(2400)))
    r = loxo("geodesic", mesh, "--sources", "all.txt", "-o", "d.npy", "--json", "-")
    assert r.code in (0, 8) and r.json["info"]["n_sources"] == 2400, r
    assert all(x == 0 for x in npy("d.npy")[:2400])


@test
def bad_triangles_and_failed_checks():
    # a sheared grid: named methods are told of --intrinsic, and not where it is there, or of no use
    n = 20
    at = [j * n + i for j in range(n - 1) for i in range(n - 1)]
    needles = off("needles.off", [(i + 3 * j, j, 0) for j in range(n) for i in range(n)],
                  [t for a in at for t in ((a, a + 1, a + n + 1), (a, a + n + 1, a + n))])
    for method in ("edge", "face", "heat", "fast"):
        loxo("geodesic", needles, "-s", "0", "--method", method, "-o", "d.npy").has_err(
            r"^hint +[0-9.]+ % of the edges are not Delaunay: --intrinsic ")
    loose = ["--check-gradient-share", "1", "--check-breach", "1e9"]
    mesh = sphere("s.ply", 600)
    for words in ([needles, "--method", "edge", "--intrinsic"], [needles, "--method", "exact"], [mesh, "--method", "edge"]):
        assert "hint " not in loxo("geodesic", *words, "-s", "0", *loose, "-o", "d.npy").err
    # what a check failed by is told by name; an answer that passes has nothing to tell
    words = ["geodesic", mesh, "-s", "0", "--json", "-", "--method", "face"]
    r = loxo(*words, "--check-gradient-share", "0", "--check-breach", "0").is_code(8)
    assert r.json["info"]["check_failed_by"] == ["gradient_share", "breach_percentile_99"], r.json["info"]
    r.has_err(r"^answer +FAILED for its gradient and breached edges: gradient off 1 by ")
    r = loxo(*words).is_code(0).has_err(r"^answer +passed: gradient off 1 by ")
    assert r.json["info"]["check_failed_by"] == [] and r.json["memory"]["program_bytes"] > 1e5
    r.has_err(r"^memory +\S+ MB peak, \S+ MB of it the program before; \d+ bytes a vertex besides; workspace \S+ kB$")


@test
def rows_have_names_of_their_own():
    loxo("generate", "icosphere", "--vertices", fitting(2500), "-o", "s.ply", "--exact-from", "0", "e.npy").is_code(0)
    for method in ("fast", "heat"):
        r = loxo("geodesic", "s.ply", "-s", "0", "--method", method, "--exact", "e.npy", "-o", "d.npy").is_code(0)
        names = [row[:16].strip() for row in r.err.splitlines() if not row.startswith("s.ply: warning")]
        assert len(names) == len(set(names)) and "true error" in names, names


@test
def geodesic_on_two_components():
    v = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    w = v + [(x + 5, y, z) for x, y, z in v]
    f = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (0, 3, 2)]
    mesh = off("two.off", w, f + [tuple(i + 4 for i in t) for t in f])
    r = loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", "-o", "d.csv", "--json", "-")
    assert r.code in (0, 8), r
    r.has_err("warning: 4 vertices cannot be reached").has_err("warning: the mesh has 2 components")
    assert r.json["info"]["n_unreached"] == 4
    assert [math.isinf(x) for x in npy("d.npy")] == [False] * 4 + [True] * 4


@test
def geodesic_estimate():
    mesh = sphere("s.ply", 2500)
    r = loxo("geodesic", mesh, "--estimate", "--json", "-").is_code(0)
    e = r.json["estimate"]
    assert e["peak_bytes"] > 76 * 2000 and e["seconds"] > 0 and e["fits"] is True, e
    assert e["peak_bytes"] + 5e5 < e["process_bytes"] < e["peak_bytes"] + 1e9, e
    r = loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", "--estimate").is_code(0)
    r.has_out(r"^peak_bytes +\S").has_out(r"^seconds +about").has_out(r": fits$")
    assert files() == ["s.ply"]
    for words in (["info", mesh], ["convert", mesh, "--subdivide", "2"], ["generate", "grid", "--vertices", "1000000"],
                  ["render", mesh]):
        loxo(*words, "--estimate").is_code(0).has_out(r"^peak_bytes ")


@test
def estimate_of_more_than_the_limit():
    """Whatever the format, an estimate is not refused for lack of what it speaks of, and not less than a solve takes."""
    mesh = sphere("s.ply", fitting(40000))
    made = [mesh]
    for name in ("s.off", "s.obj", "s.surf.gii"):
        if has_feature("expat (GIFTI)") or not name.endswith("gii"):
            made.append(loxo("convert", mesh, "-o", name).is_code(0) and name)
    for name in made:
        r = loxo("geodesic", name, "--estimate", "--max-memory", "1K", "--json", "e.json").is_code(0)
        r.has_out(r"^limit .*: does not fit$").has_out(r"^peak_bytes +[0-9.]+ [kM]B$")
        r.has_err(rf"^{name}: warning: \d+ bytes are needed; the limit is 1024 \(--max-memory\)$")
        loxo("geodesic", name, "--estimate", "--max-memory", "1K", "--strict").is_code(1)
        with open("e.json", encoding="utf-8") as f:
            e = json.load(f)["estimate"]
        assert e["fits"] is False and e["limit_bytes"] == 1024, e
        for more in ([], ["--method", "edge"], ["--method", "face"], ["--order", "hilbert"], ["--global-constraints"]):
            e = loxo("geodesic", name, "--estimate", "--json", "-", *more).is_code(0).json["estimate"]
            m = loxo("geodesic", name, "-s", "0", "--json", "-", *more).is_code(0).json["memory"]
            assert m["peak_bytes"] <= e["peak_bytes"] <= 1.3 * m["peak_bytes"] + 1e6, (name, more, e, m)
    for shape, more in (("torus", ["--global-constraints"]), ("disk", [])):
        loxo("generate", shape, "--vertices", fitting(20000), "-o", "x.ply").is_code(0)
        e = loxo("geodesic", "x.ply", "--estimate", "--json", "-", *more).is_code(0).json["estimate"]
        m = loxo("geodesic", "x.ply", "-s", "0", "--json", "-", *more).json["memory"]
        assert m["peak_bytes"] <= e["peak_bytes"] <= 1.3 * m["peak_bytes"] + 1e6, (shape, e, m)
    r = loxo("geodesic", "-", "--estimate", "--max-memory", "1K", stdin=read("s.off")).is_code(0)
    r.has_out("does not fit")


@test
def more_than_there_are_ids():
    n_vertices, n_faces = 400_000_000, 800_000_000
    with open("big.ply", "wb") as f:
        f.write((f"ply\nformat binary_little_endian 1.0\nelement vertex {n_vertices}\nproperty float x\nproperty float y\n"
                 f"property float z\nelement face {n_faces}\nproperty list uchar int vertex_indices\nend_header\n").encode())
        f.truncate(f.tell() + 12 * n_vertices + 13 * n_faces)
    for words in (["--estimate"], ["-s", "0", "-o", "d.npy", "--max-memory", "1T"]):
        r = loxo("geodesic", "big.ply", *words).is_code(7).has_err(r"^big\.ply: error: .*\b400000000 vertices")
        assert r.err.count("\n") == 1, r


@test
def a_solve_that_will_not_fit_is_refused_before_reading():
    mesh = sphere("s.ply", fitting(40000))
    e = loxo("geodesic", mesh, "--estimate", "--order", "given", "--json", "-").is_code(0).json["estimate"]
    need = e["mesh_bytes"] + e["workspace_bytes"] + e["result_bytes"]
    # So little that reading the mesh would not fit either: the error is the solve's.
    for limit in (need - 1, max(need // 8, 400000)):
        r = loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", "--order", "given", "--max-memory", limit, "--json", "-")
        r.fails(7, rf"^s\.ply: error: .* faces need {need} bytes; the limit is {limit} ")
        assert "read" not in r.json["seconds"], r.json
    assert files() == ["s.ply"]


@test
def geodesic_same_bits_for_any_number_of_threads():
    mesh = sphere("s.ply", 20000)
    want = None
    for n in (1, 2, 3, 7):
        loxo("geodesic", mesh, "-s", "0,77", "--threads", n, "-o", "d.npy", "--quiet").is_code(0)
        want = want or read("d.npy")
        assert read("d.npy") == want, n


@test
def geodesic_memory_of_the_process():
    """The bound is 250 bytes a vertex, the program itself included; a sanitizer has memory of its own."""
    needs_big_ids()
    mesh = sphere("s.ply", 20000 if IS_SANITIZED else 1000000)
    r = loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", "--json", "-").is_code(0).json
    per_vertex = r["memory"]["peak_resident_bytes"] / r["mesh"]["n_vertices"]
    assert IS_SANITIZED or per_vertex <= 250, per_vertex


@test
def pictures():
    needs("libpng (pictures)")
    mesh = sphere("s.ply", 2500)
    loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", "-o", "d.ply", "--picture", "p.png", "--width", "320", "--height",
         "200", "--title", "sphere").is_code(0).has_err(r"^wrote +p\.png")
    data = read("p.png")
    assert data.startswith(b"\x89PNG\r\n\x1a\n") and struct.unpack_from(">II", data, 16) == (320, 200)
    loxo("render", mesh, "--field", "d.npy", "-o", "a.png", "--width", "160", "--height", "120").is_code(0)
    loxo("render", "d.ply", "--field", "distance", "-o", "b.png", "--width", "160", "--height", "120").is_code(0)
    assert read("a.png") == read("b.png")
    loxo("render", mesh, "-o", "c.png", "--width", "160", "--height", "120").is_code(0)
    assert read("c.png") != read("a.png")
    loxo("render", mesh, "-o", "c.png", "--width", "4").fails(2, "width")


@test
def report_for_machines():
    mesh = sphere("s.ply", 700)
    loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", "--json", "r.json", "--threads", "2").is_code(0)
    r = report("r.json")
    assert (r["command"], r["status"], r["exit_code"], r["input"], r["threads"]) == ("geodesic", "LOXO_OK", 0, "s.ply", 2)
    assert {"read", "mesh", "solve", "write", "total", "processor"} <= set(r["seconds"])
    assert {"peak_bytes", "limit_bytes", "peak_resident_bytes"} <= set(r["memory"])
    assert {"geodesic", "intrinsic", "mesh", "picture", "common"} == set(r["settings"])
    assert r["warnings"] == [] and r["sources"] == [0]
    text = read("r.json").decode("ascii")
    assert "NaN" not in text and "Infinity" not in text and text.endswith("}\n")


@test
def measure_of_itself_is_zero():
    mesh = sphere("s.ply", 700)
    loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", "-o", "d.csv", "--quiet")
    e = loxo("measure", "d.csv", "d.npy", "--json", "-").is_code(0).json["error"]
    assert e["max_absolute"] == e["mean_relative"] == 0 and e["n_mismatched"] == 0 and e["n_compared"] == len(npy("d.npy"))


@test
def real_meshes_where_they_are():
    if not os.path.isdir(os.path.join(SHARED, "meshes", "surfaces")):
        return  # the folder is no part of the project
    needs_big_ids()
    kitten = os.path.join(SHARED, "meshes", "surfaces", "kitten10k.ply")
    exact = os.path.join(SHARED, "meshes", "exact", "kitten_from0.npy")
    r = loxo("geodesic", kitten, "-s", "0", "--exact", exact, "--json", "-").is_code(0)
    assert r.json["error"]["mean_relative"] < 0.03 and r.json["mesh"]["genus"] >= 0, r.json["error"]


main()
