/* SPDX-License-Identifier: MIT */
#ifndef LOXO_TOOLS_BARYCENTER_REPORT_H
#define LOXO_TOOLS_BARYCENTER_REPORT_H

#include "run.h"

/* loxo_barycenter_info field by field, of d dimensions. */
void cli_put_barycenter(json_t *object, const loxo_barycenter_info *info, int d);

#endif
