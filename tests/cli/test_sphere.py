# SPDX-License-Identifier: MIT
"""Maps to the sphere: methods, starts, files, and surfaces that have none."""
import json
import math

from harness import (files, fitting, has_feature, loxo, main, moebius, off, octahedron, read, test, tetrahedron,
                     three_at_an_edge)


def surface(path="b.ply", n=2500, shape="bumpy"):
    loxo("generate", shape, "--vertices", fitting(n), "-o", path).is_code(0)
    return path


@test
def a_map_and_what_is_told():
    mesh = surface()
    wanted = ["-o", "m.ply", "-o", "m.npy"] + (["--picture", "m.png"] if has_feature("libpng (pictures)") else [])
    r = loxo("sphere", mesh, *wanted, "--json", "r.json").is_code(0)
    r.has_err(r"^method +newton from (harmonic|scem); tolerance after [0-9]+ steps and [0-9]+ linear ones$")
    r.has_err(r"^one to one +0 triangles turned over, 0 before they were mended; degree 1$")
    report = json.loads(read("r.json"))
    solve, m = report["solve"], report["map"]
    assert solve["folds"] == 0 and solve["degree"] == 1 and solve["held"] == 0 and solve["residual"] <= 1e-9, solve
    assert math.isclose(solve["objective"], m["energy_signed"], rel_tol=1e-9), (solve, m)
    assert m["n_folds"] == 0 and m["degree"] == 1 and m["angle_error_deg"]["median"] < 5, m
    assert solve["center"]["class"] == "stable" and abs(1 - solve["center"]["gap"]) < 1e-8, solve
    # what was written is what was told
    again = loxo("measure", mesh, "--sphere", "m.npy", "--json", "-").is_code(0).json
    assert again["map"] == m and math.isclose(again["centred"]["energy"], m["energy"], rel_tol=1e-9), again
    assert loxo("measure", mesh, "--sphere", "m.ply", "--json", "-").is_code(0).json["map"] == m


@test
def bits_do_not_depend_on_threads():
    mesh = surface()
    for name, more in (("one", ["--threads", "1", "--isa", "baseline"]), ("many", ["--threads", "7"])):
        loxo("sphere", mesh, "-o", f"{name}.npy", *more).is_code(0)
    assert read("one.npy") == read("many.npy")


@test
def methods_and_starts():
    mesh = surface(n=642)
    best = loxo("sphere", mesh, "--json", "-").is_code(0).json["solve"]["objective"]
    for method in ("scem", "flash", "cmcf") + (("hbtr",) if has_feature("CHOLMOD") else ()):
        s = loxo("sphere", mesh, "--method", method, "--json", "-").is_code(0).json["solve"]
        assert s["method"] == method and s["folds"] == 0 and s["degree"] == 1, s
        assert s["objective"] >= best - 1e-12, (s, best)
    for start in ("harmonic", "scem", "flash", "cmcf", "positive"):
        s = loxo("sphere", mesh, "--start", start, "--json", "-").is_code(0).json["solve"]
        assert s["start"] == start and math.isclose(s["objective"], best, rel_tol=1e-9), (s, best)
    # another map to begin with, and what it is again
    loxo("sphere", mesh, "--method", "scem", "-o", "scem.ply").is_code(0)
    s = loxo("sphere", mesh, "--from", "scem.ply", "--json", "-").is_code(0).json["solve"]
    assert s["start"] == "given" and math.isclose(s["objective"], best, rel_tol=1e-9), s
    s = loxo("sphere", mesh, "--intrinsic", "--json", "-").is_code(0).json["solve"]
    assert math.isclose(s["objective"], best, rel_tol=1e-2) and s["folds"] == 0, s
    loxo("sphere", mesh, "--free", "--json", "r.json").is_code(0)
    free = json.loads(read("r.json"))["solve"]
    assert free["energy"] < best and free["center"]["gap"] < 1, free
    loxo("sphere", mesh, "--method", "scem", "--max-iterations", "1", "-o", "x.ply", "--json", "r.json").is_code(8)
    assert json.loads(read("r.json"))["status"] == "LOXO_NOT_CONVERGED" and read("x.ply")


@test
def surfaces_that_have_none():
    octahedron("o.off")
    three_at_an_edge("book.off")
    moebius("strip.off")
    loxo("generate", "torus", "--vertices", "400", "-o", "t.off").is_code(0)
    loxo("generate", "disk", "--vertices", "100", "-o", "d.off").is_code(0)
    tetra = [(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]
    faces = [(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)]
    off("two.off", tetra + [tuple(x + 5 for x in p) for p in tetra], faces + [tuple(v + 4 for v in f) for f in faces])
    off("bare.off", tetra + [(9, 9, 9)], faces)
    off("flat.off", [(0, 0, 0)] * 4, faces)
    off("none.off", [], [])
    before = files()
    for path, why in (("t.off", "has genus 1"), ("d.off", "is open: [0-9]+ edges"), ("two.off", "has 2 pieces"),
                      ("bare.off", "vertex 4 .*belong to no face"), ("flat.off", "no area"), ("none.off", "has no faces"),
                      ("book.off", "error: "), ("strip.off", "error: ")):
        loxo("sphere", path, "-o", "x.ply").is_code(6).has_err(why)
    loxo("sphere", "o.off").fails(2, "sphere: no output; give -o FILE, --picture or --json")
    loxo("sphere", "o.off", "-o", "x.ply", "--start", "given").fails(2, "--from FILE")
    loxo("sphere", "o.off", "-o", "x.ply", "--from", "t.off").fails(6, r"^t\.off: error: has [0-9]+ vertices, the surface 6$")
    loxo("sphere", "o.off", "-o", "x.ply", "--tolerance", "-1").fails(2, "tolerance")
    loxo("sphere", "nothing.off", "-o", "x.ply").fails(3, "nothing.off")
    loxo("sphere", "o.off", "-o", "x.xyz").fails(2, "the suffix names no format")
    assert files() == before
    loxo("sphere", "o.off", "-o", "x.ply").is_code(0)
    loxo("sphere", tetrahedron("small.off"), "-o", "y.ply").is_code(0)


@test
def memory_and_estimate():
    mesh = surface(n=5000)
    told = loxo("sphere", mesh, "--estimate").is_code(0).has_out(r"^peak_bytes ").has_out(r"^workspace_bytes ")
    assert told
    loxo("sphere", mesh, "-o", "x.ply", "--max-memory", "1M").is_code(7)
    assert "x.ply" not in files()


main()
