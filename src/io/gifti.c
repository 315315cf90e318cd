/* SPDX-License-Identifier: MIT */
#include "io/gifti.h"

#include "base/allocate.h"
#include "base/context.h"
#include "io/base64.h"
#include "io/bytes.h"
#include "io/scan.h"
#include "io/source.h"
#include "io/xml.h"

#include <inttypes.h>

#ifdef LOXO_WITH_EXPAT

#define FEED_BYTES  LOXO_XML_FEED_BYTES
#define MAX_NUMBERS ((int64_t)1 << 48)

typedef struct parsing {
    loxo_xml xml;
    loxo_gifti_want_fn want;
    loxo_gifti_take_fn take;
    loxo_gifti_label_fn take_label;
    void *user;
    int64_t n_arrays, n_announced; /* n_announced: -1 when the file does not say */
    bool in_array, is_wanted, has_data;
    bool in_labels, has_label; /* has_label: its key is a number */
    int64_t label;
    char *text; /* where a name goes while one is read */
    size_t n_text;
    char key[64], value[64]; /* of metadata */
    loxo_gifti_array array;
    bool in_data;
    uint8_t *data; /* the text of Data, then the bytes that it codes */
    size_t n_data, capacity;
} parsing;

static loxo_place here(const parsing *p) { return loxo_xml_here(&p->xml); }

static void stop(parsing *p, loxo_status status) { loxo_xml_stop(&p->xml, status); }

static void stop_malformed(parsing *p, const char *text) { loxo_xml_stop_malformed(&p->xml, text); }

/* ---- attributes of a DataArray ------------------------------------------------------------------------------- */

static const char *attribute(const char **attributes, const char *key) { return loxo_xml_attribute(attributes, key); }

static bool parse_number(const char *text, int64_t *value) { return loxo_xml_integer(text, value); }

static bool parse_count(const char *text, int64_t *value) { return parse_number(text, value) && *value >= 0; }

static bool parse_dimensions(parsing *p, const char **attributes)
{
    static const char *const keys[] = {"Dim0", "Dim1", "Dim2", "Dim3", "Dim4", "Dim5"};
    loxo_gifti_array *array = &p->array;
    int64_t n_dimensions;
    array->n_columns = 1;
    if (!parse_count(attribute(attributes, "Dimensionality"), &n_dimensions) || n_dimensions < 1 || n_dimensions > 6) {
        stop_malformed(p, "DataArray: Dimensionality is not in 1..6");
        return false;
    }
    for (int64_t i = 0; i < n_dimensions; ++i) {
        int64_t *product = i == 0 ? &array->n_rows : &array->n_columns;
        int64_t count;
        if (!parse_count(attribute(attributes, keys[i]), &count)) {
            stop_malformed(p, "DataArray: a dimension is missing or not a count");
            return false;
        }
        if (i == 0) *product = 1;
        if (__builtin_mul_overflow(*product, count, product)) *product = MAX_NUMBERS;
    }
    int64_t n;
    if (__builtin_mul_overflow(array->n_rows, array->n_columns, &n) || n >= MAX_NUMBERS) {
        stop(p, loxo_fail_at(p->xml.ctx, LOXO_ERR_LIMIT, here(p), "DataArray: more numbers than any file could hold"));
        return false;
    }
    return true;
}

