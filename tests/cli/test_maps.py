# SPDX-License-Identifier: MIT
"""Maps to the sphere and their Moebius centring; closed curves extended to the disk."""
import json
import math

from harness import files, fitting, has_feature, loxo, main, off, read, sphere, test, write


def octahedron(path, scale=(1, 1, 1)):
    v = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    f = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    return off(path, [tuple(s * x for s, x in zip(scale, p)) for p in v], f)


def vertices(path):
    """Of an OFF file."""
    lines = [line for line in read(path).decode().splitlines() if line and not line.startswith("#")]
    n = int(lines[1].split()[0])
    return [tuple(float(x) for x in line.split()) for line in lines[2:2 + n]]


@test
def center_moves_the_mean_to_the_centre():
    # A surface whose top vertex is far out: the faces there are large, so their vertices are drawn apart.
    v = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 5), (0, 0, -1)]
    f = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    surface, ball = off("surface.off", v, f), octahedron("sphere.off")
    r = loxo("center", ball, "--mesh", surface, "-o", "out.off", "--json", "r.json").is_code(0)
    r.has_err(r"^barycenter +\S+ \S+ 0\.[0-9]+, 1 - \|w\| 0\.[0-9]+, within [0-9.e-]+$")
    r.has_err(r"^mean +[0-9.e-]+ before, [0-9.e-]+ after, [0-9]+ steps, ")
    center = json.loads(read("r.json"))["center"]
    assert center["class"] == "stable" and center["mean_after"] < 1e-15 and center["bound"] < 1e-13, center
    assert center["w"][:2] == [0, 0] and math.isclose(center["gap"], 1 - center["w"][2], rel_tol=1e-12), center
    area = [0.0] * 6
    for a, b, c in f:
        p, q = [[v[i][k] - v[a][k] for k in range(3)] for i in (b, c)]
        n = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]]
        for i in (a, b, c):
            area[i] += math.hypot(*n) / 6
    out = vertices("out.off")
    for k in range(3):
        assert abs(sum(a * p[k] for a, p in zip(area, out))) < 1e-12 * sum(area), (k, out)
    assert all(abs(math.hypot(*p) - 1) < 1e-12 for p in out)
    # once more: nothing moves
    again = loxo("center", "out.off", "--mesh", surface, "--json", "-").is_code(0).json["center"]
    assert math.hypot(*again["w"]) < 1e-14, again


@test
def center_says_what_does_not_fit():
    octahedron("sphere.off")
    octahedron("large.off", (2, 2, 2))
    other = off("other.off", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    before = files()
    loxo("center", "large.off", "--mesh", "sphere.off", "-o", "x.ply").fails(
        6, r"^large\.off: error: center: vertex 0 is not on the unit sphere within 1e-05$")
    loxo("center", "sphere.off", "--mesh", other, "-o", "x.ply").fails(
        6, r"^other\.off: error: has 3 vertices and 1 faces, the map on the sphere 6 and 8$")
    loxo("center", "sphere.off", "-o", "x.ply").fails(2, r"^loxo: error: center: give the surface")
    loxo("center", "sphere.off", "--mesh", "large.off").fails(2, "center: no output")
    loxo("center", "sphere.off", "--mesh", "none.off", "-o", "x.ply").fails(3, "none.off")
    loxo("center", "sphere.off", "--mesh", "large.off", "-o", "x.ply", "--off-sphere", "2").fails(2, "off-sphere")
    assert files() == before
    flat = octahedron("flat.off", (0, 0, 0))
    loxo("center", "sphere.off", "--mesh", flat, "-o", "x.ply").fails(2, "center|barycenter")
    text = read("sphere.off").decode().splitlines()
    text[-1] = "3 3 0 5"
    write("turned.off", ("\n".join(text) + "\n").encode())
    loxo("center", "sphere.off", "--mesh", "turned.off", "-o", "x.ply").is_code(0).has_err(
        r"^sphere\.off: warning: 1 faces have other corners than those of the surface: is this a map of it\?$")


@test
def center_where_one_point_has_half_of_the_area():
    # Five vertices of the map stand at one point.
    v = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)]
    f = [(0, 2, 4), (2, 1, 4), (1, 3, 4), (3, 0, 4), (2, 0, 5), (1, 2, 5), (3, 1, 5), (0, 3, 5)]
    surface = off("surface.off", v, f)
    fallen = off("fallen.off", [(0, 0, 1)] * 5 + [(0, 0, -1)], f)
    r = loxo("center", fallen, "--mesh", surface, "-o", "x.off", "--json", "-").is_code(8)
    assert r.json["center"]["class"] == "none" and r.json["status"] == "LOXO_CHECK_FAILED"
    assert vertices("x.off") == vertices("fallen.off")


