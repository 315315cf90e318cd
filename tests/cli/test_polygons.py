# SPDX-License-Identifier: MIT
"""Barycenters of points, polygons closed and drawn at random."""
import json
import math
import struct

from harness import files, loxo, main, read, test, write

SQUARE = "0,0\n3,0\n3,2\n1,2\n1,1\n"


def npy(path, shape, numbers):
    text = "{'descr': '<f8', 'fortran_order': False, 'shape': (%s), }" % ", ".join(map(str, shape))
    head = text.ljust(117).encode() + b"\n"
    write(path, b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head + struct.pack("<%dd" % len(numbers), *numbers))
    return path


def numbers(path):
    """Shape and numbers of a .npy of doubles."""
    data = read(path)
    size = 10 + struct.unpack("<H", data[8:10])[0]
    shape = data[10:size].decode().split("'shape': (")[1].split(")")[0]
    body = data[size:]
    return [int(x) for x in shape.split(",") if x.strip()], list(struct.unpack("<%dd" % (len(body) // 8), body))


def rows(path):
    return [[float(x) for x in line.split(",")] for line in read(path).decode().splitlines()]


def lengths(points):
    return [math.dist(a, b) for a, b in zip(points, points[1:])]


@test
def close_keeps_lengths():
    write("open.csv", SQUARE.encode())
    r = loxo("polygon", "close", "open.csv", "-o", "closed.csv", "--json", "r.json").is_code(0)
    r.has_err(r"^polygons +1 of 4 edges in 2 dimensions").has_err(r"^closed +1, gap at most ")
    closed = rows("closed.csv")
    assert len(closed) == 4 and closed[0] == [0, 0], closed
    for a, b in zip(lengths(closed + closed[:1]), (3, 2, 2, 1)):
        assert abs(a - b) < 2e-15, closed
    told = json.loads(read("r.json"))["polygons"]
    assert told["closed"] == 1 and told["first_failed"] == -1 and told["gap_max"] < 1e-15, told
    # edges in, edges out; blanks, a header
    write("edges.txt", b"x y\n3 0\n0 2\n-2 0\n0 -1\n")
    loxo("polygon", "close", "edges.txt", "--given-edges", "--edges", "-o", "edges.csv").is_code(0)
    edges = rows("edges.csv")
    for e, a, b in zip(edges, closed, closed[1:] + closed[:1]):
        assert math.dist(e, [q - p for p, q in zip(a, b)]) < 4e-15, (edges, closed)
    # through a pipe
    assert loxo("polygon", "close", "-", "-o", "-", "--quiet", stdin=SQUARE.encode()).is_code(0).out == read("closed.csv").decode()


@test
def close_a_batch():
    one = [0, 0, 3, 0, 3, 2, 1, 2, 1, 1]
    long = [0, 0, 9, 0, 9, 1, 8, 1, 8, 2]
    npy("batch.npy", (3, 5, 2), one + long + one)
    r = loxo("polygon", "close", "batch.npy", "-o", "closed.npy", "--json", "-").is_code(8)
    r.has_err(r"^batch\.npy: warning: 1 polygons cannot be closed: .* \(first: 1\)$")
    assert r.json["polygons"]["cannot"] == 1 and r.json["polygons"]["closed"] == 2, r.json
    shape, out = numbers("closed.npy")
    assert shape == [3, 4, 2] and out[:8] == out[16:], (shape, out)
    assert all(abs(a - b) < 1e-14 for a, b in zip(out[8:16], long)), out
    npy("single.npy", (5, 2), one)
    loxo("polygon", "close", "single.npy", "-o", "single_out.npy").is_code(0)
    assert numbers("single_out.npy") == ([4, 2], out[:8])


@test
def a_picture_of_both():
    write("open.csv", SQUARE.encode())
    loxo("polygon", "close", "open.csv", "-o", "c.csv", "--picture", "p.png").is_code(0)
    assert read("p.png")[:8] == b"\x89PNG\r\n\x1a\n"


@test
def sample_is_a_stream():
    loxo("polygon", "sample", "--sides", "9", "-n", "20", "-o", "all.npy", "--weights", "w.npy").is_code(0)
    loxo("polygon", "sample", "--sides", "9", "-n", "5", "--first", "15", "-o", "end.npy", "--weights", "v.npy",
         "--threads", "3").is_code(0)
    (shape, every), (_, end) = numbers("all.npy"), numbers("end.npy")
    assert shape == [20, 9, 3] and every[15 * 27:] == end
    assert numbers("w.npy")[1][15:] == numbers("v.npy")[1] and numbers("w.npy")[0] == [20]
    r = loxo("polygon", "sample", "--sides", "9", "-n", "20", "--seed", "2", "--json", "-", "--quiet").is_code(0)
    assert 0.5 < r.json["sampling"]["effective_share"] <= 1, r.json
    write("l.csv", b"1\n2\n1.5\n2\n")
    loxo("polygon", "sample", "--lengths", "l.csv", "--dimension", "2", "-o", "q.csv").is_code(0)
    q = rows("q.csv")
    for a, b in zip(lengths(q + q[:1]), (1, 2, 1.5, 2)):
        assert abs(a - b) < 4e-15, q


@test
def barycenter_of_a_triangle():
    write("t.csv", b"1,0\n0,1\n-1,0\n")
    r = loxo("barycenter", "t.csv", "-o", "c.csv", "--json", "r.json").is_code(0)
    r.has_err(r"^barycenter +\S+ 0\.267949 1 - \|w\| 0\.7321, stable$").has_err(r"^certified +within [0-9.e-]+; least eigenvalue 0\.5,")
    told = json.loads(read("r.json"))["barycenter"]
    assert abs(told["w"][1] - (2 - math.sqrt(3))) < 1e-15 and told["bound"] < 1e-13 and told["class"] == "stable", told
    assert abs(sum(x for x, _ in rows("c.csv"))) < 1e-15 and abs(sum(y for _, y in rows("c.csv"))) < 1e-15
    write("w.csv", b"1\n1\n1\n")
    assert loxo("barycenter", "t.csv", "--weights", "w.csv", "--json", "-", "--quiet").is_code(0).json["barycenter"]["w"] == told["w"]
    # none, and many
    write("w.csv", b"5\n1\n1\n")
    r = loxo("barycenter", "t.csv", "--weights", "w.csv", "--json", "-").is_code(8)
    assert r.json["barycenter"]["w"] == [1, 0] and r.json["barycenter"]["class"] == "none", r.json
    write("two.csv", b"1,0\n-1,0\n")
    r = loxo("barycenter", "two.csv", "--json", "-").is_code(8)
    assert r.json["barycenter"]["class"] == "not unique" and r.json["barycenter"]["ends"] == [[1, 0], [-1, 0]], r.json


@test
def what_does_not_fit_is_said():
    write("open.csv", SQUARE.encode())
    write("t.csv", b"1,0\n0,1\n-1,0\n")
    write("bad.csv", b"1,0\n0,1,2\n")
    write("off.csv", b"1,0\n0,1.1\n-1,0\n")
    write("w.csv", b"1\n2\n")
    npy("deep.npy", (1, 1, 1, 2), [0, 0])
    npy("flat.npy", (4,), [0, 0, 1, 1])
    write("nan.csv", b"0,0\n1,nan\n2,2\n")
    npy("nan.npy", (3, 2), [0, 0, 1, math.nan, 2, 2])
    write("l.csv", b"1\n-2\n1.5\n")
    write("zero.csv", b"0\n0\n0\n")
    before = files()
    loxo("polygon", "open", "open.csv").fails(2, "polygon: close or sample, not 'open'")
    loxo("polygon", "close", "-o", "x.csv").fails(2, "close takes a file")
    loxo("polygon", "sample", "open.csv", "-o", "x.csv").fails(2, "sample takes no file")
    loxo("polygon", "close", "open.csv").fails(2, "polygon: no output")
    loxo("polygon", "close", "open.csv", "-o", "x.csv", "--sides", "4").fails(2, "--sides is not of close")
    loxo("polygon", "close", "open.csv", "-o", "x.csv", "--seed", "4").fails(2, "--seed is not of close")
    loxo("polygon", "sample", "--sides", "4", "-o", "x.csv", "--given-edges").fails(2, "--given-edges is not of sample")
    loxo("polygon", "sample", "-o", "x.csv").fails(2, "either --sides N or --lengths FILE")
    loxo("polygon", "sample", "--sides", "2", "-o", "x.csv").fails(2, "--sides takes a whole number from 3")
    loxo("polygon", "sample", "--sides", "4x", "-o", "x.csv").fails(2, "--sides takes a whole number")
    loxo("polygon", "sample", "--lengths", "w.csv", "-o", "x.csv").fails(4, r"^w\.csv: error: .*(at least|no polygon closes)")
    loxo("polygon", "sample", "--lengths", "l.csv", "-o", "x.csv").fails(4, r"^l\.csv: error: .*length 1 is -2")
    loxo("polygon", "close", "nan.npy", "-o", "x.csv").fails(4, r"^nan\.npy: error: row 1 is not finite$")
    loxo("polygon", "close", "bad.csv", "-o", "x.csv").fails(4, r"^bad\.csv:2: error: row 1: more than 2 values")
    loxo("polygon", "close", "deep.npy", "-o", "x.csv").fails(5, r"^deep\.npy: byte 10: error: .*not of one to three dimensions")
    loxo("polygon", "close", "flat.npy", "-o", "x.csv").fails(5, r"^flat\.npy: error: not rows of 2 to 64 coordinates")
    loxo("polygon", "close", "none.csv", "-o", "x.csv").fails(3, "none.csv")
    loxo("polygon", "close", "open.csv", "-o", "x.ply").fails(5, "x.ply")
    loxo("barycenter", "off.csv").fails(4, r"^off\.csv: error: atom 1 is not a point of the sphere")
    loxo("barycenter", "t.csv", "--weights", "l.csv").fails(4, r"^l\.csv: error: the weight of atom 1 is -2$")
    loxo("barycenter", "t.csv", "--weights", "zero.csv").fails(4, r"^zero\.csv: error: .* weights add up to 0")
    loxo("barycenter", "t.csv", "--weights", "w.csv").fails(2, r"^w\.csv: error: holds 2 weights, there are 3 points$")
    loxo("barycenter", "flat.npy").fails(5, "flat.npy")
    loxo("barycenter", "t.csv", "--tolerance", "-1").fails(2, "tolerance")
    loxo("polygon", "close", "nan.csv", "-o", "x.csv").fails(4, r'^nan\.csv:2: error: row 1: "nan" is not a number$')
    assert files() == before
    write("none.csv", b"0,0\n0,0\n0,0\n")
    r = loxo("polygon", "close", "none.csv", "-o", "x.csv").is_code(8).has_err("1 polygons have .* no length")
    assert rows("x.csv") == [[0, 0], [0, 0]], r


@test
def estimates_are_above_what_runs_take():
    n = 4000
    points = [math.cos(i) * (1, 0)[k] + math.sin(i) * (0, 1)[k] for i in range(n) for k in range(2)]
    npy("points.npy", (n, 2), points)
    npy("batch.npy", (10, n // 10, 2), points)
    write("points.csv", "".join(f"{points[2 * i]!r},{points[2 * i + 1]!r}\n" for i in range(n)).encode())
    for command in (["barycenter", "points.npy"], ["barycenter", "points.csv"], ["polygon", "close", "batch.npy"],
                    ["polygon", "close", "points.csv"], ["polygon", "sample", "--sides", "100", "-n", "500"]):
        out = [] if command[0] == "barycenter" else ["-o", "x.npy"]
        told = loxo(*command, "--estimate", "--json", "-").is_code(0).json["estimate"]
        took = loxo(*command, *out, "--json", "-").is_code(0).json["memory"]["peak_bytes"]
        assert took <= told["peak_bytes"] <= 4 * took + 1000000, (command, told, took)


main()
