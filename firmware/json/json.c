/* SPDX-License-Identifier: MIT
 * The grammar, one function for each kind of next token. Texts: text.c. */
#include "firmware/json/json.h"

#include "firmware/json/text.h"

enum expect {
    VALUE,         /* a value: at the start, after a colon */
    FIRST_ELEMENT, /* a value or ] */
    FIRST_KEY,     /* a key or } */
    SEPARATOR,     /* a comma or the container's end */
    NOTHING,       /* white space only: the root is complete */
    STOPPED,       /* after a syntax error */
};

void cb_json_start(struct cb_json *json, const char *text, uint32_t length, uint32_t at) {
    json->text = text;
    json->length = length;
    json->at = at;
    json->objects = 0;
    json->depth = 0;
    json->expect = VALUE;
    json->mistake = 0;
}

static struct cb_json_token bad(struct cb_json *json, uint32_t at, const char *mistake) {
    json->at = at;
    json->expect = STOPPED;
    json->mistake = mistake;
    return (struct cb_json_token){CB_JSON_BAD, at, 0};
}

/* out: the byte at json->at, or 0 at the end, because a real 0 is an error everywhere */
static char peek(const struct cb_json *json) {
    return json->at < json->length ? json->text[json->at] : '\0';
}

static bool is_digit(char c) {
    return c >= '0' && c <= '9';
}

static void skip_space(struct cb_json *json) {
    for (char c = peek(json); c == ' ' || c == '\n' || c == '\r' || c == '\t'; c = peek(json))
        ++json->at;
}

/* in : depth > 0 */
static bool in_object(const struct cb_json *json) {
    return ((json->objects >> (json->depth - 1)) & 1u) != 0;
}

/* Completes a value; its container determines the next token. */
static struct cb_json_token complete(struct cb_json *json, enum cb_json_kind kind, uint32_t at) {
    json->expect = json->depth > 0 ? SEPARATOR : NOTHING;
    return (struct cb_json_token){kind, at, json->at - at};
}

static struct cb_json_token open_container(struct cb_json *json, bool object) {
    const uint32_t at = json->at;
    if (json->depth == CB_JSON_MAX_DEPTH)
        return bad(json, at, "brackets are nested deeper than 32");
    const uint32_t bit = 1u << json->depth;
    json->objects = object ? json->objects | bit : json->objects & ~bit;
    ++json->depth;
    ++json->at;
    json->expect = object ? FIRST_KEY : FIRST_ELEMENT;
    return (struct cb_json_token){object ? CB_JSON_OBJECT : CB_JSON_ARRAY, at, 1};
}

static struct cb_json_token close_container(struct cb_json *json) {
    const enum cb_json_kind kind = in_object(json) ? CB_JSON_OBJECT_END : CB_JSON_ARRAY_END;
    const uint32_t at = json->at;
    ++json->at;
    --json->depth;
    return complete(json, kind, at);
}

static struct cb_json_token read_string(struct cb_json *json) {
    const uint32_t at = json->at;
    const char *mistake = cb_json_scan_string(json->text, json->length, &json->at);
    if (mistake) return bad(json, json->at, mistake);
    return complete(json, CB_JSON_STRING, at);
}

/* Passes digits; false if there are none. */
static bool pass_digits(struct cb_json *json) {
    if (!is_digit(peek(json))) return false;
    while (is_digit(peek(json))) ++json->at;
    return true;
}

/* in : json->at at a minus sign or a digit
 * out: the number's token, json->at behind it; BAD at the number's start or at the first wrong
 * byte */
static struct cb_json_token read_number(struct cb_json *json) {
    const uint32_t at = json->at;
    if (peek(json) == '-') ++json->at;
    const uint32_t first = json->at;
    if (!pass_digits(json)) return bad(json, at, "a digit must follow the minus sign");
    if (json->text[first] == '0' && json->at > first + 1)
        return bad(json, at, "a number may not begin with a needless 0");
    if (peek(json) == '.') {
        ++json->at;
        if (!pass_digits(json)) return bad(json, at, "a digit must follow the decimal point");
    }
    if (peek(json) == 'e' || peek(json) == 'E') {
        ++json->at;
        if (peek(json) == '+' || peek(json) == '-') ++json->at;
        if (!pass_digits(json)) return bad(json, at, "the exponent of a number has no digits");
    }
    return complete(json, CB_JSON_NUMBER, at);
}

