# SPDX-License-Identifier: MIT
"""The words of the command line: help, options, and what is refused before anything is read."""
import re

from harness import environment, files, loxo, main, octahedron, test, tetrahedron

COMMANDS = ["info", "convert", "generate", "geodesic", "render", "measure", "sphere", "register", "center", "extend"]


@test
def no_command_is_an_error():
    loxo().fails(2, r"^loxo: error: no command; see loxo help$")


@test
def unknown_command_is_an_error():
    loxo("geodesics", "x").fails(2, r"^loxo: error: there is no command 'geodesics' \(did you mean geodesic\?\)$")
    loxo("frobnicate", "x").fails(2, r"^loxo: error: there is no command 'frobnicate'; see loxo help$")
    loxo("help", "nonsense").fails(2, "there is no command 'nonsense'")
    loxo("help", "info", "convert").fails(2, "help takes one command")


@test
def help_lists_every_command_and_exit_code():
    for words in (["help"], ["--help"], ["-h"]):
        r = loxo(*words).is_code(0)
        assert r.err == ""
        for name in COMMANDS:
            r.has_out(rf"^  {name} ")
        for code in range(10):
            r.has_out(rf"(^|\s){code}  \S")


@test
def help_of_each_command_three_ways():
    for name in COMMANDS:
        texts = {loxo(*words).is_code(0).out for words in (["help", name], [name, "--help"], [name, "-h"])}
        assert len(texts) == 1, texts
        text = texts.pop()
        assert text.startswith(f"loxo {name}: "), text
        for part in (f"usage: loxo {name} ", "common to all commands", "--threads N", "--json FILE", "examples\n"):
            assert part in text, (name, part)
        for line in text.splitlines():
            assert len(line) <= 140, line


@test
def no_option_has_two_meanings():
    for name in COMMANDS:
        names = re.findall(r"^  (?:-\w, )?--([a-z-]+)", loxo("help", name).out, re.M)
        assert len(names) == len(set(names)), (name, sorted(n for n in names if names.count(n) > 1))


def defaults_in_help(name):
    """The last [value] of each option's row, which may go on in the next line."""
    found, key = {}, None
    for line in loxo("help", name).out.splitlines():
        m = re.match(r"  --([a-z0-9-]+)", line)
        key = m.group(1) if m else key if line.startswith("   ") else None
        m = re.search(r" \[([^\[\]]*)\]$", line)
        if key and m:
            found[key] = m.group(1)
    return found


@test
def help_says_the_defaults_that_settings_says():
    for name in COMMANDS:
        helped, group, seen = defaults_in_help(name), "", 0
        r = loxo(name, "--settings").is_code(0)
        assert r.err == ""
        for line in r.out.splitlines():
            if line.startswith("["):
                group = line
                continue
            key, value = line.split(" = ")
            seen += 1
            assert key in helped, (name, key)
            # common ones are shown as they turn out on this machine
            assert group == "[common]" or helped[key] == value, (name, key, value, helped[key])
        assert seen == len(helped), (name, sorted(helped))


@test
def settings_show_what_was_asked():
    r = loxo("geodesic", "--settings", "--time-factor", "2.5", "--method=face", "--repair").is_code(0)
    for line in ("time-factor = 2.5", "method = face", "repair = true"):
        assert line in r.out.splitlines(), r
    r = loxo("geodesic", "--settings", "--threads", "1", "--max-memory", "3M", "--isa", "baseline").is_code(0)
    for line in ("threads = 1", "max-memory = 3145728", "isa = baseline"):
        assert line in r.out.splitlines(), r


@test
def settings_for_machines():
    r = loxo("geodesic", "--settings", "--time-factor", "0.1", "--json", "-").is_code(0)
    assert r.json["settings"]["geodesic"]["time-factor"] == 0.1
    assert r.json["settings"]["common"]["settings"] is True


@test
def version():
    assert re.fullmatch(r"loxo \d+\.\d+\.\d+\n", loxo("--version").is_code(0).out)
    r = loxo("--version", "--verbose").is_code(0)
    for feature in ("hwloc", "metis", "openblas", "cholmod", "expat", "zlib", "libpng"):
        r.has_out(rf"^{feature}\b")
    r.has_out(r"^ids (16|32) bits, kernels (baseline|avx2|avx512), threads \d+$")
    r.has_out(r"^machine \(")
    loxo("--version", "--json").fails(2, "--version takes --verbose")