static bool parse_coding(parsing *p, const char **attributes)
{
    const char *encoding = attribute(attributes, "Encoding"), *endian = attribute(attributes, "Endian");
    const char *order = attribute(attributes, "ArrayIndexingOrder");
    loxo_gifti_array *array = &p->array;
    if (encoding != NULL && strcmp(encoding, "ASCII") == 0) {
        array->encoding = LOXO_GIFTI_ASCII;
    } else if (encoding != NULL && strcmp(encoding, "Base64Binary") == 0) {
        array->encoding = LOXO_GIFTI_BASE64;
    } else if (encoding != NULL && strcmp(encoding, "GZipBase64Binary") == 0) {
        array->encoding = LOXO_GIFTI_GZIP;
    } else if (encoding != NULL && strcmp(encoding, "ExternalFileBinary") == 0) {
        stop(p, loxo_fail_at(p->xml.ctx, LOXO_ERR_UNSUPPORTED, here(p),
                             "DataArray: data in another file (ExternalFileBinary) is never opened"));
        return false;
    } else {
        stop_malformed(p, "DataArray: Encoding is missing or unknown");
        return false;
    }
    const bool is_big = endian != NULL && strcmp(endian, "BigEndian") == 0;
    if (!is_big && array->encoding != LOXO_GIFTI_ASCII && (endian == NULL || strcmp(endian, "LittleEndian") != 0)) {
        stop_malformed(p, "DataArray: Endian is missing or unknown");
        return false;
    }
    array->swap = array->encoding != LOXO_GIFTI_ASCII && is_big != LOXO_HOST_IS_BIG;
    array->is_column_major = order != NULL && strcmp(order, "ColumnMajorOrder") == 0;
    if (order != NULL && !array->is_column_major && strcmp(order, "RowMajorOrder") != 0) {
        stop_malformed(p, "DataArray: ArrayIndexingOrder is unknown");
        return false;
    }
    return true;
}

static void copy_text(char to[64], const char *from)
{
    size_t n = strlen(from);
    if (n > 63) n = 63;
    memcpy(to, from, n);
    to[n] = '\0';
}

static void begin_array(parsing *p, const char **attributes)
{
    const char *intent = attribute(attributes, "Intent"), *type = attribute(attributes, "DataType");
    p->array = (loxo_gifti_array){.line = (int64_t)XML_GetCurrentLineNumber(p->xml.parser)};
    p->in_array = true;
    p->has_data = false;
    if (intent == NULL || strncmp(intent, "NIFTI_INTENT_", 13) != 0) {
        stop_malformed(p, "DataArray: Intent is missing or unknown");
        return;
    }
    copy_text(p->array.intent, intent + 13);
    if (type == NULL || strncmp(type, "NIFTI_TYPE_", 11) != 0) {
        stop_malformed(p, "DataArray: DataType is missing or unknown");
        return;
    }
    p->array.type = strcmp(type + 11, "FLOAT32") == 0   ? LOXO_GIFTI_FLOAT32
                    : strcmp(type + 11, "FLOAT64") == 0 ? LOXO_GIFTI_FLOAT64
                    : strcmp(type + 11, "INT32") == 0   ? LOXO_GIFTI_INT32
                                                        : LOXO_GIFTI_OTHER;
    if (!parse_dimensions(p, attributes) || !parse_coding(p, attributes)) return;
    const int wanted = p->want(p->user, p->xml.ctx, p->xml.name, &p->array);
    if (wanted < 0) {
        stop(p, (loxo_status)wanted);
        return;
    }
    p->is_wanted = wanted > 0;
}

/* ---- data ---------------------------------------------------------------------------------------------------- */

static loxo_place at_array(const parsing *p)
{
    return (loxo_place){.file = p->xml.name, .line = p->array.line, .byte = -1, .element = -1};
}

static void stop_array(parsing *p, loxo_status status, const char *text)
{
    stop(p, loxo_fail_at(p->xml.ctx, status, at_array(p), "DataArray: %s", text));
}

static void stop_count(parsing *p, size_t n_found, size_t n_wanted, const char *unit)
{
    stop(p, loxo_fail_at(p->xml.ctx, LOXO_ERR_MALFORMED, at_array(p),
                         "DataArray: its dimensions make %zu %s, the data holds %s%zu", n_wanted, unit,
                         n_found > n_wanted ? "more than " : "", n_found > n_wanted ? n_wanted : n_found));
}

/* Room for n more bytes. */
static bool reserve_data(parsing *p, size_t n)
{
    size_t wanted = p->capacity + p->capacity / 2;
    if (n <= p->capacity - p->n_data) return true;
    if (wanted < p->n_data + n) wanted = p->n_data + n;
    if (wanted < FEED_BYTES) wanted = FEED_BYTES;
    uint8_t *grown = loxo_reallocate(p->xml.ctx, p->data, (int64_t)wanted, 1);
    if (grown == NULL) {
        stop(p, LOXO_ERR_MEMORY);
        return false;
    }
    p->data = grown;
    p->capacity = wanted;
    return true;
}

