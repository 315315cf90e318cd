# SPDX-License-Identifier: MIT
"""Measures of maps to the sphere: rows, report, fields, pictures, and what is no map."""
import json
import math
import os
import struct

from harness import (SHARED, files, fitting, has_feature, loxo, main, moebius, needs_big_ids, octahedron, off, read, sphere,
                     test, tetrahedron, three_at_an_edge, write)


def vertices(path):
    """Of an OFF file."""
    lines = [line for line in read(path).decode().splitlines() if line and not line.startswith("#")]
    n = int(lines[1].split()[0])
    return [tuple(float(x) for x in line.split()) for line in lines[2:2 + n]]


def table(path, rows):
    """Points as .npy."""
    header = f"{{'descr': '<f8', 'fortran_order': False, 'shape': ({len(rows)}, 3), }}".encode()
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    return write(path, b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header +
                 b"".join(struct.pack("<3d", *row) for row in rows))


@test
def a_sphere_to_itself():
    ball = sphere("s.ply", 2500)
    r = loxo("measure", ball, "--sphere", ball, "--json", "r.json").is_code(0)
    r.has_err(r"^map +degree 1, 0 folds; 0 faces without area, 0 images$")
    r.has_err(r"^energy +E_C [0-9.]+e-[0-9]+ \(3\.3\), image area 12\.5")
    r.has_err(r"^centred +E_C ")
    report = json.loads(read("r.json"))
    m = report["map"]
    assert m["degree"] == 1 and m["n_folds"] == m["n_flat"] == m["n_image_flat"] == 0, m
    assert m["angle_error_deg"]["max"] == 0 and m["beltrami"]["max"] < 1e-14 and 0 <= m["energy"] < 1e-25, m
    assert m["angle_error_deg"]["n"] == 3 * m["n_faces"] and abs(m["image_area"] - m["area"]) < 1e-12, m
    assert report["centred"]["energy"] < 1e-12 and report["center"]["class"] == "stable", report
    assert {"read", "read_map", "measure"} <= set(report["seconds"]), report["seconds"]


@test
def an_ellipsoid_and_its_fields():
    n = fitting(2500)
    ball = sphere("s.off", n)
    loxo("generate", "ellipsoid", "--vertices", n, "-o", "e.ply").is_code(0)
    wanted = ["-o", "f.ply"]
    if has_feature("libpng (pictures)"):
        wanted += ["--picture", "p.png", "--histogram", "h.png"]
    for name, more in (("one", ["--threads", "1", "--isa", "baseline"]), ("many", ["--threads", "7"])):
        loxo("measure", "e.ply", "--sphere", ball, "--json", f"{name}.json", *wanted, *more).is_code(0)
    one, many = (json.loads(read(f"{name}.json")) for name in ("one", "many"))
    assert one["map"] == many["map"] and one["centred"] == many["centred"]
    m = one["map"]
    assert m["energy"] > 0.1 and m["energy_signed"] == m["energy"] and m["dirichlet"] > m["energy"], m
    assert math.isclose(m["dirichlet"] - m["image_area"], m["energy"], rel_tol=1e-9), m
    e = m["angle_error_deg"]
    assert 0 < e["median"] < e["mean"] < e["percentile_75"] < e["percentile_95"] < e["percentile_99"] < e["max"] < 90, e
    head = read("f.ply").split(b"end_header")[0].decode()
    for name in ("angle_error", "beltrami", "curvature"):
        assert f"property double {name}" in head, head
    loxo("convert", "f.ply", "-o", "f.off").is_code(0)
    if has_feature("libpng (pictures)"):
        assert read("p.png")[:4] == read("h.png")[:4] == b"\x89PNG"
        loxo("measure", "e.ply", "--sphere", ball, "--picture", "mu.png", "--field", "beltrami", "--width", "400",
             "--height", "200").is_code(0)
        assert struct.unpack(">II", read("mu.png")[16:24]) == (400, 200)
        loxo("measure", "e.ply", "--sphere", ball, "--picture", "k.png", "--field", "curvature").is_code(0)


@test
def maps_of_all_kinds_and_sizes():
    surface = octahedron("o.off")
    points = vertices(surface)
    first = loxo("measure", surface, "--sphere", surface, "--json", "-").is_code(0).json["map"]
    table("m.npy", points)
    write("m.csv", "x,y,z\n" + "".join(f"{x},{y},{z}\n" for x, y, z in points))
    for path in ("m.npy", "m.csv"):
        assert loxo("measure", surface, "--sphere", path, "--json", "-").is_code(0).json["map"] == first
    table("far.npy", [[100 * x for x in p] for p in points])
    loxo("measure", surface, "--sphere", "far.npy").fails(
        6, r"^o\.off: error: measure: the image of vertex 0 is not on the unit sphere within 1e-05$")
    assert loxo("measure", surface, "--sphere", "far.npy", "--normalize", "--json", "-").is_code(0).json["map"] == first
    table("zero.npy", [(0, 0, 0)] + points[1:])
    loxo("measure", surface, "--sphere", "zero.npy", "--normalize").fails(6, r"^zero\.npy: error: vertex 0 has no direction$")
    # turned inside out
    table("mirror.npy", [(x, y, -z) for x, y, z in points])
    m = loxo("measure", surface, "--sphere", "mirror.npy", "--json", "-").is_code(0).json["map"]
    assert m["degree"] == -1 and m["n_folds"] == 8 and m["energy"] < 1e-25, m
    assert math.isclose(m["energy_signed"], 2 * m["image_area"], rel_tol=1e-12), m


