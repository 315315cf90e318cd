/* SPDX-License-Identifier: MIT
 * Everything. */
#ifndef LOXO_LOXO_H
#define LOXO_LOXO_H

#include <loxo/barycenter.h>
#include <loxo/base.h>
#include <loxo/center.h>
#include <loxo/context.h>
#include <loxo/draw.h>
#include <loxo/extension.h>
#include <loxo/geodesic.h>
#include <loxo/io.h>
#include <loxo/lines.h>
#include <loxo/locate.h>
#include <loxo/measure.h>
#include <loxo/mesh.h>
#include <loxo/moebius.h>
#include <loxo/monitor.h>
#include <loxo/polygon.h>
#include <loxo/register.h>
#include <loxo/sphere.h>

#endif