/* Passes `word` if it is next. */
static bool pass_word(struct cb_json *json, const char *word) {
    uint32_t at = json->at;
    for (; *word; ++word, ++at) {
        if (at >= json->length || json->text[at] != *word) return false;
    }
    json->at = at;
    return true;
}

/* Sentence for a byte that cannot begin a value, with a guess at the intention. */
static const char *no_value(const struct cb_json *json) {
    static const struct {
        char first;
        const char *mistake;
    } hints[] = {
        {']', "a value is missing before this bracket; is there a comma too many?"},
        {'}', "a value is missing before this bracket"},
        {',', "a value is missing before this comma"},
        {'\'', "texts need double quotes"},
        {'/', "JSON has no comments"},
        {'+', "a number may not begin with +"},
        {'.', "a number must begin with a digit: write 0.5, not .5"},
        {'N', "NaN is not a number of JSON"},
        {'I', "infinity is not a number of JSON"},
        {'\xef', "a byte order mark or another stray character; save the file as plain UTF-8"},
    };
    if (json->at >= json->length) return "the text ends where a value is expected";
    for (unsigned i = 0; i < sizeof hints / sizeof hints[0]; ++i) {
        if (hints[i].first == json->text[json->at]) return hints[i].mistake;
    }
    return "a value is expected here: an object, an array, a text in double quotes, a number, "
           "true, false or null";
}

static struct cb_json_token read_value(struct cb_json *json) {
    const uint32_t at = json->at;
    const char c = peek(json);
    if (c == '{') return open_container(json, true);
    if (c == '[') return open_container(json, false);
    if (c == '"') return read_string(json);
    if (c == '-' || is_digit(c)) return read_number(json);
    if (pass_word(json, "true")) return complete(json, CB_JSON_TRUE, at);
    if (pass_word(json, "false")) return complete(json, CB_JSON_FALSE, at);
    if (pass_word(json, "null")) return complete(json, CB_JSON_NULL, at);
    return bad(json, at, no_value(json));
}

static struct cb_json_token read_key(struct cb_json *json) {
    const char c = peek(json);
    if (json->at >= json->length)
        return bad(json, json->at, "the text ends where a key is expected");
    if (c == '}') return bad(json, json->at, "a key is missing here; is there a comma too many?");
    if (c != '"') return bad(json, json->at, "a key in double quotes is expected here");
    struct cb_json_token token = read_string(json);
    if (token.kind == CB_JSON_BAD) return token;
    skip_space(json);
    if (peek(json) != ':') return bad(json, json->at, "a colon is expected after the key");
    ++json->at;
    json->expect = VALUE;
    token.kind = CB_JSON_KEY;
    return token;
}

static struct cb_json_token read_after_value(struct cb_json *json) {
    const bool object = in_object(json);
    const char c = peek(json);
    if (c == (object ? '}' : ']')) return close_container(json);
    if (json->at >= json->length)
        return bad(
            json, json->at,
            object ? "the text ends before its closing }" : "the text ends before its closing ]");
    if (c != ',')
        return bad(json, json->at,
                   object ? "a comma or } is expected here" : "a comma or ] is expected here");
    ++json->at;
    skip_space(json);
    return object ? read_key(json) : read_value(json);
}

static struct cb_json_token read_nothing(struct cb_json *json) {
    if (json->at < json->length) return bad(json, json->at, "the file must end after its last }");
    return (struct cb_json_token){CB_JSON_END, json->at, 0};
}

struct cb_json_token cb_json_next(struct cb_json *json) {
    if (json->expect == STOPPED) return (struct cb_json_token){CB_JSON_BAD, json->at, 0};
    skip_space(json);
    switch ((enum expect)json->expect) {
        case VALUE:
            return read_value(json);
        case FIRST_ELEMENT:
            return peek(json) == ']' ? close_container(json) : read_value(json);
        case FIRST_KEY:
            return peek(json) == '}' ? close_container(json) : read_key(json);
        case SEPARATOR:
            return read_after_value(json);
        case NOTHING:
            return read_nothing(json);
        case STOPPED:
            break;
    }
    return (struct cb_json_token){CB_JSON_BAD, json->at, 0};
}

void cb_json_skip(struct cb_json *json, uint8_t depth) {
    while (json->depth > depth && cb_json_next(json).kind != CB_JSON_BAD) {
    }
}

struct cb_json_place cb_json_locate(const char *text, uint32_t offset) {
    struct cb_json_place place = {1, 1};
    for (uint32_t i = 0; i < offset; ++i) {
        ++place.column;
        if (text[i] == '\n') {
            ++place.line;
            place.column = 1;
        }
    }
    return place;
}
