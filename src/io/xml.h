/* SPDX-License-Identifier: MIT
 * XML of files that nobody vouches for, read by expat as a stream: no entity is ever expanded, no other file opened, nothing
 * recurses, and memory follows the bytes that are there. */
#ifndef LOXO_IO_XML_H
#define LOXO_IO_XML_H

#include "base/context.h"
#include "loxo_config.h"

#ifdef LOXO_WITH_EXPAT

#include <expat.h>

#define LOXO_XML_FEED_BYTES 65536

/* First in a reader's own struct, which is then the user of expat's handlers. */
typedef struct loxo_xml {
    loxo_context *ctx;
    const char *name; /* of the file */
    const char *kind; /* "GIFTI", for messages */
    XML_Parser parser;
    loxo_status status; /* negative: stopped */
    int depth;          /* of the element that is open */
} loxo_xml;

/* ctx, name and kind are set. loxo_xml_end is fine after a failure too. */
loxo_status loxo_xml_begin(loxo_xml *xml, XML_StartElementHandler on_start, XML_EndElementHandler on_end,
                           XML_CharacterDataHandler on_text);
void loxo_xml_end(loxo_xml *xml);

/* The first thing that a handler of starts does, and the last of one of ends; false: nothing is to be done. */
bool loxo_xml_enter(loxo_xml *xml);
static inline void loxo_xml_leave(loxo_xml *xml) { --xml->depth; }

loxo_place loxo_xml_here(const loxo_xml *xml);
void loxo_xml_stop(loxo_xml *xml, loxo_status status);
void loxo_xml_stop_malformed(loxo_xml *xml, const char *text);

/* The value of an attribute; NULL when there is none. */
const char *loxo_xml_attribute(const char **attributes, const char *key);
/* An attribute's value that is an integer and nothing else; text may be NULL. */
bool loxo_xml_integer(const char *text, int64_t *value);

/* A piece of the document, at most INT_MAX bytes; n_before: those before it. */
loxo_status loxo_xml_feed_piece(loxo_xml *xml, const uint8_t *bytes, size_t n, size_t n_before, bool is_last);
/* All of it, looking at the monitor. */
loxo_status loxo_xml_feed(loxo_xml *xml, const uint8_t *bytes, size_t n);

#endif
#endif
