/* SPDX-License-Identifier: MIT
 * Samples, tables for people, JSON for machines, and the line that says what was measured on. */
#include "bench.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

loxo_status bench_fail(bench *b, loxo_status status, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    vsnprintf(b->message, sizeof b->message, format, args);
    va_end(args);
    return status;
}

const char *bench_message(const bench *b)
{
    return b->message[0] != '\0' ? b->message : loxo_context_failure(b->ctx)->text;
}

static int compare_doubles(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

bench_stat bench_stat_of(int n, const double *sample)
{
    double sorted[BENCH_MAX_REPEATS];
    memcpy(sorted, sample, (size_t)n * sizeof *sorted);
    qsort(sorted, (size_t)n, sizeof *sorted, compare_doubles);
    return (bench_stat){
        .median = 0.5 * (sorted[(n - 1) / 2] + sorted[n / 2]), .min = sorted[0], .max = sorted[n - 1], .n = n};
}

const char *bench_stat_text(bench_stat stat, double scale, char *text, size_t n)
{
    if (isnan(stat.median))
        snprintf(text, n, "-");
    else if (stat.n == 1)
        snprintf(text, n, "%.3g", stat.median * scale);
    else
        snprintf(text, n, "%.3g [%.3g..%.3g]", stat.median * scale, stat.min * scale, stat.max * scale);
    return text;
}

json_t *bench_stat_json(bench_stat stat)
{
    if (stat.n == 0 || !isfinite(stat.median)) return json_null();
    return json_pack("{s:f, s:f, s:f, s:i}", "median", stat.median, "min", stat.min, "max", stat.max, "n", stat.n);
}

/* Splits text at '|' into the next row. */
static void add_row(bench_table *table, const char *text)
{
    int column = 0;
    for (const char *p = text; column < BENCH_MAX_COLUMNS; ++column) {
        const size_t length = strcspn(p, "|");
        snprintf(table->cell[table->n_rows][column], BENCH_CELL, "%.*s", (int)length, p);
        if (p[length] == '\0') {
            ++column;
            break;
        }
        p += length + 1;
    }
    if (column > table->n_columns) table->n_columns = column;
    table->n_rows += 1;
}

static void print_row(const bench *b, const bench_table *table, int r, const int *width)
{
    for (int c = 0; c < table->n_columns; ++c)
        bench_say(b, c == 0 ? "  %-*s" : "  %*s", width[c], table->cell[r][c]);
    bench_say(b, "\n");
}

static void tell_live(const bench_table *table)
{
    if (table->live != NULL) print_row(table->live, table, table->n_rows - 1, table->width);
}

void bench_table_begin(bench_table *table, const char *heads)
{
    memset(table, 0, sizeof *table);
    add_row(table, heads);
}

void bench_table_begin_live(const bench *b, bench_table *table, const char *heads, const int *width)
{
    bench_table_begin(table, heads);
    table->live = b;
    memcpy(table->width, width, (size_t)table->n_columns * sizeof *width);
    tell_live(table);
}

void bench_table_row(bench_table *table, const char *format, ...)
{
    char text[BENCH_MAX_COLUMNS * BENCH_CELL];
    va_list args;
    va_start(args, format);
    vsnprintf(text, sizeof text, format, args);
    va_end(args);
    if (table->n_rows == BENCH_MAX_ROWS) return;
    add_row(table, text);
    tell_live(table);
}

void bench_say(const bench *b, const char *format, ...)
{
    va_list args, again;
    va_start(args, format);
    va_copy(again, args);
    if (b->text != NULL) { /* first: what was seen is kept, whenever it is killed */
        vfprintf(b->text, format, again);
        fflush(b->text);
    }
    vprintf(format, args);
    va_end(again);
    va_end(args);
    fflush(stdout);
}

void bench_table_print(const bench *b, const bench_table *table)
{
    int width[BENCH_MAX_COLUMNS] = {0};
    for (int r = 0; r < table->n_rows; ++r)
        for (int c = 0; c < table->n_columns; ++c) {
            const int n = (int)strlen(table->cell[r][c]);
            if (n > width[c]) width[c] = n;
        }
    for (int r = 0; r < table->n_rows; ++r)
        print_row(b, table, r, width);
    bench_say(b, "\n");
}

/* The processor's name as Linux tells it. */
static void processor_name(char *name, size_t n)
{
    char line[512];
    FILE *file = fopen("/proc/cpuinfo", "r");
    snprintf(name, n, "unknown processor");
    if (file == NULL) return;
    while (fgets(line, sizeof line, file) != NULL) {
        const char *colon = strchr(line, ':');
        if (strncmp(line, "model name", 10) != 0 || colon == NULL) continue;
        snprintf(name, n, "%.*s", (int)strcspn(colon + 2, "\n"), colon + 2);
        break;
    }
    fclose(file);
}

/* Processes that wanted a processor during the last minute, as Linux tells it; 0 where it does not. */
static double load_average(void)
{
    char line[128] = "";
    FILE *file = fopen("/proc/loadavg", "r");
    if (file == NULL) return 0.0;
    const bool is_read = fgets(line, sizeof line, file) != NULL;
    fclose(file);
    return is_read ? strtod(line, NULL) : 0.0;
}

static const char *isa_name(loxo_isa isa)
{
    switch (isa) {
    case LOXO_ISA_AVX512: return "AVX-512";
    case LOXO_ISA_AVX2: return "AVX2";
    case LOXO_ISA_BASELINE: return "baseline";
    case LOXO_ISA_AUTO: break;
    }
    return "auto";
}

loxo_status bench_machine(bench *b)
{
    loxo_machine machine;
    char name[128], text[64];
    json_t *triad = json_array();
    loxo_status status = loxo_machine_get(b->ctx, &machine);
    if (status < 0) return status;
    processor_name(name, sizeof name);
    bench_say(
        b,
        "loxo-bench %s; %s, %d cores (%d usable), kernels %s, L2 %.3g MiB, L3 %.3g MiB, memory %.3g GiB; medians of "
        "%d [min..max]\n",
        loxo_version(), name, machine.n_cores, machine.n_processors, isa_name(loxo_context_isa(b->ctx)),
        (double)machine.l2_bytes / 0x1p20, (double)machine.l3_bytes / 0x1p20, (double)machine.memory_bytes / 0x1p30,
        b->settings.repeats);
    const double load = load_average();
    if (load > 0.3)
        bench_say(
            b, "The machine is not quiet (load average %.2f): look at the spread, and trust ratios of one run only.\n",
            load);
    bench_say(b, "STREAM triad, GB/s:");
    for (int i = 0; i < b->n_threads; ++i) {
        double sample[BENCH_MAX_REPEATS];
        bench_triad arrays;
        if ((status = bench_triad_open(b, b->threads[i], &arrays)) < 0) break;
        for (int k = -1; k < b->settings.repeats; ++k)
            sample[k < 0 ? 0 : k] = bench_triad_run(&arrays);
        bench_triad_close(b, &arrays);
        const bench_stat rate = bench_stat_of(b->settings.repeats, sample);
        bench_say(b, "%s %d thread%s %s", i == 0 ? "" : ";", b->threads[i], b->threads[i] == 1 ? "" : "s",
                  bench_stat_text(rate, 1.0, text, sizeof text));
        json_array_append_new(triad,
                              json_pack("{s:i, s:o}", "threads", b->threads[i], "gb_per_s", bench_stat_json(rate)));
    }
    bench_say(b, "\n\n");
    fflush(stdout);
    json_object_set_new(b->report, "machine",
                        json_pack("{s:s, s:i, s:i, s:s, s:I, s:I, s:I}", "processor", name, "cores", machine.n_cores,
                                  "usable", machine.n_processors, "isa", isa_name(loxo_context_isa(b->ctx)), "l2_bytes",
                                  (json_int_t)machine.l2_bytes, "l3_bytes", (json_int_t)machine.l3_bytes,
                                  "memory_bytes", (json_int_t)machine.memory_bytes));
    json_object_set_new(b->report, "triad", triad);
    json_object_set_new(b->report, "load_average", json_real(load));
    return status;
}

void bench_record(bench *b, const char *list, json_t *row)
{
    json_t *rows = json_object_get(b->report, list);
    if (rows == NULL) {
        rows = json_array();
        json_object_set_new(b->report, list, rows);
    }
    json_array_append_new(rows, row);
}

loxo_status bench_report_write(bench *b)
{
    if (b->json_path == NULL) return LOXO_OK;
    char *text = json_dumps(b->report, JSON_INDENT(2) | JSON_REAL_PRECISION(17));
    if (text == NULL) return LOXO_ERR_MEMORY;
    const loxo_status status = loxo_write_bytes(b->ctx, b->json_path, text, strlen(text));
    free(text);
    return status;
}