static void append_data(parsing *p, const char *text, size_t n)
{
    if (!reserve_data(p, n)) return;
    memcpy(p->data + p->n_data, text, n);
    p->n_data += n;
}

/* Numbers as text into numbers of the host. */
static void decode_ascii(parsing *p, size_t n_numbers, size_t width)
{
    const char *at = (const char *)p->data, *end = at + p->n_data;
    size_t n = 0;
    if (n_numbers > (p->n_data + 1) / 2) { /* a digit and a blank each */
        stop_count(p, (p->n_data + 1) / 2, n_numbers, "numbers");
        return;
    }
    uint8_t *bytes = loxo_allocate(p->xml.ctx, (int64_t)n_numbers, width);
    if (bytes == NULL) {
        stop(p, LOXO_ERR_MEMORY);
        return;
    }
    p->array.bytes = bytes;
    for (;; ++n) {
        while (at < end && loxo_is_space(*at))
            ++at;
        if (at == end) break;
        if (n == n_numbers) {
            stop_count(p, n + 1, n_numbers, "numbers");
            return;
        }
        double value = 0.0;
        int64_t integer = 0;
        loxo_scan scan;
        if (p->array.type == LOXO_GIFTI_INT32) {
            scan = loxo_scan_int64(&at, end, &integer);
            if (scan == LOXO_SCAN_OK && (integer < INT32_MIN || integer > INT32_MAX)) scan = LOXO_SCAN_OVERFLOW;
            const int32_t narrow = scan == LOXO_SCAN_OK ? (int32_t)integer : 0;
            memcpy(bytes + n * width, &narrow, width);
        } else {
            scan = loxo_scan_double(&at, end, &value);
            if (scan == LOXO_SCAN_NONFINITE) scan = LOXO_SCAN_OK;
            const float narrow = (float)value;
            if (width == 4)
                memcpy(bytes + n * width, &narrow, width);
            else
                memcpy(bytes + n * width, &value, width);
        }
        if (scan != LOXO_SCAN_OK) {
            stop(p, loxo_fail_at(p->xml.ctx, LOXO_ERR_MALFORMED, at_array(p),
                                 "DataArray: number %zu is none of its type", n));
            return;
        }
    }
    if (n < n_numbers) stop_count(p, n, n_numbers, "numbers");
}

static void inflate_data(parsing *p, size_t n_wanted)
{
    uint8_t *bytes = NULL;
    size_t n = 0;
    const loxo_status status =
        loxo_source_inflate(p->xml.ctx, p->data, p->n_data, true, p->xml.name, n_wanted, &bytes, &n);
    if (status == LOXO_ERR_LIMIT) {
        stop_count(p, n_wanted + 1, n_wanted, "bytes");
    } else if (status == LOXO_ERR_MALFORMED) {
        /* Its byte is one of the compressed data, not of the file. */
        char text[256];
        const char *why = loxo_context_failure(p->xml.ctx)->text;
        const size_t n_why = strlen(why) < sizeof text ? strlen(why) : sizeof text - 1;
        memcpy(text, why, n_why);
        text[n_why] = '\0';
        stop_array(p, status, text);
    } else if (status < 0) {
        stop(p, status);
    } else {
        loxo_release(p->xml.ctx, p->data);
        p->data = bytes;
        p->n_data = p->capacity = n;
    }
}

