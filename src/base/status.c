/* SPDX-License-Identifier: MIT
 * Texts, names and exit codes of statuses, all from the one list. */
#include "loxo_config.h"

#include <loxo/base.h>

const char *loxo_status_text(loxo_status status)
{
    switch (status) {
#define ROW(name, number, exit_code, text)                                                                             \
    case name: return text;
        LOXO_STATUS_LIST(ROW)
#undef ROW
    }
    return "unknown status";
}

const char *loxo_status_name(loxo_status status)
{
    switch (status) {
#define ROW(name, number, exit_code, text)                                                                             \
    case name: return #name;
        LOXO_STATUS_LIST(ROW)
#undef ROW
    }
    return "unknown";
}

int loxo_status_exit_code(loxo_status status)
{
    switch (status) {
#define ROW(name, number, exit_code, text)                                                                             \
    case name: return exit_code;
        LOXO_STATUS_LIST(ROW) /* NOLINT(bugprone-branch-clone): several share a code */
#undef ROW
    }
    return 2;
}

const char *loxo_version(void) { return LOXO_VERSION_STRING; }

const char *loxo_build_features(void) { return LOXO_FEATURE_LINES; }