@test
def unknown_options():
    mesh = tetrahedron()
    loxo("info", mesh, "--zzzz").fails(2, r"^loxo: error: info: unknown option --zzzz \(see loxo help info\)$")
    loxo("info", mesh, "--thread=3").fails(2, r"unknown option --thread \(did you mean --threads\?\)")
    loxo("info", mesh, "-x").fails(2, "unknown option -x")
    loxo("info", mesh, "--time-factor", "3").fails(2, "unknown option --time-factor")
    loxo("geodesic", mesh, "--time-factr", "3").fails(2, r"did you mean --time-factor\?")


@test
def names_must_be_written_out():
    mesh = tetrahedron()
    loxo("geodesic", mesh, "--time", "3").fails(2, r"unknown option --time \(did you mean --time-factor\?\)")
    loxo("info", mesh, "--str").fails(2, r"unknown option --str \(did you mean --strict\?\)")
    loxo("info", mesh, "--s").fails(2, "unknown option --s ")


@test
def values_that_are_missing_or_wrong():
    mesh = tetrahedron()
    loxo("geodesic", mesh, "--time-factor").fails(2, "--time-factor needs a value: X")
    loxo("geodesic", mesh, "-o").fails(2, "--output needs a value: FILE")
    loxo("geodesic", mesh, "-s", "0", "-o", "").fails(2, "--output has an empty value")
    loxo("info", mesh, "--json").fails(2, "--json needs a value")
    loxo("info", mesh, "--help=3").fails(2, "--help takes no value")
    for bad in ("1e-3x", "", " 1", "0x10", "nan", "inf", "1,5", "-1", "0"):
        loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", f"--time-factor={bad}").fails(2, "time-factor")
    loxo("geodesic", mesh, "--method", "vertex").fails(2, "--method takes one of edge, face, .*not 'vertex'")
    loxo("info", mesh, "--quiet=perhaps").fails(2, "--quiet takes true or false")
    loxo("info", mesh, "--json", "a", "--json", "b").fails(2, "--json given twice")
    loxo("generate", "grid", "--exact-from", "1").fails(2, "--exact-from needs two values: V FILE")
    assert files() == [mesh]


@test
def threads():
    mesh = tetrahedron()
    for bad in ("-1", "4097", "100000", "2x", "99999999999999999999", "1.5", ""):
        loxo("info", mesh, f"--threads={bad}").fails(2, "threads")
    for good in ("0", "1", "2", "3", "64"):
        loxo("info", mesh, f"--threads={good}", "--quiet").is_code(0)
    assert loxo("info", mesh, "--threads", "3", "--json", "-").json["threads"] == 3


@test
def omp_num_threads():
    mesh = tetrahedron()
    for text in ("garbage", "", "-3", "0", "1e9", "99999999999999999999", "2x", "1,2"):
        r = loxo("info", mesh, "--json", "-", env=environment(OMP_NUM_THREADS=text)).is_code(0)
        assert 1 <= r.json["threads"] <= 4096, r
    assert loxo("info", mesh, "--json", "-", env=environment(OMP_NUM_THREADS="1")).json["threads"] == 1


@test
def instruction_sets():
    mesh = tetrahedron()
    assert loxo("info", mesh, "--isa", "baseline", "--json", "-").is_code(0).json["isa"] == "baseline"
    loxo("info", mesh, "--isa", "sse9").fails(2, "--isa takes one of auto, baseline, avx2, avx512, not 'sse9'")


@test
def memory_sizes():
    mesh = tetrahedron()
    for text, n in (("1G", 1 << 30), ("512M", 1 << 29), ("4194304K", 1 << 32), ("8388608", 1 << 23)):
        assert loxo("info", mesh, "--max-memory", text, "--json", "-").json["memory"]["limit_bytes"] == n
    for bad in ("1X", "-1", "1.5G", "G", "99999999999999999999", "16777216T"):
        loxo("info", mesh, f"--max-memory={bad}").fails(2, "max-memory")


@test
def operands():
    mesh = tetrahedron()
    loxo("info").fails(2, "info: too few operands; usage: loxo info MESH")
    loxo("info", mesh, mesh).fails(2, "info: too many operands")
    loxo("measure", "a.npy").fails(2, "measure: too few operands")
    loxo("convert", mesh).fails(2, "convert: no output; give -o FILE")
    loxo("generate", "grid").fails(2, "generate: no output; give -o FILE")
    loxo("render", mesh).fails(2, "render: no output")
    loxo("geodesic", mesh, "-s", "0").fails(2, "geodesic: no output")


