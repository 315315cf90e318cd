/* SPDX-License-Identifier: MIT
 * The commands, one file each. */
#ifndef LOXO_TOOLS_COMMANDS_H
#define LOXO_TOOLS_COMMANDS_H

#include "args.h"

extern const cli_command command_info;
extern const cli_command command_convert;
extern const cli_command command_generate;
extern const cli_command command_geodesic;
extern const cli_command command_sample;
extern const cli_command command_render;
extern const cli_command command_measure;
extern const cli_command command_sphere;
extern const cli_command command_center;
extern const cli_command command_barycenter;
extern const cli_command command_polygon;
extern const cli_command command_extend;
extern const cli_command command_register;

#endif