@test
def center_bits_and_estimate():
    ball = sphere("s.ply", 5000)
    loxo("generate", "bumpy", "--vertices", "5000", "-o", "b.ply").is_code(0)
    for name, more in (("one", ["--threads", "1", "--isa", "baseline"]), ("many", ["--threads", "7"])):
        loxo("center", ball, "--mesh", "b.ply", "-o", f"{name}.ply", *more).is_code(0)
    assert read("one.ply") == read("many.ply")
    loxo("center", ball, "--mesh", "b.ply", "--estimate").is_code(0).has_out(r"^peak_bytes ")


def circle_map(path, f, n=400):
    """Samples of a map of the circle to itself, by angles."""
    write(path, "".join(f"{f(2 * math.pi * i / n)!r}\n" for i in range(n)).encode())
    return path


def rows(path):
    return [[float(x) for x in line.split(",")] for line in read(path).decode().splitlines()]


@test
def extend_the_identity_and_a_power():
    # The extension of z -> z^k is z -> z^k.
    for k in (1, 2):
        circle_map("angles.csv", lambda t, k=k: k * t, 4000)
        write("at.csv", b"0,0\n0.5,0.25\n-0.3,0.9\n0.6,-0.8\n")
        loxo("extend", "angles.csv", "--at", "at.csv", "-o", "out.csv", "--rule", "graded").is_code(0)
        for x, y, u, v, co, bound, error, kind in rows("out.csv"):
            w = complex(x, y) ** k
            assert abs(complex(u, v) - w) < 1e-5 and math.isclose(co, max(1 - abs(w) ** 2, 0), abs_tol=1e-5), (x, y, u, v)
            assert bound <= 1e-8 and error < 1e-3 and kind == (1 if x == 0.6 else 0), (bound, error, kind)


@test
def extend_near_the_circle():
    circle_map("angles.csv", lambda t: t)
    write("at.csv", b"0,0.99999999999999,2e-14\n1,0,2e-200\n0,-1,0\n")
    loxo("extend", "angles.csv", "--at", "at.csv", "-o", "out.csv").is_code(0)
    out = rows("out.csv")
    for (_, _, _, _, co, *_), want in zip(out, (2e-14, 2e-200, 0)):
        assert math.isclose(co, want, rel_tol=2e-8), out
    assert [r[-1] for r in out] == [0, 0, 1]


@test
def extend_makes_a_disk():
    n = fitting(3000)
    curve = [(math.cos(t), 0.8 * math.sin(t), 0.6 * math.sin(2 * t)) for t in (2 * math.pi * i / 100 for i in range(100))]
    write("curve.csv", "".join(f"{x},{y},{z}\n" for x, y, z in curve).encode())
    loxo("extend", "curve.csv", "-o", "x.ply", "--points", "100").fails(
        4, r"^curve\.csv: error: sample 1 is not on the unit sphere within 1e-6$")
    r = loxo("extend", "curve.csv", "--normalize", "--points", str(n), "-o", "x.ply", "-o", "x.csv", "-o", "x.off",
             "--json", "r.json").is_code(0)
    r.has_err(r"^points +[0-9,]+: nodes fixed at [0-9,]+, moving at [0-9,]+, on the circle [0-9,]+, resting 0$")
    e = json.loads(read("r.json"))["extension"]
    out = rows("x.csv")
    assert len(out) == e["n_points"] == e["n_fixed"] + e["n_moving"] + e["n_near"] + e["n_curve"], e
    assert e["bound_max"] <= 1e-8 and e["n_open"] == 0, e
    m = loxo("info", "x.ply", "--json", "-").is_code(0).json["mesh"]
    assert m["n_vertices"] == len(out) and m["n_boundary_loops"] == 1 and m["euler"] == 1, m
    assert all(math.dist(p, row[2:5]) < 1e-6 for p, row in zip(vertices("x.off"), out))
    for row in out:
        w = math.hypot(*row[2:5])
        assert abs(1 - w * w - row[5]) < 1e-12 and (row[-1] == 1) == (w > 1 - 1e-12)
    for name, more in (("one", ["--threads", "1", "--isa", "baseline"]), ("many", ["--threads", "7"])):
        loxo("extend", "curve.csv", "--normalize", "--points", "500", "-o", f"{name}.ply", *more).is_code(0)
    assert read("one.ply") == read("many.ply")
    if has_feature("libpng (pictures)"):
        loxo("extend", "curve.csv", "--normalize", "--points", "500", "--picture", "p.png").is_code(0)
        assert read("p.png")[:4] == b"\x89PNG"
    loxo("extend", "curve.csv", "--normalize", "--estimate").is_code(0).has_out(r"^peak_bytes ")


