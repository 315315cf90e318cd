/* SPDX-License-Identifier: MIT
 * GIFTI 1.0: arrays little endian in Base64, packed by zlib where the build has it. Positions and fields are FLOAT32
 * where that loses nothing (the width all programs take) and FLOAT64 elsewhere. */
#include "base/context.h"
#include "io/base64.h"
#include "io/writers.h"
#include "loxo_config.h"

#ifdef LOXO_WITH_ZLIB
#include <zlib.h>
#endif

#define CHUNK_BYTES ((size_t)3 * 1024) /* a multiple of 3; its Base64 fits the stream's room */

typedef enum element_kind { KIND_FLOAT, KIND_DOUBLE, KIND_DOUBLE_AS_FLOAT, KIND_INDEX } element_kind;

/* Bytes on their way through zlib and Base64 into the stream. */
typedef struct packer {
    loxo_stream *stream;
#ifdef LOXO_WITH_ZLIB
    z_stream zlib;
#endif
    size_t used;
    unsigned char chunk[CHUNK_BYTES];
} packer;

static void put_base64(loxo_stream *stream, const unsigned char *bytes, size_t n)
{
    stream->used += loxo_base64_encode(bytes, n, loxo_stream_room(stream, LOXO_STREAM_ROOM));
}

#ifdef LOXO_WITH_ZLIB

#define ENCODING "GZipBase64Binary"

static voidpf zlib_allocate(voidpf ctx, uInt count, uInt size) { return loxo_allocate(ctx, (int64_t)count, size); }
static void zlib_release(voidpf ctx, voidpf block) { loxo_release(ctx, block); }

static loxo_status encoder_begin(packer *encoder)
{
    encoder->used = 0;
    encoder->zlib = (z_stream){.zalloc = zlib_allocate, .zfree = zlib_release, .opaque = encoder->stream->ctx};
    /* The fastest level: coordinates hardly pack any better at the others. */
    return deflateInit(&encoder->zlib, Z_BEST_SPEED) == Z_OK ? LOXO_OK : LOXO_ERR_MEMORY;
}

static void encoder_run(packer *encoder, const unsigned char *bytes, size_t n, int flush)
{
    z_stream *z = &encoder->zlib;
    unsigned char copy[CHUNK_BYTES]; /* zlib's interface lacks a const */
    do {
        const size_t n_now = n < sizeof copy ? n : sizeof copy;
        memcpy(copy, bytes, n_now);
        bytes += n_now;
        n -= n_now;
        z->next_in = copy;
        z->avail_in = (uInt)n_now;
        int result;
        do {
            z->next_out = encoder->chunk + encoder->used;
            z->avail_out = (uInt)(CHUNK_BYTES - encoder->used);
            result = deflate(z, n == 0 ? flush : Z_NO_FLUSH);
            encoder->used = CHUNK_BYTES - z->avail_out;
            if (encoder->used == CHUNK_BYTES) {
                put_base64(encoder->stream, encoder->chunk, CHUNK_BYTES);
                encoder->used = 0;
            }
        } while (result == Z_OK && (z->avail_in > 0 || z->avail_out == 0 || flush == Z_FINISH));
    } while (n > 0);
}

static void encoder_put(packer *encoder, const unsigned char *bytes, size_t n)
{
    encoder_run(encoder, bytes, n, Z_NO_FLUSH);
}

static void encoder_end(packer *encoder)
{
    encoder_run(encoder, encoder->chunk, 0, Z_FINISH);
    deflateEnd(&encoder->zlib);
    put_base64(encoder->stream, encoder->chunk, encoder->used);
}

#else

#define ENCODING "Base64Binary"

static loxo_status encoder_begin(packer *encoder)
{
    encoder->used = 0;
    return LOXO_OK;
}

static void encoder_put(packer *encoder, const unsigned char *bytes, size_t n)
{
    while (n > 0) {
        const size_t room = CHUNK_BYTES - encoder->used, n_now = n < room ? n : room;
        memcpy(encoder->chunk + encoder->used, bytes, n_now);
        bytes += n_now;
        n -= n_now;
        encoder->used += n_now;
        if (encoder->used < CHUNK_BYTES) continue;
        put_base64(encoder->stream, encoder->chunk, CHUNK_BYTES);
        encoder->used = 0;
    }
}

static void encoder_end(packer *encoder) { put_base64(encoder->stream, encoder->chunk, encoder->used); }

#endif

static bool fits_float(const double *value, int64_t n)
{
    for (int64_t i = 0; i < n; ++i) {
        if (value[i] - value[i] == 0.0 && !(value[i] >= -3.4028234663852886e38 && value[i] <= 3.4028234663852886e38))
            return false;
        if (value[i] == value[i] && (double)(float)value[i] != value[i]) return false;
    }
    return true;
}

static void encode(packer *encoder, const void *elements, int64_t n, element_kind kind)
{
    unsigned char bytes[1024];
    const size_t width = kind == KIND_DOUBLE ? 8 : 4;
    size_t used = 0;
    for (int64_t i = 0; i < n; ++i, used += width) {
        if (used + width > sizeof bytes) {
            encoder_put(encoder, bytes, used);
            used = 0;
        }
        switch (kind) {
        case KIND_FLOAT: loxo_store_f32(bytes + used, ((const float *)elements)[i]); break;
        case KIND_DOUBLE: loxo_store_f64(bytes + used, ((const double *)elements)[i]); break;
        case KIND_DOUBLE_AS_FLOAT: loxo_store_f32(bytes + used, (float)((const double *)elements)[i]); break;
        case KIND_INDEX: loxo_store_u32(bytes + used, (uint32_t)((const loxo_index *)elements)[i]); break;
        }
    }
    encoder_put(encoder, bytes, used);
}

