/* SPDX-License-Identifier: MIT
 * Room for the rows of the levels in flight: two rings, one of rows and one of entries. A level stands in one piece in
 * each; what it takes is known from the search. Levels come in and leave in order. A surface whose window is wider than the
 * rings (few levels, or many that settle slowly) gets larger ones: values do not depend on where rows stand. */
#include "base/allocate.h"
#include "solver/geodesic/parallel_heat/parallel_heat_internal.h"

#include <string.h>

#define LEVELS_IN_FLIGHT 1024 /* the march has less than 512; a power of two */

static level_rows *rows_of(const parallel_heat *g, int64_t level)
{
    return &g->level_rows[g->has_all_levels ? level : level & (LEVELS_IN_FLIGHT - 1)];
}

k_row *heat_row(const parallel_heat *g, int64_t level, int64_t place)
{
    return &g->row[rows_of(g, level)->row + (place - g->level_begin[level])];
}

/* all: every level stays. */
loxo_status heat_window_begin(parallel_heat *g, bool all)
{
    g->has_all_levels = all;
    g->oldest_level = g->row_end = g->entry_end = 0;
    g->row = g->ring_row;
    g->entry = g->ring_entry;
    g->row_room = g->n_ring_rows;
    g->entry_room = g->n_ring_entries;
    g->level_rows = loxo_allocate(g->ctx, all ? g->n_levels : LEVELS_IN_FLIGHT, sizeof *g->level_rows);
    return g->level_rows == NULL ? LOXO_ERR_MEMORY : LOXO_OK;
}

void heat_window_end(parallel_heat *g)
{
    loxo_release(g->ctx, g->level_rows);
    loxo_release(g->ctx, g->more_rows);
    loxo_release(g->ctx, g->more_entries);
    g->level_rows = NULL;
    g->more_rows = NULL;
    g->more_entries = NULL;
}

/* Where `need` fit behind `end`, of a ring whose oldest begins at `begin`; -1: nowhere. */
static int64_t fit(int64_t begin, int64_t end, bool is_empty, int64_t need, int64_t room)
{
    if (is_empty) return need <= room ? 0 : -1;
    if (end > begin) return end + need <= room ? end : need < begin ? 0 : -1;
    return end + need < begin ? end : -1;
}

/* Larger rings, in which all that is in flight stands from the beginning. */
static loxo_status grow(parallel_heat *g, int64_t level, int64_t n_rows, int64_t n_entries)
{
    const int64_t row_room = 2 * g->row_room + n_rows, entry_room = 2 * g->entry_room + n_entries;
    k_row *rows = loxo_allocate(g->ctx, row_room, sizeof *rows);
    k_entry *entries = loxo_allocate(g->ctx, entry_room, sizeof *entries);
    int64_t row_end = 0, entry_end = 0;
    if (rows == NULL || entries == NULL) {
        loxo_release(g->ctx, rows);
        loxo_release(g->ctx, entries);
        return LOXO_ERR_MEMORY;
    }
    for (int64_t l = g->oldest_level; l < level; ++l) {
        level_rows *at = rows_of(g, l);
        const k_row *old = &g->row[at->row];
        const int64_t n = g->level_begin[l + 1] - g->level_begin[l] + 1, first = at->entry;
        memcpy(&entries[entry_end], &g->entry[first], (size_t)at->n_entries * sizeof *entries);
        for (int64_t i = 0; i < n; ++i) {
            rows[row_end + i] = old[i];
            rows[row_end + i].begin = (uint32_t)(entry_end + (old[i].begin - first));
        }
        *at = (level_rows){row_end, entry_end, at->n_entries};
        row_end += n;
        entry_end += at->n_entries;
    }
    loxo_release(g->ctx, g->more_rows);
    loxo_release(g->ctx, g->more_entries);
    g->row = g->more_rows = rows;
    g->entry = g->more_entries = entries;
    g->row_room = row_room;
    g->entry_room = entry_room;
    g->row_end = row_end;
    g->entry_end = entry_end;
    return LOXO_OK;
}

loxo_status heat_window_take_in(parallel_heat *g, int64_t level)
{
    const int64_t begin = g->level_begin[level], end = g->level_begin[level + 1], n_rows = end - begin + 1;
    const bool is_empty = g->oldest_level == level;
    int64_t n_entries = 0;
    for (int64_t p = begin; p < end; ++p)
        n_entries += g->degree[p];
    int64_t row = -1, entry = -1;
    for (int turn = 0; row < 0 || entry < 0; ++turn) {
        const level_rows oldest = is_empty ? (level_rows){0, 0, 0} : *rows_of(g, g->oldest_level);
        if (turn > 0 && grow(g, level, n_rows, n_entries) < 0) return LOXO_ERR_MEMORY;
        row = fit(turn > 0 ? 0 : oldest.row, g->row_end, is_empty, n_rows, g->row_room);
        entry = fit(turn > 0 ? 0 : oldest.entry, g->entry_end, is_empty, n_entries, g->entry_room);
    }
    *rows_of(g, level) = (level_rows){row, entry, n_entries};
    g->row_end = row + n_rows;
    g->entry_end = entry + n_entries;
    k_row *own = &g->row[row];
    for (int64_t p = begin; p < end; ++p, ++own) {
        own->begin = (uint32_t)entry;
        entry += g->degree[p];
    }
    own->begin = (uint32_t)entry;
    return LOXO_OK;
}

void heat_window_leave(parallel_heat *g, int64_t oldest) { g->oldest_level = oldest; }
