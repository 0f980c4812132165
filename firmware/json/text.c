/* SPDX-License-Identifier: MIT */
#include "firmware/json/text.h"

#include "firmware/json/json.h"

static uint8_t byte_at(const char *text, uint32_t at) {
    return (uint8_t)text[at];
}

/* RFC 3629 §4: by the first byte, the number of following bytes and the range of the second one;
 * the others are 80 … BF. */
struct utf8_form {
    uint8_t first_low, first_high, second_low, second_high, length;
};
static const struct utf8_form UTF8_FORMS[] = {
    {0x00, 0x7F, 0x00, 0x00, 1}, {0xC2, 0xDF, 0x80, 0xBF, 2}, {0xE0, 0xE0, 0xA0, 0xBF, 3},
    {0xE1, 0xEC, 0x80, 0xBF, 3}, {0xED, 0xED, 0x80, 0x9F, 3}, {0xEE, 0xEF, 0x80, 0xBF, 3},
    {0xF0, 0xF0, 0x90, 0xBF, 4}, {0xF1, 0xF3, 0x80, 0xBF, 4}, {0xF4, 0xF4, 0x80, 0x8F, 4},
};

static const struct utf8_form *utf8_form(uint8_t first) {
    for (unsigned i = 0; i < sizeof UTF8_FORMS / sizeof UTF8_FORMS[0]; ++i) {
        if (first >= UTF8_FORMS[i].first_low && first <= UTF8_FORMS[i].first_high)
            return &UTF8_FORMS[i];
    }
    return 0;
}

/* Bytes of the UTF-8 character that begins at text[at] (RFC 3629: no overlong forms, no surrogates,
 * nothing above U+10FFFF); 0 when it is not valid. at < length. */
static uint32_t utf8_length(const char *text, uint32_t length, uint32_t at) {
    const struct utf8_form *form = utf8_form(byte_at(text, at));
    if (!form || form->length > length - at) return 0;
    if (form->length == 1) return 1;
    const uint8_t second = byte_at(text, at + 1);
    if (second < form->second_low || second > form->second_high) return 0;
    for (uint32_t i = 2; i < form->length; ++i) {
        if ((byte_at(text, at + i) & 0xC0) != 0x80) return 0;
    }
    return form->length;
}

/* in : `length` bytes of one valid character. out: its code point */
static uint32_t code_point(const char *text, uint32_t length) {
    uint32_t code = byte_at(text, 0);
    if (length > 1) code &= 0x7Fu >> length;
    for (uint32_t i = 1; i < length; ++i) code = code << 6 | (byte_at(text, i) & 0x3Fu);
    return code;
}

uint32_t cb_control_length(const char *text, uint32_t length, uint32_t at) {
    static const struct {
        uint16_t first, last;
    } controls[] = {{0x0000, 0x001F}, {0x007F, 0x009F}, {0x061C, 0x061C},
                    {0x200E, 0x200F}, {0x2028, 0x202E}, {0x2066, 0x2069}};
    const uint32_t bytes = utf8_length(text, length, at);
    if (bytes == 0) return 0;
    const uint32_t code = code_point(text + at, bytes);
    for (unsigned i = 0; i < sizeof controls / sizeof controls[0]; ++i) {
        if (code >= controls[i].first && code <= controls[i].last) return bytes;
    }
    return 0;
}

uint32_t cb_hex_digit(char c) {
    if (c >= '0' && c <= '9') return (uint32_t)(c - '0');
    if (c >= 'a' && c <= 'f') return (uint32_t)(c - 'a') + 10;
    if (c >= 'A' && c <= 'F') return (uint32_t)(c - 'A') + 10;
    return 16;
}

/* in : at: the expected place of "\u"
 * out: true and its 16 bits, if "\u" and four hexadecimal digits are there */
static bool unicode_escape(const char *text, uint32_t length, uint32_t at, uint32_t *unit) {
    if (length - at < 6 || text[at] != '\\' || text[at + 1] != 'u') return false;
    *unit = 0;
    for (uint32_t i = 2; i < 6; ++i) {
        const uint32_t digit = cb_hex_digit(text[at + i]);
        if (digit > 15) return false;
        *unit = *unit * 16 + digit;
    }
    return true;
}