static void finish_data(parsing *p)
{
    loxo_gifti_array *array = &p->array;
    const size_t width = array->type == LOXO_GIFTI_FLOAT64 ? 8 : 4;
    const size_t n_numbers = (size_t)(array->n_rows * array->n_columns), n_wanted = n_numbers * width;
    if (array->encoding == LOXO_GIFTI_ASCII) {
        decode_ascii(p, n_numbers, width);
        return;
    }
    if (!loxo_base64_decode(p->data, &p->n_data)) {
        stop_array(p, LOXO_ERR_MALFORMED, "the data is not valid Base64");
        return;
    }
    if (array->encoding == LOXO_GIFTI_GZIP && n_wanted > 0) inflate_data(p, n_wanted);
    if (p->xml.status < 0) return;
    if (p->n_data != n_wanted && !(array->encoding == LOXO_GIFTI_GZIP && n_wanted == 0)) {
        stop_count(p, p->n_data, n_wanted, "bytes");
        return;
    }
    array->bytes = p->data;
    p->data = NULL;
    p->capacity = 0;
}

static void end_array(parsing *p)
{
    if (p->is_wanted) {
        if (!p->has_data) {
            stop_array(p, LOXO_ERR_MALFORMED, "it has no Data");
            return;
        }
        p->take(p->user, &p->array);
        p->array.bytes = NULL;
    }
    ++p->n_arrays;
    p->in_array = false;
    p->is_wanted = false;
}

/* ---- what expat calls ---------------------------------------------------------------------------------------- */

static void XMLCALL on_start(void *user, const char *element, const char **attributes)
{
    parsing *p = user;
    if (!loxo_xml_enter(&p->xml)) return;
    if (p->in_data) {
        stop_malformed(p, "an element inside Data");
        return;
    }
    p->text = NULL;
    if (p->xml.depth == 1) {
        if (strcmp(element, "GIFTI") != 0) stop_malformed(p, "XML, but no GIFTI: the outermost element is another one");
        if (!parse_count(attribute(attributes, "NumberOfDataArrays"), &p->n_announced)) p->n_announced = -1;
    } else if (p->xml.depth == 2 && strcmp(element, "DataArray") == 0) {
        begin_array(p, attributes);
    } else if (p->xml.depth == 2) {
        p->in_labels = p->take_label != NULL && strcmp(element, "LabelTable") == 0;
    } else if (p->xml.depth == 3 && p->in_labels && strcmp(element, "Label") == 0) {
        const char *key = attribute(attributes, "Key"); /* "Index" in early files */
        p->has_label = parse_number(key != NULL ? key : attribute(attributes, "Index"), &p->label);
        p->text = p->value;
        p->n_text = 0;
        p->text[0] = '\0';
    } else if (p->xml.depth == 3 && p->in_array && strcmp(element, "Data") == 0) {
        if (p->has_data) stop_malformed(p, "DataArray: a second Data");
        p->has_data = true;
        p->in_data = true;
        p->n_data = 0;
        if (p->is_wanted) reserve_data(p, 1); /* a pointer even where no text follows */
    } else if (p->xml.depth == 5 && p->in_array && p->is_wanted) {
        p->text = strcmp(element, "Name") == 0 ? p->key : strcmp(element, "Value") == 0 ? p->value : NULL;
        p->n_text = 0;
        if (p->text != NULL) p->text[0] = '\0';
    }
}

static void XMLCALL on_end(void *user, const char *element)
{
    parsing *p = user;
    if (p->xml.status < 0) return;
    p->text = NULL;
    if (p->xml.depth == 3 && p->in_labels && strcmp(element, "Label") == 0) {
        if (p->has_label) p->take_label(p->user, p->label, p->value);
    } else if (p->xml.depth == 4 && p->in_array && p->is_wanted && strcmp(p->key, "Name") == 0) {
        copy_text(p->array.name, p->value);
        p->key[0] = '\0';
    } else if (p->xml.depth == 3 && p->in_data) {
        p->in_data = false;
        if (p->is_wanted) finish_data(p);
    } else if (p->xml.depth == 2 && p->in_array) {
        end_array(p);
    }
    loxo_xml_leave(&p->xml);
}

static void XMLCALL on_text(void *user, const char *text, int n)
{
    parsing *p = user;
    if (p->xml.status < 0) return;
    if (p->in_data) {
        if (p->is_wanted) append_data(p, text, (size_t)n);
    } else if (p->text != NULL) {
        for (int i = 0; i < n && p->n_text < 63; ++i)
            p->text[p->n_text++] = text[i];
        p->text[p->n_text] = '\0';
    }
}

