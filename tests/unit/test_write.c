/* SPDX-License-Identifier: MIT
 * Writers: bytes as the formats have them, and atomicity. Round trips stand in test_roundtrip.c. */
#define _DEFAULT_SOURCE
#include "test.h"

#include <loxo/io.h>

#include <signal.h>
#include <sys/resource.h>

/* A tetrahedron; the arrays are static: nobody frees them. */
static double position[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0.1, 1e-3};
static float position_float[12] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0.1f, 1e-3f};
static loxo_index triangle[12] = {0, 2, 1, 0, 1, 3, 1, 2, 3, 2, 0, 3};
static double heat[4] = {0.0, 1.0, 0.1, (double)INFINITY};
static double other[4] = {1, 2, 3, 4};
static loxo_field fields[2] = {{"heat", heat}, {"a <b>", other}};

static loxo_soup soup_of(int n_fields, bool is_float)
{
    return (loxo_soup){.n_vertices = 4,
                       .n_faces = 4,
                       .position = is_float ? NULL : position,
                       .position_float = is_float ? position_float : NULL,
                       .triangle = triangle,
                       .n_fields = n_fields,
                       .fields = fields};
}

/* All of a file, with a zero behind it. */
static char file_bytes[1 << 16];
static size_t load(const char *path)
{
    FILE *file = fopen(path, "rb");
    CHECK(file != NULL);
    const size_t n = fread(file_bytes, 1, sizeof file_bytes - 1, file);
    fclose(file);
    file_bytes[n] = '\0';
    return n;
}

static const char *write_mesh(const char *name, const loxo_soup *soup)
{
    loxo_write_settings settings = loxo_write_settings_default();
    const char *path = test_scratch(name);
    settings.comment = "made --by\na test & \"more\"";
    CHECK_OK(loxo_write_mesh(test_context, path, soup, &settings));
    return path;
}

TEST(ply_is_binary_with_fields_as_properties)
{
    const char header[] =
        "ply\nformat binary_little_endian 1.0\ncomment made --by a test & \"more\"\nelement vertex 4\n"
        "property double x\nproperty double y\nproperty double z\nproperty double heat\n"
        "property double a_<b>\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n";
    loxo_soup soup = soup_of(2, false);
    const size_t n = load(write_mesh("a.ply", &soup)), n_header = sizeof header - 1;
    double value;
    int32_t id;
    CHECK(memcmp(file_bytes, header, n_header) == 0);
    CHECK_EQUAL(n, n_header + 4 * 5 * 8 + 4 * 13);
    memcpy(&value, file_bytes + n_header + (size_t)3 * 40 + 8, 8);
    CHECK_EQUAL(value, 0.1);
    memcpy(&value, file_bytes + n_header + (size_t)2 * 40 + 24, 8);
    CHECK_EQUAL(value, 0.1);
    memcpy(&id, file_bytes + n_header + 160 + 13 + 1 + 8, 4);
    CHECK_EQUAL(id, 3);

    soup = soup_of(0, true);
    load(write_mesh("b.ply", &soup));
    CHECK(strstr(file_bytes, "property float x\nproperty float y\nproperty float z\nelement face") != NULL);
}

TEST(ply_refuses_two_properties_of_one_name)
{
    loxo_soup soup = soup_of(2, false);
    loxo_field twice[2] = {{"a b", heat}, {"a_b", other}}, taken[2] = {{"x", heat}, {"y", heat}};
    soup.fields = twice;
    CHECK_STATUS(test_context, loxo_write_mesh(test_context, test_scratch("twice.ply"), &soup, NULL),
                 LOXO_ERR_ARGUMENT);
    soup.fields = taken;
    CHECK_STATUS(test_context, loxo_write_mesh(test_context, test_scratch("twice.ply"), &soup, NULL),
                 LOXO_ERR_ARGUMENT);
    CHECK(access(test_scratch("twice.ply"), F_OK) != 0);
}

TEST(obj_and_off_are_text_of_shortest_numbers)
{
    loxo_soup soup = soup_of(1, true);
    load(write_mesh("a.obj", &soup));
    CHECK_TEXT(file_bytes, "# made --by a test & \"more\"\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0.1 0.001\nf 1 3 2\nf 1 2 4\n"
                           "f 2 3 4\nf 3 1 4\n");
    CHECK_EQUAL(loxo_context_n_warnings(test_context), 1);
    CHECK_TEXT(loxo_context_warning(test_context, 0)->text, "1 fields were not written: OBJ holds none");
    soup = soup_of(0, false);
    load(write_mesh("a.OFF", &soup));
    CHECK_TEXT(file_bytes,
               "OFF\n# made --by a test & \"more\"\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0.1 0.001\n3 0 2 1\n3 0 1 3\n"
               "3 1 2 3\n3 2 0 3\n");
}

/* The value of attribute=" behind `from`. */
static int64_t attribute(const char *from, const char *name)
{
    const char *found = strstr(from, name);
    CHECK(found != NULL);
    return strtoll(found + strlen(name), NULL, 10);
}

