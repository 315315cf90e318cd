/* SPDX-License-Identifier: MIT
 * Signals are the command's business alone; the library installs nothing. */
#ifndef LOXO_TOOLS_SIGNALS_H
#define LOXO_TOOLS_SIGNALS_H

#include <stdbool.h>

void signals_install(void);
int signals_caught(void);       /* the signal that asked to stop, 0 when none did */
void signals_hold(void);        /* from now on none ends the program, however often it is sent */
bool signals_pipe_closed(void); /* somebody stopped reading what is written */

#endif
