/* SPDX-License-Identifier: MIT
 * What the writers write, the readers read: the same bits, through files, pipes of bytes and every format that both
 * know. */
#include "base/rng.h"
#include "loxo_config.h"

#ifdef LOXO_WITH_EXPAT
#define WITH_GIFTI(...) , __VA_ARGS__
#else
#define WITH_GIFTI(...)
#endif
#include "test.h"

#include <loxo/io.h>

/* A soup of n vertices at random, over many magnitudes, and as many faces. */
static loxo_soup random_soup(int64_t n, bool is_float, int n_fields)
{
    loxo_soup soup = {.n_vertices = n, .n_faces = n, .n_fields = n_fields};
    const char *names[2] = {"heat", "distance_2"};
    soup.triangle = loxo_allocate(test_context, n, 3 * sizeof *soup.triangle);
    if (is_float)
        soup.position_float = loxo_allocate(test_context, n, 3 * sizeof *soup.position_float);
    else
        soup.position = loxo_allocate(test_context, n, 3 * sizeof *soup.position);
    CHECK(soup.triangle != NULL && (soup.position != NULL || soup.position_float != NULL));
    for (int64_t i = 0; i < 3 * n; ++i) {
        const uint64_t k = (uint64_t)i;
        const double x = ldexp(loxo_random_unit(1, k) - 0.5, (int)(loxo_random_u64(2, k) % 60) - 30);
        if (is_float)
            soup.position_float[i] = (float)x;
        else
            soup.position[i] = x;
        soup.triangle[i] = (loxo_index)((i / 3 + (i % 3) * 7) % n); /* three different ones */
    }
    if (n_fields > 0) soup.fields = loxo_allocate(test_context, n_fields, sizeof *soup.fields);
    for (int f = 0; f < n_fields; ++f) {
        soup.fields[f] = (loxo_field){.value = loxo_allocate(test_context, n, sizeof(double))};
        CHECK(soup.fields[f].value != NULL);
        memcpy(soup.fields[f].name, names[f], strlen(names[f]) + 1);
        for (int64_t v = 0; v < n; ++v)
            soup.fields[f].value[v] = loxo_random_unit((uint64_t)f + 3, (uint64_t)v);
    }
    return soup;
}

/* As float where `narrow`: the text of a float is the shortest that gives the float back, not its value as a double. */
static double coordinate(const loxo_soup *soup, int64_t i, bool narrow)
{
    if (soup->position_float != NULL) return (double)soup->position_float[i];
    return narrow ? (double)(float)soup->position[i] : soup->position[i];
}

static void check_same(const loxo_soup *a, const loxo_soup *b, int n_fields)
{
    CHECK_EQUAL(a->n_vertices, b->n_vertices);
    CHECK_EQUAL(a->n_faces, b->n_faces);
    for (int64_t i = 0; i < 3 * a->n_vertices; ++i)
        CHECK_EQUAL(coordinate(a, i, false), coordinate(b, i, a->position_float != NULL));
    if (a->n_faces > 0) CHECK(memcmp(a->triangle, b->triangle, (size_t)a->n_faces * 3 * sizeof *a->triangle) == 0);
    CHECK_EQUAL(b->n_fields, n_fields);
    for (int f = 0; f < n_fields; ++f) {
        CHECK_TEXT(b->fields[f].name, a->fields[f].name);
        CHECK(memcmp(a->fields[f].value, b->fields[f].value, (size_t)a->n_vertices * sizeof(double)) == 0);
    }
}

TEST(meshes_come_back)
{
    static const struct {
        const char *name;
        bool keeps_width;
        int n_fields;
    } formats[] = {{"m.ply", true, 2}, {"m.obj", false, 0}, {"m.off", false, 0} WITH_GIFTI({"m.surf.gii", true, 1})};
    for (int is_float = 0; is_float < 2; ++is_float)
        for (int64_t n = 30; n <= 30000; n *= 1000) {
            loxo_soup soup = random_soup(n, is_float == 1, 2);
            for (size_t i = 0; i < sizeof formats / sizeof formats[0]; ++i) {
                const char *path = test_scratch(formats[i].name);
                loxo_write_settings settings = {.comment = "end_header <!-- & \" \n v 1 2 3"};
                loxo_soup back;
                CHECK_OK(loxo_write_mesh(test_context, path, &soup, &settings));
                CHECK_OK(loxo_read_mesh(test_context, path, NULL, &back));
                check_same(&soup, &back, formats[i].n_fields);
                if (formats[i].keeps_width) CHECK((back.position == NULL) == (is_float == 1));
                loxo_soup_destroy(test_context, &back);
            }
            loxo_soup_destroy(test_context, &soup);
        }
}

TEST(a_mesh_without_faces_comes_back)
{
    const char *names[] = {"e.ply", "e.obj", "e.off" WITH_GIFTI("e.surf.gii")};
    loxo_soup soup = random_soup(5, false, 0);
    soup.n_faces = 0;
    for (size_t i = 0; i < sizeof names / sizeof names[0]; ++i) {
        loxo_soup back;
        CHECK_OK(loxo_write_mesh(test_context, test_scratch(names[i]), &soup, NULL));
        CHECK_OK(loxo_read_mesh(test_context, test_scratch(names[i]), NULL, &back));
        check_same(&soup, &back, 0);
        loxo_soup_destroy(test_context, &back);
    }
    loxo_soup_destroy(test_context, &soup);
}

#ifdef LOXO_WITH_EXPAT
TEST(doubles_that_are_floats_become_floats_in_gifti)
{
    loxo_soup soup = random_soup(10, false, 0), back;
    for (int i = 0; i < 30; ++i)
        soup.position[i] = (double)(float)soup.position[i];
    CHECK_OK(loxo_write_mesh(test_context, test_scratch("g.surf.gii"), &soup, NULL));
    CHECK_OK(loxo_read_mesh(test_context, test_scratch("g.surf.gii"), NULL, &back));
    CHECK(back.position_float != NULL);
    check_same(&soup, &back, 0);
    loxo_soup_destroy(test_context, &back);
    loxo_soup_destroy(test_context, &soup);
}

#endif

/* Each real surface through every format: the copy of the copy is the same. */
TEST(real_surfaces_come_back)
{
    const char *from[] = {
#ifdef LOXO_WITH_ZLIB
        "meshes/surfaces/fandisk.obj.gz", "meshes/surfaces/horse20k.off.gz",
#endif
        "meshes/surfaces/fsaverage5.lh.white",
        "meshes/surfaces/hippocampus6k.ply" WITH_GIFTI("meshes/surfaces/fsLR32k.L.white.surf.gii")};
    const char *to[] = {"r.ply", "r.obj", "r.off" WITH_GIFTI("r.surf.gii")};
    for (size_t i = 0; i < sizeof from / sizeof from[0]; ++i) {
        loxo_soup soup;
        if (test_shared(from[i]) == NULL) SKIP();
        CHECK_OK(loxo_read_mesh(test_context, test_shared(from[i]), NULL, &soup));
        for (size_t k = 0; k < sizeof to / sizeof to[0]; ++k) {
            loxo_soup back;
            CHECK_OK(loxo_write_mesh(test_context, test_scratch(to[k]), &soup, NULL));
            CHECK_OK(loxo_read_mesh(test_context, test_scratch(to[k]), NULL, &back));
            check_same(&soup, &back, 0);
            loxo_soup_destroy(test_context, &back);
        }
        loxo_soup_destroy(test_context, &soup);
    }
}
