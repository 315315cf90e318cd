/* SPDX-License-Identifier: MIT
 * Types, statuses and small enums that every other header of Loxo uses. */
#ifndef LOXO_BASE_H
#define LOXO_BASE_H

#include <limits.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__)
#define LOXO_API __attribute__((visibility("default")))
#else
#define LOXO_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define LOXO_VERSION_MAJOR 0
#define LOXO_VERSION_MINOR 1
#define LOXO_VERSION_PATCH 0

/* Number of a local thing: vertex, face, half-edge. -1 means «none». Counts and offsets that add up over things are
 * int64_t, bytes are size_t. A build with -Dindex_bits=16 exists for tests: what overflows there at 32767 would
 * overflow in the ordinary build at 2^31. */
#if defined(LOXO_INDEX_BITS) && LOXO_INDEX_BITS == 16
typedef int16_t loxo_index;
#define LOXO_INDEX_MAX INT16_MAX
#else
typedef int32_t loxo_index;
#define LOXO_INDEX_MAX INT32_MAX
#endif

/* Every status, its number, the exit code of the command line, and its text: the one list.
 * Negative: nothing usable was written. Zero: good. Positive: the output is usable, read the info. */
#define LOXO_STATUS_LIST(X)                                                                                            \
    X(LOXO_OK, 0, 0, "good")                                                                                           \
    X(LOXO_NOT_CONVERGED, 1, 8, "ended without meeting its tolerance; the last state was written")                     \
    X(LOXO_STOPPED, 2, 130, "stopped by the monitor; the last state was written")                                      \
    X(LOXO_REPAIRED, 3, 0, "the mesh was repaired; see the counts")                                                    \
    X(LOXO_CHECK_FAILED, 4, 8, "the result does not pass its own check; see the counts")                               \
    X(LOXO_ERR_ARGUMENT, -1, 2, "an argument or a setting is out of its range")                                        \
    X(LOXO_ERR_READ, -2, 3, "cannot open or read")                                                                     \
    X(LOXO_ERR_MALFORMED, -3, 4, "malformed input")                                                                    \
    X(LOXO_ERR_UNSUPPORTED, -4, 5, "valid but not supported")                                                          \
    X(LOXO_ERR_MESH, -5, 6, "the mesh is not valid for this operation")                                                \
    X(LOXO_ERR_MEMORY, -6, 7, "does not fit into memory")                                                              \
    X(LOXO_ERR_LIMIT, -7, 7, "larger than a limit")                                                                    \
    X(LOXO_ERR_NUMERIC, -8, 8, "a result was not finite")                                                              \
    X(LOXO_ERR_WRITE, -9, 9, "cannot write")                                                                           \
    X(LOXO_ERR_STOPPED, -10, 130, "stopped by the monitor before anything usable was there")

typedef enum loxo_status {
#define LOXO_STATUS_ROW(name, number, exit_code, text) name = (number),
    LOXO_STATUS_LIST(LOXO_STATUS_ROW)
#undef LOXO_STATUS_ROW
} loxo_status;

/* The text of a status, never NULL. */
LOXO_API const char *loxo_status_text(loxo_status status);
/* Its name, as "LOXO_ERR_MESH"; "unknown" for a number outside the list. */
LOXO_API const char *loxo_status_name(loxo_status status);
/* The exit code that the command line gives it. */
LOXO_API int loxo_status_exit_code(loxo_status status);

/* What becomes of an array that is handed over. */
typedef enum loxo_ownership {
    LOXO_COPY,   /* copied; the caller keeps its own */
    LOXO_BORROW, /* used in place; the caller keeps it alive and unchanged until the object is destroyed */
    LOXO_ADOPT,  /* taken over; must come from loxo_allocate of the same context */
} loxo_ownership;

/* "0.1.0" */
LOXO_API const char *loxo_version(void);
/* One line per optional feature, as "hwloc 2.9.0" or "metis off": what this build can do. Static storage. */
LOXO_API const char *loxo_build_features(void);

#ifdef __cplusplus
}
#endif
#endif
