# SPDX-License-Identifier: MIT
"""Registration of one surface onto another by landmarks."""
import json
import math

from harness import files, fitting, has_feature, loxo, main, off, read, test, write

N = fitting(1500)


def vertices(path):
    """Of an OFF file."""
    lines = [line for line in read(path).decode().splitlines() if line and not line.startswith("#")]
    n = int(lines[1].split()[0])
    return [tuple(float(x) for x in line.split()) for line in lines[2:2 + n]]


def surfaces():
    """A folded sphere, and the same turned and stretched."""
    loxo("generate", "brain", "--params", "0.1,3", "--vertices", str(N), "-o", "fixed.off", "--quiet").is_code(0)
    text = read("fixed.off").decode().splitlines()
    points = vertices("fixed.off")
    first = next(i for i, line in enumerate(text) if len(line.split()) == 3 and "." in line)
    for name, stretch in (("turned.off", 1.0), ("moving.off", 1.25)):
        rows = ["%.17g %.17g %.17g" % (-y * stretch, x, z + (stretch - 1) * x * y) for x, y, z in points]
        write(name, ("\n".join(text[:first] + rows + text[first + len(rows):]) + "\n").encode())
    return points


def landmarks(points):
    """Vertices nearest to eight points of two circles, as curves, and one more."""
    def nearest(q):
        return max(range(len(points)), key=lambda v: sum(a * b for a, b in zip(points[v], q)) / math.hypot(*points[v]))
    rows = ["p,0"]
    for i in range(8):
        rows.append("a,%d" % nearest((0.5 * math.cos(0.5 * i), 0.5 * math.sin(0.5 * i), 0.87)))
    for i in range(8):
        rows.append("b,%d" % nearest((0.87, 0.5 * math.cos(0.5 * i), 0.5 * math.sin(0.5 * i))))
    write("landmarks.csv", ("\n".join(rows) + "\n").encode())


@test
def a_turned_surface_comes_back():
    points = surfaces()
    landmarks(points)
    write("field.csv", ("vertex,x\n" + "".join("%d,%.17g\n" % (i, p[0]) for i, p in enumerate(points))).encode())
    r = loxo("register", "fixed.off", "turned.off", "--landmarks", "landmarks.csv", "-o", "out.off", "--sphere", "s.off",
             "--fixed-sphere", "f.off", "--field", "field.csv", "--field-output", "x.csv", "--truth", "--json", "r.json")
    r.is_code(0).has_err(r"^landmarks +17 points on 3 curves in fixed\.off$")
    r.has_err(r"^registered +energy \S+, registration loss \S+, [0-9]+ steps \(tolerance\), residual ")
    r.has_err(r"^check +0 folds, degree 1; landmarks within 0\.0000 ")
    r.has_err(r"^truth +vertices are off by \S+ at the median, ")
    report = json.loads(read("r.json"))
    assert report["registration"]["n_landmarks"] == 17 and report["registration"]["n_outside"] == 0, report
    assert report["truth"]["max"] < 1e-4, report["truth"]
    assert max(math.dist(p, q) for p, q in zip(points, vertices("out.off"))) < 1e-4
    assert max(math.dist(p, q) for p, q in zip(vertices("s.off"), vertices("f.off"))) < 1e-4
    values = [float(line.split(",")[1]) for line in read("x.csv").decode().splitlines()[1:]]
    assert max(abs(x - p[0]) for x, p in zip(values, points)) < 1e-4


@test
def lambda_brings_landmarks_nearer():
    landmarks(surfaces())
    loss = []
    for weight in ("0", "1", "10"):
        r = loxo("register", "fixed.off", "moving.off", "--landmarks", "landmarks.csv", "--lambda", weight, "--json", "-")
        report = r.is_code(0).json["registration"]
        assert report["n_folds"] == 0 and report["degree"] == 1, report
        loss.append(report["loss"])
    assert loss[2] < loss[1] < loss[0], loss
    # landmarks of each surface, one of them by position and in another order: the same curves
    points = vertices("moving.off")
    rows = [line.split(",") for line in read("landmarks.csv").decode().split()]
    write("m.csv", ("name,x,y,z\n" + "".join("%s,%.17g,%.17g,%.17g\n" % ((name,) + points[int(v)])
                                              for name, v in rows[9:] + rows[:9])).encode())
    r = loxo("register", "fixed.off", "moving.off", "--fixed-landmarks", "landmarks.csv", "--moving-landmarks", "m.csv",
             "--lambda", "10", "--json", "-").is_code(0)
    assert math.isclose(r.json["registration"]["loss"], loss[2], rel_tol=1e-6), (r.json, loss)
    r = loxo("register", "fixed.off", "moving.off", "--landmarks", "landmarks.csv", "--samples", "30", "--json", "-")
    assert r.is_code(0).json["registration"]["n_landmarks"] == 61, r
    if has_feature("libpng"):
        loxo("register", "fixed.off", "moving.off", "--landmarks", "landmarks.csv", "--picture", "p.png").is_code(0)
        assert read("p.png").startswith(b"\x89PNG")


@test
def what_does_not_fit_is_told():
    landmarks(surfaces())
    small = off("small.off", [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)])
    opened = off("open.off", [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
    write("corner.csv", b"p,0\n")
    write("far.csv", b"p,0\na,99999\n")
    write("short.csv", b"1\n2\n")
    write("other.csv", b"q,0\n")
    both = ("--landmarks", "landmarks.csv")
    before = files()
    loxo("register", "fixed.off", "moving.off", "-o", "x.ply").fails(2, "no landmarks")
    loxo("register", "fixed.off", "moving.off", "--fixed-landmarks", "landmarks.csv", "-o", "x.ply").fails(2, "no landmarks")
    loxo("register", "fixed.off", "moving.off", *both).fails(2, "no output")
    loxo("register", "fixed.off", "moving.off", *both, "--field-output", "x.npy").fails(2, "without --field")
    loxo("register", "fixed.off", "moving.off", *both, "-o", "x.npy").fails(5, r"x\.npy|npy")
    loxo("register", "fixed.off", "moving.off", *both, "-o", "x.ply", "--lambda", "-1").fails(2, "lambda")
    loxo("register", "fixed.off", "none.off", *both, "-o", "x.ply").fails(3, "none.off")
    loxo("register", "fixed.off", "moving.off", "--landmarks", "far.csv", "-o", "x.ply").fails(
        4, r'^far\.csv:2: error: "99999" is no vertex of the mesh$')
    loxo("register", "fixed.off", "moving.off", "--fixed-landmarks", "landmarks.csv", "--moving-landmarks", "other.csv",
         "-o", "x.ply").fails(2, "no landmark of the moving surface has the name")
    loxo("register", "fixed.off", "moving.off", *both, "--field", "short.csv", "--field-output", "x.npy").fails(
        4, r"^short\.csv: error: 2 values, the moving surface has [0-9]+ vertices$")
    loxo("register", "fixed.off", small, "--landmarks", "corner.csv", "-o", "x.ply", "--truth").fails(
        6, "--truth takes two surfaces of one triangulation")
    loxo("register", "fixed.off", opened, "--landmarks", "corner.csv", "-o", "x.ply").fails(6, "open")
    assert files() == before


main()