static bool is_high_surrogate(uint32_t unit) {
    return unit >= 0xD800 && unit <= 0xDBFF;
}

static bool is_low_surrogate(uint32_t unit) {
    return unit >= 0xDC00 && unit <= 0xDFFF;
}

/* out: the character of a one-letter escape; 0 for another letter */
static char simple_escape(char letter) {
    static const char letters[] = "\"\\/bfnrt";
    static const char meanings[] = "\"\\/\b\f\n\r\t";
    for (unsigned i = 0; letters[i]; ++i) {
        if (letters[i] == letter) return meanings[i];
    }
    return 0;
}

/* in : text[at] is a backslash
 * out: NULL and the length of the escape (or pair of surrogates) in bytes, or a sentence */
static const char *scan_escape(const char *text, uint32_t length, uint32_t at, uint32_t *bytes) {
    uint32_t unit = 0, low = 0;
    *bytes = 2;
    if (length - at < 2) return "the text ends inside double quotes";
    if (simple_escape(text[at + 1])) return 0;
    if (text[at + 1] != 'u') return "unknown escape; a backslash itself is written \\\\";
    if (!unicode_escape(text, length, at, &unit)) return "four hexadecimal digits must follow \\u";
    *bytes = 6;
    if (is_low_surrogate(unit)) return "a low surrogate without its high one";
    if (!is_high_surrogate(unit)) return 0;
    *bytes = 12;
    if (!unicode_escape(text, length, at + 6, &low) || !is_low_surrogate(low))
        return "a high surrogate without its low one";
    return 0;
}

const char *cb_json_scan_string(const char *text, uint32_t length, uint32_t *at) {
    const char *mistake = 0;
    uint32_t bytes = 0;
    for (++*at; *at < length; *at += bytes) {
        const char c = text[*at];
        if (c == '"') {
            ++*at;
            return 0;
        }
        if ((uint8_t)c < 0x20) return "a control character inside a text; is a quote missing?";
        if (c == '\\') {
            mistake = scan_escape(text, length, *at, &bytes);
        } else {
            bytes = utf8_length(text, length, *at);
            mistake = bytes > 0 ? 0 : "a byte that is not UTF-8; save the file as UTF-8";
        }
        if (mistake) return mistake;
    }
    return "the text ends inside double quotes";
}

/* in : code point; bytes[4]
 * out: its UTF-8 form and length */
static uint32_t utf8_encode(uint32_t code, char *bytes) {
    static const uint8_t lead[] = {0, 0x00, 0xC0, 0xE0, 0xF0};
    const uint32_t length = code < 0x80 ? 1 : code < 0x800 ? 2 : code < 0x10000 ? 3 : 4;
    for (uint32_t i = length - 1; i > 0; --i, code >>= 6) bytes[i] = (char)(0x80 | (code & 0x3F));
    bytes[0] = (char)(lead[length] | code);
    return length;
}

/* in : text[at]: any place of a valid string
 * out: the bytes of one character and their number; *taken: its length in the text */
static uint32_t decode(const char *text, uint32_t at, char *bytes, uint32_t *taken) {
    uint32_t unit = 0, low = 0;
    *taken = 1;
    bytes[0] = text[at];
    if (text[at] != '\\') return 1;
    *taken = 2;
    bytes[0] = simple_escape(text[at + 1]);
    if (bytes[0]) return 1;
    unicode_escape(text, at + 6, at, &unit);
    *taken = 6;
    if (!is_high_surrogate(unit)) return utf8_encode(unit, bytes);
    unicode_escape(text, at + 12, at + 6, &low);
    *taken = 12;
    return utf8_encode(0x10000 + ((unit - 0xD800) << 10) + (low - 0xDC00), bytes);
}

uint32_t cb_json_text(const char *text, struct cb_json_token token, char *buffer, uint32_t size) {
    const uint32_t end = token.at + token.length - 1;
    uint32_t length = 0, taken = 0;
    for (uint32_t at = token.at + 1; at < end; at += taken) {
        char bytes[4];
        const uint32_t count = decode(text, at, bytes, &taken);
        if (count > size - length) return size + 1;
        for (uint32_t i = 0; i < count; ++i) buffer[length++] = bytes[i];
    }
    return length;
}