TEST(vtp_offsets_lead_to_the_arrays)
{
    const loxo_soup soup = soup_of(2, true);
    const size_t n = load(write_mesh("a.vtp", &soup));
    const char *data = NULL, *name;
    uint64_t n_bytes;
    double value;
    float single;
    int32_t id;
    CHECK(strstr(file_bytes, "<!-- made - - by a test &amp; &quot;more&quot; -->") != NULL);
    CHECK(strstr(file_bytes, "byte_order=\"LittleEndian\" header_type=\"UInt64\"") != NULL);
    CHECK_EQUAL(attribute(file_bytes, "NumberOfPoints=\""), 4);
    CHECK_EQUAL(attribute(file_bytes, "NumberOfPolys=\""), 4);
    CHECK((data = strstr(file_bytes, "<AppendedData encoding=\"raw\">\n_")) != NULL);
    data += strlen("<AppendedData encoding=\"raw\">\n_");

    CHECK((name = strstr(file_bytes, "Name=\"a &lt;b&gt;\"")) != NULL);
    memcpy(&n_bytes, data + attribute(name, "offset=\""), 8);
    memcpy(&value, data + attribute(name, "offset=\"") + 8 + 24, 8);
    CHECK_EQUAL(n_bytes, 32);
    CHECK_EQUAL(value, 4.0);
    CHECK((name = strstr(file_bytes, "Name=\"Points\" NumberOfComponents=\"3\"")) != NULL);
    memcpy(&n_bytes, data + attribute(name, "offset=\""), 8);
    memcpy(&single, data + attribute(name, "offset=\"") + 8 + 40, 4);
    CHECK_EQUAL(n_bytes, 48);
    CHECK_EQUAL(single, 0.1f);
    CHECK((name = strstr(file_bytes, "type=\"Int32\" Name=\"connectivity\"")) != NULL);
    memcpy(&n_bytes, data + attribute(name, "offset=\""), 8);
    memcpy(&id, data + attribute(name, "offset=\"") + 8 + 4, 4);
    CHECK_EQUAL(n_bytes, 48);
    CHECK_EQUAL(id, 2);
    CHECK((name = strstr(file_bytes, "type=\"Int32\" Name=\"offsets\"")) != NULL);
    memcpy(&n_bytes, data + attribute(name, "offset=\""), 8);
    memcpy(&id, data + attribute(name, "offset=\"") + 8 + 12, 4);
    CHECK_EQUAL(n_bytes, 16);
    CHECK_EQUAL(id, 12);
    CHECK_TEXT(data + attribute(name, "offset=\"") + 8 + 16, "\n  </AppendedData>\n</VTKFile>\n");
    CHECK((size_t)(data + attribute(name, "offset=\"") + 8 + 16 - file_bytes) < n);
}

TEST(npy_and_csv_fields)
{
    double value;
    CHECK_OK(loxo_write_field(test_context, test_scratch("d.npy"), "heat", heat, 4, NULL));
    CHECK_EQUAL(load(test_scratch("d.npy")), 128 + 32);
    CHECK(memcmp(file_bytes, "\x93NUMPY\x01\x00\x76\x00{'descr': '<f8', 'fortran_order': False, 'shape': (4,), }",
                 67) == 0);
    CHECK_EQUAL(file_bytes[127], '\n');
    memcpy(&value, file_bytes + 128 + 16, 8);
    CHECK_EQUAL(value, 0.1);
    CHECK_OK(loxo_write_field(test_context, test_scratch("d.csv"), "heat", heat, 4, NULL));
    load(test_scratch("d.csv"));
    CHECK_TEXT(file_bytes, "vertex,heat\n0,0\n1,1\n2,0.1\n3,inf\n");
    CHECK_OK(loxo_write_field(test_context, test_scratch("d.csv"), "a,\"b\"", heat, 1, NULL));
    load(test_scratch("d.csv"));
    CHECK_TEXT(file_bytes, "vertex,\"a,\"\"b\"\"\"\n0,0\n");
    CHECK_OK(loxo_write_field(test_context, test_scratch("d.npy"), NULL, NULL, 0, NULL));
    CHECK_EQUAL(load(test_scratch("d.npy")), 128);
}

