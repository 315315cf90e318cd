/* SPDX-License-Identifier: MIT */
#include "io/xml.h"

#include "io/scan.h"

#include <string.h>

#ifdef LOXO_WITH_EXPAT

#define MAX_DEPTH   64
#define TOKEN_BYTES ((int64_t)1 << 20) /* longest tag or comment: expat holds it in memory of its own */

loxo_place loxo_xml_here(const loxo_xml *xml)
{
    return (loxo_place){.file = xml->name,
                        .line = (int64_t)XML_GetCurrentLineNumber(xml->parser),
                        .byte = (int64_t)XML_GetCurrentByteIndex(xml->parser),
                        .element = -1};
}

void loxo_xml_stop(loxo_xml *xml, loxo_status status)
{
    if (xml->status < 0) return;
    xml->status = status;
    XML_StopParser(xml->parser, XML_FALSE);
}

void loxo_xml_stop_malformed(loxo_xml *xml, const char *text)
{
    if (xml->status >= 0)
        loxo_xml_stop(xml, loxo_fail_at(xml->ctx, LOXO_ERR_MALFORMED, loxo_xml_here(xml), "%s", text));
}

bool loxo_xml_enter(loxo_xml *xml)
{
    if (xml->status < 0) return false;
    if (++xml->depth <= MAX_DEPTH) return true;
    loxo_xml_stop(
        xml, loxo_fail_at(xml->ctx, LOXO_ERR_LIMIT, loxo_xml_here(xml), "elements lie more than %d deep", MAX_DEPTH));
    return false;
}

const char *loxo_xml_attribute(const char **attributes, const char *key)
{
    for (; attributes[0] != NULL; attributes += 2)
        if (strcmp(attributes[0], key) == 0) return attributes[1];
    return NULL;
}

bool loxo_xml_integer(const char *text, int64_t *value)
{
    const char *at = text, *end = text == NULL ? NULL : text + strlen(text);
    return text != NULL && loxo_scan_int64(&at, end, value) == LOXO_SCAN_OK && at == end;
}

/* ---- what is refused ----------------------------------------------------------------------------------------- */

static void XMLCALL on_doctype(void *user, const char *name, const char *system_id, const char *public_id,
                               int has_internal_subset)
{
    (void)name, (void)system_id, (void)public_id;
    if (has_internal_subset != 0) loxo_xml_stop_malformed(user, "a DOCTYPE with declarations of its own is refused");
}

static void XMLCALL on_entity(void *user, const char *name, int is_parameter, const char *value, int n_value,
                              const char *base, const char *system_id, const char *public_id, const char *notation)
{
    (void)name, (void)is_parameter, (void)value, (void)n_value;
    (void)base, (void)system_id, (void)public_id, (void)notation;
    loxo_xml_stop_malformed(user, "entity declarations are refused");
}

static void XMLCALL on_skipped_entity(void *user, const char *name, int is_parameter)
{
    (void)name, (void)is_parameter;
    loxo_xml_stop_malformed(user, "a reference to an entity that is not defined");
}

/* ---- the document -------------------------------------------------------------------------------------------- */

static loxo_status fail_memory(const loxo_xml *xml)
{
    return loxo_fail(xml->ctx, LOXO_ERR_MEMORY, "%s: no memory for the XML parser", xml->kind);
}

loxo_status loxo_xml_begin(loxo_xml *xml, XML_StartElementHandler on_start, XML_EndElementHandler on_end,
                           XML_CharacterDataHandler on_text)
{
    xml->parser = XML_ParserCreate(NULL);
    if (xml->parser == NULL) return fail_memory(xml);
    XML_SetUserData(xml->parser, xml);
    XML_SetElementHandler(xml->parser, on_start, on_end);
    XML_SetCharacterDataHandler(xml->parser, on_text);
    XML_SetStartDoctypeDeclHandler(xml->parser, on_doctype);
    XML_SetEntityDeclHandler(xml->parser, on_entity);
    XML_SetSkippedEntityHandler(xml->parser, on_skipped_entity);
    return LOXO_OK;
}

void loxo_xml_end(loxo_xml *xml)
{
    XML_ParserFree(xml->parser);
    xml->parser = NULL;
}

static loxo_status fail_xml(const loxo_xml *xml)
{
    const enum XML_Error error = XML_GetErrorCode(xml->parser);
    if (xml->status < 0) return xml->status;
    if (error == XML_ERROR_NO_MEMORY) return fail_memory(xml);
    return loxo_fail_at(xml->ctx, LOXO_ERR_MALFORMED, loxo_xml_here(xml), "XML: %s", XML_ErrorString(error));
}

loxo_status loxo_xml_feed_piece(loxo_xml *xml, const uint8_t *bytes, size_t n, size_t n_before, bool is_last)
{
    if (XML_Parse(xml->parser, (const char *)bytes, (int)n, is_last) != XML_STATUS_OK) return fail_xml(xml);
    if (xml->status < 0) return xml->status;
    if ((int64_t)(n_before + n) - (int64_t)XML_GetCurrentByteIndex(xml->parser) > TOKEN_BYTES)
        return loxo_fail_at(xml->ctx, LOXO_ERR_LIMIT, loxo_xml_here(xml), "XML: a tag or comment of more than 1 MiB");
    return LOXO_OK;
}

loxo_status loxo_xml_feed(loxo_xml *xml, const uint8_t *bytes, size_t n)
{
    for (size_t at = 0; at < n;) {
        const size_t n_now = n - at < LOXO_XML_FEED_BYTES ? n - at : LOXO_XML_FEED_BYTES;
        const loxo_status status = loxo_xml_feed_piece(xml, bytes + at, n_now, at, at + n_now == n);
        if (status < 0) return status;
        at += n_now;
        if (loxo_stop_wanted(xml->ctx, "read", (double)at / (double)n))
            return loxo_fail_at(xml->ctx, LOXO_ERR_STOPPED, loxo_xml_here(xml), "stopped while reading");
    }
    return LOXO_OK;
}

#endif