@test
def odd_faces_are_mended_as_solvers_do():
    v = vertices(octahedron("o.off"))
    f = [(4, 0, 2), (4, 2, 1), (4, 1, 3), (4, 3, 0), (5, 2, 0), (5, 1, 2), (5, 3, 1), (5, 0, 3)]
    off("turned.off", v, [(4, 2, 0)] + f[1:] + [(1, 1, 2)])
    r = loxo("measure", "turned.off", "--sphere", "o.off", "--json", "r.json").is_code(0)
    r.has_err(r"turned\.off: warning: 1 .*degenerate")
    r.has_err(r"turned\.off: warning: 1 .*turned")
    r.has_err(r"warning: the map has 8 faces, the surface 9: is this a map of it\?$")
    m = json.loads(read("r.json"))["map"]
    assert m["n_faces"] == 8 and m["degree"] == 1 and m["n_folds"] == 0, m


@test
def what_does_not_fit():
    octahedron("o.off")
    tetrahedron("t.off")
    off("open.off", vertices("o.off"), [(4, 0, 2), (4, 2, 1), (4, 1, 3), (4, 3, 0)])
    three_at_an_edge("book.off")
    moebius("strip.off")
    off("flat.off", [(0, 0, 0)] * 6, [(4, 0, 2), (4, 2, 1), (4, 1, 3), (4, 3, 0), (5, 2, 0), (5, 1, 2), (5, 3, 1), (5, 0, 3)])
    write("points.csv", "1,0,0\n")
    before = files()
    loxo("measure", "o.off", "--sphere", "t.off").fails(6, r"^t\.off: error: has 4 vertices, the surface 6$")
    loxo("measure", "o.off", "--sphere", "points.csv").fails(6, r"^points\.csv: error: has 1 vertices, the surface 6$")
    loxo("measure", "open.off", "--sphere", "o.off", "-o", "x.ply").is_code(6).has_err(
        r"^open\.off: error: measure: the surface is open: 4 boundary edges, Euler characteristic 1$")
    loxo("measure", "strip.off", "--sphere", "strip.off", "--normalize").is_code(6).has_err("error: ")
    loxo("measure", "flat.off", "--sphere", "o.off").is_code(6).has_err("measure: the surface has no area")
    loxo("measure", "book.off", "--sphere", "book.off", "--normalize").is_code(6).has_err("error: ")
    loxo("measure", "o.off", "--sphere", "none.off").fails(3, "none.off")
    loxo("measure", "none.off", "--sphere", "o.off").fails(3, "none.off")
    loxo("measure", "o.off", "o.off", "--sphere", "o.off").fails(2, "with --sphere there is one operand")
    loxo("measure", "o.off").fails(2, "measure: too few operands: DISTANCES REFERENCE, or SURFACE --sphere MAP")
    loxo("measure", "a.npy", "b.npy", "--picture", "x.png").fails(2, "measure: --picture is of maps")
    loxo("measure", "-", "--sphere", "-").fails(2, "standard input can be read only once")
    loxo("measure", "o.off", "--sphere", "o.off", "-o", "x.xyz").fails(2, "the suffix names no format")
    loxo("measure", "o.off", "--sphere", "o.off", "-o", "x.npy").fails(5, "cannot be written here")
    loxo("measure", "o.off", "--sphere", "o.off", "-o", "x.ply", "--histogram", "x.ply").fails(2, "x.ply")
    assert files() == before
    loxo("measure", "o.off", "--sphere", "o.off", "--field", "beltrami").is_code(0).has_err("warning: .*field")
    loxo("measure", "o.off", "--sphere", "o.off", "--histogram", "h.png", "--estimate").is_code(0).has_out(r"^peak_bytes ")


@test
def a_map_without_a_centre():
    octahedron("o.off")
    table("fallen.npy", [(0, 0, 1)] * 5 + [(0, 0, -1)])
    r = loxo("measure", "o.off", "--sphere", "fallen.npy", "--json", "r.json").is_code(0)
    r.has_err(r"warning: the map has no centre: half of the area or more stands at one point of the sphere$")
    report = json.loads(read("r.json"))
    assert "centred" not in report and report["map"]["n_folds"] == 8 and report["map"]["degree"] == 0, report
    assert report["map"]["area_log"]["mean"] is None


@test
def a_real_mesh_where_it_is():
    path = os.path.join(SHARED, "meshes", "surfaces", "fandisk.obj.gz")
    if not os.path.isfile(path):
        return  # the folder is no part of the project
    needs_big_ids()
    loxo("sphere", path, "-o", "s.ply").is_code(0)
    m = loxo("measure", path, "--sphere", "s.ply", "--json", "-").is_code(0).json["centred"]
    # What a public program for the method of [48] of the paper has, centred: 1.372e-2, 0.931 and 1.714 degrees.
    assert m["energy"] < 1.372e-2 and m["n_folds"] == 0, m
    assert abs(m["angle_error_deg"]["median"] - 0.931) < 0.005, m
    assert abs(m["angle_error_deg"]["percentile_75"] - 1.714) < 0.01, m


main()