@test
def extend_a_curve_that_rests_and_one_by_length():
    # Half of the samples at one point: at the centre that is it; by length the stops do not count.
    circle_map("rest.csv", lambda t: 0.0 if t <= math.pi * 1.02 else 2 * (t - math.pi * 1.02) * math.pi / (2 * math.pi - math.pi * 1.02))
    write("at.csv", b"0,0\n")
    loxo("extend", "rest.csv", "--at", "at.csv", "-o", "out.csv").is_code(0)
    assert rows("out.csv")[0][2:5] == [1, 0, 0] and rows("out.csv")[0][-1] == 2
    loxo("extend", "rest.csv", "--at", "at.csv", "-o", "out.csv", "--by", "length").is_code(0)
    row = rows("out.csv")[0]
    assert math.hypot(row[2], row[3]) < 0.02 and row[-1] == 0, row


@test
def extend_says_what_does_not_fit():
    circle_map("a.csv", lambda t: t, 12)
    write("outside.csv", b"0,0\n0.9,0.9\n")
    write("four.csv", b"1,2,3,4\n")
    write("opposite.csv", b"1,0\n-1,0\n0,1\n")
    write("space.csv", b"1,0,0,0\n0,1,0,0\n0,0,1,0\n")
    before = files()
    loxo("extend", "a.csv").fails(2, "extend: no output")
    loxo("extend", "a.csv", "--at", "outside.csv", "-o", "x.csv").fails(
        4, r"^outside\.csv: error: point 1 is not in the unit disk$")
    loxo("extend", "a.csv", "--at", "four.csv", "-o", "x.csv").fails(5, r"^four\.csv: error: points are rows of 2 numbers")
    loxo("extend", "a.csv", "--at", "outside.csv", "-o", "x.ply").fails(5, "values at points go to")
    loxo("extend", "a.csv", "--at", "outside.csv", "--picture", "x.png").fails(2, "picture")
    loxo("extend", "opposite.csv", "-o", "x.ply", "--points", "100").fails(
        4, r"^opposite\.csv: error: sample 0 is opposite to the next one$")
    loxo("extend", "outside.csv", "-o", "x.ply", "--points", "100").fails(2, "at least 3 samples")
    loxo("extend", "space.csv", "-o", "x.ply").fails(5, "a disk in 4 dimensions is no surface")
    loxo("extend", "a.csv", "-o", "x.ply", "--nodes", "3").fails(2, "nodes")
    loxo("extend", "a.csv", "-o", "x.ply", "--tolerance", "nan").fails(2, "tolerance")
    loxo("extend", "missing.csv", "-o", "x.ply").fails(3, "missing.csv")
    assert files() == before
    loxo("extend", "space.csv", "--points", "50", "-o", "x.csv").is_code(0)
    loxo("extend", "a.csv", "-o", "x.ply", "--points", "100", "--tolerance", "1e-17").is_code(8).has_err("did not end within")


@test
def extend_a_map_of_the_sphere():
    sphere("s.ply", 200)
    octahedron("o.off")
    octahedron("large.off", (2, 2, 2))
    write("at.csv", b"0.1,0.2,-0.3\n0,0,0\n0,0.6,0.8\n")
    write("outside.csv", b"0,0,0\n0.9,0.9,0\n")
    loxo("extend", "s.ply", "--map", "s.ply", "--at", "at.csv", "-o", "out.csv", "--piece", "0.25", "--json",
         "r.json").is_code(0).has_err(r"^points +3, on the sphere 1, resting 0$")
    for row, kind in zip(rows("out.csv"), (0, 0, 1)):
        assert math.dist(row[:3], row[3:6]) < 1e-6 and row[-1] == kind, row
    assert json.loads(read("r.json"))["extension"]["n_nodes"] > 1000
    before = files()
    loxo("extend", "s.ply", "--map", "o.off", "--at", "at.csv", "-o", "x.csv").fails(
        6, r"^o\.off: error: does not have the vertices and faces of the sphere$")
    loxo("extend", "s.ply", "--map", "s.ply", "-o", "x.csv").fails(2, "give points of the ball")
    loxo("extend", "o.off", "--map", "large.off", "--at", "at.csv", "-o", "x.csv").fails(
        6, r"error: extension: the image of vertex 0 is not on the unit sphere within 1e-6$")
    loxo("extend", "s.ply", "--map", "s.ply", "--at", "outside.csv", "-o", "x.csv").fails(
        4, r"^outside\.csv: error: point 1 is not in the unit ball$")
    loxo("extend", "s.ply", "--map", "s.ply", "--at", "at.csv", "-o", "x.ply").fails(5, "values at points go to")
    assert files() == before


@test
def extend_estimates_a_map_of_the_sphere():
    ball = sphere("s.ply", 3000)
    for z in (0.3, 0.99, 0.99999):
        write("at.csv", f"0,0,{z}\n0,{-z},0\n".encode())
        told = loxo("extend", ball, "--map", ball, "--at", "at.csv", "--estimate", "--json", "-").is_code(0).json["estimate"]
        took = loxo("extend", ball, "--map", ball, "--at", "at.csv", "-o", "x.csv", "--json", "-").is_code(0).json["memory"]
        assert took["peak_bytes"] <= told["peak_bytes"] <= 4 * took["peak_bytes"] + 1000000, (z, told, took)


main()
