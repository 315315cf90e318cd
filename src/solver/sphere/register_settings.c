/* SPDX-License-Identifier: MIT
 * Settings of the registration: defaults in one function, everything else about them in one table. */
#include "base/options.h"

#include <loxo/register.h>

loxo_register_settings loxo_register_settings_default(void)
{
    return (loxo_register_settings){
        .lambda = 5.0, /* the paper's Figure 8 */
        .n_samples = 0,
        .sphere = loxo_sphere_settings_default(),
    };
}

#define FIELD(name) offsetof(loxo_register_settings, name)

const loxo_option loxo_register_options[] = {
    {.name = "lambda",
     .type = LOXO_OPTION_DOUBLE,
     .offset = FIELD(lambda),
     .min = 0.0,
     .max = 1e6,
     .help = "weight of the landmarks, (6.1); 0: the maps as they are, turned to meet best"},
    {.name = "samples",
     .type = LOXO_OPTION_INT64,
     .offset = FIELD(n_samples),
     .min = 0.0,
     .max = 1e6,
     .help = "points a curve is cut to; 0: as they are where they are as many, else as many as the longer has"},
    {.name = NULL},
};

const char *loxo_register_phase_name(loxo_register_phase phase)
{
    static const char *const names[] = {"map", "sample", "move", "locate"};
    return (unsigned)phase < LOXO_REGISTER_N_PHASES ? names[phase] : "unknown";
}