static void write_meta(loxo_stream *stream, const char *key, const char *text)
{
    loxo_stream_format(stream, "    <MetaData>\n      <MD><Name>%s</Name><Value>", key);
    loxo_stream_xml(stream, text);
    loxo_stream_text(stream, "</Value></MD>\n    </MetaData>\n");
}

static loxo_status write_array(loxo_stream *stream, const char *intent, const char *name, const void *elements,
                               int64_t n_rows, int n_columns, element_kind kind)
{
    packer encoder;
    encoder.stream = stream;
    const loxo_status status = encoder_begin(&encoder);
    if (status < 0) return status;
    loxo_stream_format(stream, "  <DataArray Intent=\"%s\" DataType=\"%s\" ArrayIndexingOrder=\"RowMajorOrder\" ",
                       intent,
                       kind == KIND_INDEX    ? "NIFTI_TYPE_INT32"
                       : kind == KIND_DOUBLE ? "NIFTI_TYPE_FLOAT64"
                                             : "NIFTI_TYPE_FLOAT32");
    if (n_columns == 1) {
        loxo_stream_format(stream, "Dimensionality=\"1\" Dim0=\"%lld\" ", (long long)n_rows);
    } else {
        loxo_stream_format(stream, "Dimensionality=\"2\" Dim0=\"%lld\" Dim1=\"%d\" ", (long long)n_rows, n_columns);
    }
    loxo_stream_text(stream, "Encoding=\"" ENCODING "\" Endian=\"LittleEndian\" ExternalFileName=\"\" "
                             "ExternalFileOffset=\"\">\n");
    if (name != NULL)
        write_meta(stream, "Name", name);
    else
        loxo_stream_text(stream, "    <MetaData/>\n");
    if (strcmp(intent, "NIFTI_INTENT_POINTSET") == 0)
        loxo_stream_text(stream, "    <CoordinateSystemTransformMatrix>\n"
                                 "      <DataSpace>NIFTI_XFORM_UNKNOWN</DataSpace>\n"
                                 "      <TransformedSpace>NIFTI_XFORM_UNKNOWN</TransformedSpace>\n"
                                 "      <MatrixData>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</MatrixData>\n"
                                 "    </CoordinateSystemTransformMatrix>\n");
    loxo_stream_text(stream, "    <Data>");
    encode(&encoder, elements, n_rows * n_columns, kind);
    encoder_end(&encoder);
    loxo_stream_text(stream, "</Data>\n  </DataArray>\n");
    return LOXO_OK;
}

static loxo_status write_doubles(loxo_stream *stream, const char *intent, const char *name, const double *value,
                                 int64_t n_rows, int n_columns)
{
    return write_array(stream, intent, name, value, n_rows, n_columns,
                       fits_float(value, n_rows * n_columns) ? KIND_DOUBLE_AS_FLOAT : KIND_DOUBLE);
}

static void begin_file(loxo_stream *stream, int n_arrays, const char *comment)
{
    loxo_stream_format(stream,
                       "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n"
                       "<!DOCTYPE GIFTI SYSTEM \"http://www.nitrc.org/frs/download.php/115/gifti.dtd\">\n"
                       "<GIFTI Version=\"1.0\" NumberOfDataArrays=\"%d\">\n",
                       n_arrays);
    if (comment != NULL)
        write_meta(stream, "Comment", comment);
    else
        loxo_stream_text(stream, "  <MetaData/>\n");
    loxo_stream_text(stream, "  <LabelTable/>\n");
}

loxo_status loxo_write_gifti(loxo_stream *stream, const loxo_soup *soup, const char *comment)
{
    const int n_fields = soup->n_fields > 0 ? 1 : 0;
    loxo_status status;
    if (soup->n_fields > 1)
        loxo_warn(stream->ctx, "write fields", soup->n_fields - 1, "%d fields were not written: GIFTI takes the first",
                  soup->n_fields - 1);
    begin_file(stream, 2 + n_fields, comment);
    if (soup->position_float != NULL)
        status =
            write_array(stream, "NIFTI_INTENT_POINTSET", NULL, soup->position_float, soup->n_vertices, 3, KIND_FLOAT);
    else
        status = write_doubles(stream, "NIFTI_INTENT_POINTSET", NULL, soup->position, soup->n_vertices, 3);
    if (status < 0) return status;
    status = write_array(stream, "NIFTI_INTENT_TRIANGLE", NULL, soup->triangle, soup->n_faces, 3, KIND_INDEX);
    if (status < 0) return status;
    if (n_fields > 0) {
        status = write_doubles(stream, "NIFTI_INTENT_SHAPE", soup->fields[0].name, soup->fields[0].value,
                               soup->n_vertices, 1);
        if (status < 0) return status;
    }
    loxo_stream_text(stream, "</GIFTI>\n");
    return LOXO_OK;
}

loxo_status loxo_write_gifti_field(loxo_stream *stream, const char *name, const double *value, int64_t n,
                                   const char *comment)
{
    begin_file(stream, 1, comment);
    const loxo_status status = write_doubles(stream, "NIFTI_INTENT_SHAPE", name, value, n, 1);
    if (status < 0) return status;
    loxo_stream_text(stream, "</GIFTI>\n");
    return LOXO_OK;
}