@test
def options_may_stand_behind_operands():
    mesh = tetrahedron()
    a = loxo("info", "--quiet", mesh, "--json", "-").is_code(0)
    b = loxo("info", mesh, "--json=-", "--quiet").is_code(0)
    assert a.json["mesh"] == b.json["mesh"]
    assert a.err == b.err == ""


@test
def after_two_dashes_everything_is_an_operand():
    tetrahedron("--quiet")
    r = loxo("info", "--json", "-", "--", "--quiet").is_code(0)
    assert r.json["input"] == "--quiet" and r.err != ""
    loxo("info", "--", "a", "--json").fails(2, "too many operands")


@test
def an_option_may_have_a_value_that_looks_like_one():
    mesh = tetrahedron()
    loxo("geodesic", mesh, "-s", "-1", "-o", "d.npy").fails(2, r"source -1 is not in 0\.\.3")
    loxo("info", mesh, "--json", "--quiet").is_code(0)
    assert "--quiet" in files()


@test
def output_formats():
    mesh = tetrahedron()
    loxo("convert", mesh, "-o", "x.xyz").fails(2, "x.xyz: the suffix names no format; one of .ply")
    loxo("convert", mesh, "-o", "x.ply.gz").fails(2, "x.ply.gz: gzip is read, not written; pipe -o - into gzip")
    loxo("convert", mesh, "-o", "x.npy").fails(5, ".npy cannot be written here")
    loxo("convert", mesh, "-o", "x.stl").fails(5, ".stl cannot be written here")
    loxo("convert", mesh, "-o", "-").fails(2, "standard output needs --format")
    loxo("convert", mesh, "-o", "x.ply", "--format", "xyz").fails(2, "--format xyz is not known")
    loxo("geodesic", mesh, "-s", "0", "-o", "d").fails(2, "d: the suffix names no format")
    assert files() == [mesh]


@test
def one_file_is_not_written_twice():
    mesh = tetrahedron()
    loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", "-o", "d.npy").fails(2, "d.npy would be written twice")
    loxo("geodesic", mesh, "-s", "0", "-o", "d.npy", "-o", "./d.npy").fails(2, "would be written twice")
    loxo("geodesic", mesh, "-s", "0", "-o", "d.csv", "--json", "d.csv").fails(2, "would be written twice")
    loxo("geodesic", mesh, "-s", "0", "-o", "-", "--format", "csv", "--json", "-").fails(
        2, "standard output would be written twice")
    assert files() == [mesh]


@test
def sources_are_checked_before_the_mesh_is_read():
    loxo("geodesic", "missing.ply", "-o", "d.npy").fails(2, "no source; give -s, --sources, --source-point or")
    for bad in ("", "x", "1x", "1,,2", ",", "1,", "1 2", "0x1", "1.0", "99999999999999999999"):
        loxo("geodesic", "missing.ply", f"--source={bad}", "-o", "d.npy").fails(2, "-s takes vertex numbers|empty")
    for bad in ("1,2", "1,2,3,4", "a,b,c", "1,2,nan", "1;2;3", "1, 2, 3"):
        loxo("geodesic", "missing.ply", "--source-point", bad, "-o", "d.npy").fails(2, "--source-point takes x,y,z")


@test
def shapes_and_their_params():
    loxo("generate", "cube", "-o", "x.ply").fails(2, "there is no shape 'cube'; one of icosphere ")
    loxo("generate", "torus", "--params", "1,x", "-o", "x.ply").fails(2, "--params takes up to four numbers")
    loxo("generate", "torus", "--params", "1,2,3,4,5", "-o", "x.ply").fails(2, "--params takes up to four numbers")
    loxo("generate", "torus", "--vertices", "0", "-o", "x.ply").fails(2, "vertices")
    assert files() == []


@test
def control_bytes_do_not_reach_the_terminal():
    name = "a\nb\x1b[31m.ply"
    loxo("info", name).fails(3, r"a\\x0ab\\x1b\[31m\.ply")
    loxo("info", "x.ply", "--\x1b]0;x").fails(2, r"\\x1b")
    octahedron("o\x07.off")
    r = loxo("info", "o\x07.off").is_code(0)
    assert "\x07" not in r.err, r


@test
def quiet_and_verbose():
    mesh = tetrahedron()
    assert loxo("info", mesh, "--quiet").is_code(0).err == ""
    r = loxo("info", mesh).is_code(0)
    assert r.out == ""
    r.has_err(r"^input +tetrahedron\.off  4 vertices, 4 faces")
    loxo("info", mesh, "--verbose").is_code(0)


@test
def no_bar_where_there_is_no_terminal():
    assert "\r" not in loxo("info", tetrahedron()).err


main()