TEST(what_cannot_be_written_is_refused)
{
    const loxo_soup good = soup_of(0, false);
    loxo_soup bad = good;
    loxo_index wrong[3] = {0, 1, 4};
    CHECK_STATUS(test_context, loxo_write_mesh(test_context, test_scratch("a.xyz"), &good, NULL), LOXO_ERR_UNSUPPORTED);
    CHECK_STATUS(test_context, loxo_write_mesh(test_context, test_scratch("a.stl"), &good, NULL), LOXO_ERR_UNSUPPORTED);
    CHECK_STATUS(test_context, loxo_write_mesh(test_context, test_scratch("a.npy"), &good, NULL), LOXO_ERR_UNSUPPORTED);
    CHECK_STATUS(test_context, loxo_write_field(test_context, test_scratch("refused.ply"), "x", heat, 4, NULL),
                 LOXO_ERR_UNSUPPORTED);
    CHECK_STATUS(test_context, loxo_write_field(test_context, test_scratch("a.npy"), "x", NULL, 4, NULL),
                 LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_write_mesh(test_context, NULL, &good, NULL), LOXO_ERR_ARGUMENT);
    CHECK_STATUS(test_context, loxo_write_mesh(test_context, test_scratch("refused.ply"), NULL, NULL),
                 LOXO_ERR_ARGUMENT);
    bad.position_float = position_float;
    CHECK_STATUS(test_context, loxo_write_mesh(test_context, test_scratch("refused.ply"), &bad, NULL),
                 LOXO_ERR_ARGUMENT);
    bad = good;
    bad.triangle = wrong;
    bad.n_faces = 1;
    CHECK_STATUS(test_context, loxo_write_mesh(test_context, test_scratch("refused.ply"), &bad, NULL),
                 LOXO_ERR_ARGUMENT);
    CHECK_EQUAL(loxo_context_failure(test_context)->element, 0);
    CHECK(access(test_scratch("refused.ply"), F_OK) != 0);
    CHECK_STATUS(test_context, loxo_write_check(test_context, "/no/such/folder/refused.ply"), LOXO_ERR_WRITE);
    CHECK_OK(loxo_write_check(test_context, test_scratch("refused.ply")));
    CHECK(access(test_scratch("refused.ply"), F_OK) != 0);
}

static int n_files(void)
{
    int n = 0;
    DIR *folder = opendir(test_scratch_folder);
    CHECK(folder != NULL);
    for (const struct dirent *e = readdir(folder); e != NULL; e = readdir(folder))
        n += e->d_name[0] != '.' || (strcmp(e->d_name, ".") != 0 && strcmp(e->d_name, "..") != 0);
    closedir(folder);
    return n;
}

/* As a full disk: beyond so many bytes every write fails. */
static void limit_file_size(rlim_t n_bytes)
{
    struct rlimit limit;
    CHECK(getrlimit(RLIMIT_FSIZE, &limit) == 0);
    limit.rlim_cur = n_bytes;
    CHECK(setrlimit(RLIMIT_FSIZE, &limit) == 0);
}

TEST(a_failed_write_leaves_the_old_file_and_nothing_else)
{
    const char *names[] = {"full.ply", "full.obj", "full.off", "full.vtp", "full.gii", "full.npy", "full.csv"};
    const int n_values = 200000;
    NEEDS_IDS(n_values);
    double *value = calloc((size_t)n_values, sizeof *value);
    loxo_soup soup = {.n_vertices = n_values / 4, .position = value};
    CHECK(value != NULL);
    for (int i = 0; i < n_values; ++i) /* does not pack */
        value[i] = sqrt(i + 0.5);
    signal(SIGXFSZ, SIG_IGN);
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        const bool is_field = i >= 5;
        const int n_before = n_files();
        const char *path = test_scratch(names[i]);
        CHECK_OK(loxo_write_bytes(test_context, path, "old", 3));
        for (rlim_t limit = 0; limit <= 300000; limit += 150000) {
            limit_file_size(limit);
            const loxo_status status = is_field ? loxo_write_field(test_context, path, "x", value, n_values, NULL)
                                                : loxo_write_mesh(test_context, path, &soup, NULL);
            limit_file_size(RLIM_INFINITY);
            CHECK_STATUS(test_context, status, LOXO_ERR_WRITE);
            CHECK(strstr(loxo_context_failure(test_context)->file, names[i]) != NULL);
            CHECK_EQUAL(load(path), 3);
            CHECK_TEXT(file_bytes, "old");
            CHECK_EQUAL(n_files(), n_before + 1);
        }
    }
    free(value);
    CHECK_STATUS(test_context, loxo_write_bytes(test_context, "/dev/full", "old", 3), LOXO_ERR_WRITE);
    if (geteuid() != 0) { /* root may write anywhere */
        CHECK(chmod(test_scratch_folder, 0500) == 0);
        const loxo_status status = loxo_write_bytes(test_context, test_scratch("full.ply"), "new", 3);
        CHECK(chmod(test_scratch_folder, 0700) == 0);
        CHECK_STATUS(test_context, status, LOXO_ERR_WRITE);
    }
}

static loxo_status write_all(loxo_context *ctx, void *arg)
{
    const char *names[] = {"m.ply", "m.obj", "m.off", "m.vtp", "m.surf.gii"};
    const loxo_soup soup = soup_of(1, false);
    loxo_status status = LOXO_OK;
    (void)arg;
    for (size_t i = 0; i < sizeof names / sizeof names[0] && status >= 0; ++i)
        status = loxo_write_mesh(ctx, test_scratch(names[i]), &soup, NULL);
    if (status >= 0) status = loxo_write_field(ctx, test_scratch("m.shape.gii"), "x", heat, 4, NULL);
    return status;
}

TEST(every_allocation_may_fail) { CHECK(test_each_allocation_fails(write_all, NULL) >= 6); }
