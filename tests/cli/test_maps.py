# SPDX-License-Identifier: MIT
"""Maps to the sphere and their Moebius centring."""
import json
import math

from harness import files, loxo, main, off, read, sphere, test, write


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


main()
