/* SPDX-License-Identifier: MIT
 * Options table: one row per field of a settings struct feeds the range check, the command line, its help and JSON. */
#ifndef LOXO_BASE_OPTIONS_H
#define LOXO_BASE_OPTIONS_H

#include <loxo/context.h>

typedef enum loxo_option_type {
    LOXO_OPTION_BOOL,  /* bool */
    LOXO_OPTION_INT,   /* int */
    LOXO_OPTION_INT64, /* int64_t */
    LOXO_OPTION_UINT64,
    LOXO_OPTION_SIZE,   /* size_t, a number with K, M, G, T (powers of 1024) allowed */
    LOXO_OPTION_DOUBLE, /* double; NaN is out of every range */
    LOXO_OPTION_CHOICE, /* enum; stored as int */
} loxo_option_type;

typedef struct loxo_option {
    const char *name; /* as on the command line, without the dashes: "time-factor" */
    loxo_option_type type;
    size_t offset;   /* of the field in the settings struct */
    double min, max; /* inclusive; exclusive_min makes min itself out of range */
    bool exclusive_min;
    const char *const *choices; /* of LOXO_OPTION_CHOICE, ends with NULL; the index is the value */
    uint32_t methods;           /* bit i: value i of the table's choice "method" looks at it; 0: every one does */
    const char
        *needs[2];    /* "diffusion=sweeps", "recovery=auto|admm": looked at only with these values of other options */
    const char *help; /* one line, with the unit */
} loxo_option;

/* Rows end with name == NULL. */

/* LOXO_OK, or LOXO_ERR_ARGUMENT naming the option, the value and the range. who: "geodesic". */
loxo_status loxo_options_check(loxo_context *ctx, const char *who, const loxo_option *options, const void *settings);
/* Sets one option from text; LOXO_ERR_ARGUMENT when there is no such option or the text does not fit wholly. A bool
 * takes NULL or "" (true), true/false, yes/no, on/off, 1/0. Then checks the range of that option. */
loxo_status loxo_options_set(loxo_context *ctx, const char *who, const loxo_option *options, void *settings,
                             const char *name, const char *text);
const loxo_option *loxo_options_find(const loxo_option *options, const char *name);
/* The value as text that loxo_options_set takes back to the same bits. Returns the length snprintf would. */
int loxo_option_print(const loxo_option *option, const void *settings, char *text, size_t n);

bool loxo_option_differs(const loxo_option *option, const void *a, const void *b);
/* Whether the method that the settings name looks at an option; and the first of its needs that they do not meet, NULL: none. What the method
 * does not look at is no need. */
bool loxo_option_is_of_method(const loxo_option *options, const loxo_option *option, const void *settings);
const char *loxo_option_unmet(const loxo_option *options, const loxo_option *option, const void *settings);

/* The tables. Each stands beside its defaults; they are declared here so that tools see one header. */
extern const loxo_option loxo_geodesic_options[];
extern const loxo_option loxo_barycenter_options[];
extern const loxo_option loxo_center_options[];
extern const loxo_option loxo_polygon_options[];
extern const loxo_option loxo_polygon_sample_options[];
extern const loxo_option loxo_extension_options[];
extern const loxo_option loxo_sphere_options[];
extern const loxo_option loxo_register_options[];
extern const loxo_option loxo_sphere_extension_options[];
extern const loxo_option loxo_mesh_options[];
extern const loxo_option loxo_intrinsic_options[];
extern const loxo_option loxo_draw_options[];
extern const loxo_option loxo_repair_options[];

#endif