/* ---- the document -------------------------------------------------------------------------------------------- */

static loxo_status feed(parsing *p, const uint8_t *bytes, size_t n)
{
    const loxo_status status = loxo_xml_feed(&p->xml, bytes, n);
    if (status >= 0 && p->n_announced >= 0 && p->n_announced != p->n_arrays)
        loxo_warn(p->xml.ctx, "gifti-arrays", 1, "%s: %" PRId64 " arrays announced, %" PRId64 " found", p->xml.name,
                  p->n_announced, p->n_arrays);
    return status;
}

static loxo_status begin(parsing *p) { return loxo_xml_begin(&p->xml, on_start, on_end, on_text); }

static void end(parsing *p)
{
    loxo_xml_end(&p->xml);
    loxo_release(p->xml.ctx, p->data);
    loxo_release(p->xml.ctx, p->array.bytes);
}

loxo_status loxo_gifti_parse(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name,
                             loxo_gifti_want_fn want, loxo_gifti_take_fn take, loxo_gifti_label_fn take_label,
                             void *user)
{
    parsing p = {.xml = {.ctx = ctx, .name = name, .kind = "GIFTI"},
                 .want = want,
                 .take = take,
                 .take_label = take_label,
                 .user = user,
                 .n_announced = -1};
    if (n == 0)
        return loxo_fail_at(ctx, LOXO_ERR_MALFORMED, (loxo_place){.file = name, .byte = 0, .element = -1},
                            "empty file");
    loxo_status status = begin(&p);
    if (status < 0) return status;
    status = feed(&p, bytes, n);
    end(&p);
    return status;
}

loxo_status loxo_gifti_parse_flow(loxo_flow *flow, const uint8_t *bytes, size_t n, loxo_gifti_want_fn want,
                                  loxo_gifti_enough_fn is_enough, void *user)
{
    parsing p = {
        .xml = {.ctx = flow->ctx, .name = flow->name, .kind = "GIFTI"}, .want = want, .user = user, .n_announced = -1};
    size_t at = 0;
    uint8_t *buffer = loxo_allocate(flow->ctx, FEED_BYTES, 1);
    loxo_status status = buffer == NULL ? LOXO_ERR_MEMORY : begin(&p);
    if (status < 0) goto done;
    for (;;) {
        if ((status = loxo_xml_feed_piece(&p.xml, bytes, n, at, n == 0)) < 0 || n == 0 || is_enough(user)) break;
        at += n;
        if ((status = loxo_flow_read(flow, buffer, FEED_BYTES, &n)) < 0) break;
        bytes = buffer;
        if (!loxo_stop_wanted(p.xml.ctx, "read", -1.0)) continue;
        status = loxo_fail_at(p.xml.ctx, LOXO_ERR_STOPPED, here(&p), "stopped while reading");
        break;
    }
    end(&p);
done:
    loxo_release(flow->ctx, buffer);
    return status;
}

#else

loxo_status loxo_gifti_parse(loxo_context *ctx, const uint8_t *bytes, size_t n, const char *name,
                             loxo_gifti_want_fn want, loxo_gifti_take_fn take, loxo_gifti_label_fn take_label,
                             void *user)
{
    (void)bytes, (void)n, (void)want, (void)take, (void)take_label, (void)user;
    return loxo_fail_at(ctx, LOXO_ERR_UNSUPPORTED, (loxo_place){.file = name, .byte = -1, .element = -1},
                        "GIFTI needs expat, which this build lacks");
}

loxo_status loxo_gifti_parse_flow(loxo_flow *flow, const uint8_t *bytes, size_t n, loxo_gifti_want_fn want,
                                  loxo_gifti_enough_fn is_enough, void *user)
{
    (void)is_enough;
    return loxo_gifti_parse(flow->ctx, bytes, n, flow->name, want, NULL, NULL, user);
}

#endif
