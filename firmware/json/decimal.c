/* SPDX-License-Identifier: MIT
 *
 * A decimal number is D * 10^e, D and e integers. It is converted exactly to the form A / B * 2^x
 * with integers A and B, 1 <= A / B < 2. Long division then gives as many bits as the float has
 * there, and the remainder decides the rounding. Every step is exact, so the result is correctly
 * rounded.
 *
 * Size. The points half-way between two float32 have at most 113 significant digits (an odd number
 * below 2^25 times 5^150 at the small end). Of a longer number the first 120 digits are therefore
 * kept, and a final 1 represents the others if one of them is not 0: the comparison with every
 * half-way point is the same. D < 10^121 < 2^402, and 5^-e <= 5^166 < 2^386: 13 words, and one for
 * shifts. */
#include "firmware/json/decimal.h"

#include <string.h>

enum {
    WORDS = 14,
    MAX_DIGITS = 120,
    LARGEST_MAGNITUDE = 39,    /* 10^39 > FLT_MAX: no larger number is finite */
    SMALLEST_MAGNITUDE = -45,  /* 10^-46 < 2^-150: no smaller number rounds to more than 0 */
    HUGE_EXPONENT = 100000000, /* no text has as many digits to compensate for it */
};

/* Unsigned integer, least significant word first. */
struct big {
    uint32_t word[WORDS];
};

static void big_set(struct big *a, uint32_t value) {
    memset(a, 0, sizeof *a);
    a->word[0] = value;
}

/* a = a * factor + addend; the caller ensures that it fits. */
static void big_multiply_add(struct big *a, uint32_t factor, uint32_t addend) {
    uint64_t carry = addend;
    for (unsigned i = 0; i < WORDS; ++i) {
        carry += (uint64_t)a->word[i] * factor;
        a->word[i] = (uint32_t)carry;
        carry >>= 32;
    }
}

/* a = a * 5^power */
static void big_scale(struct big *a, uint32_t power) {
    for (; power >= 13; power -= 13) big_multiply_add(a, 1220703125u /* 5^13 */, 0);
    for (; power > 0; --power) big_multiply_add(a, 5, 0);
}

static int big_compare(const struct big *a, const struct big *b) {
    for (unsigned i = WORDS; i-- > 0;) {
        if (a->word[i] != b->word[i]) return a->word[i] > b->word[i] ? 1 : -1;
    }
    return 0;
}

/* a = a - b, a >= b */
static void big_subtract(struct big *a, const struct big *b) {
    uint64_t borrow = 0;
    for (unsigned i = 0; i < WORDS; ++i) {
        const uint64_t difference = (uint64_t)a->word[i] - b->word[i] - borrow;
        a->word[i] = (uint32_t)difference;
        borrow = (difference >> 32) & 1u;
    }
}

/* a = a * 2^bits; the caller ensures that it fits. */
static void big_shift(struct big *a, uint32_t bits) {
    const uint32_t words = bits / 32, rest = bits % 32;
    for (uint32_t i = WORDS; i-- > 0;) {
        const uint64_t high = i >= words ? a->word[i - words] : 0;
        const uint64_t low = i >= words + 1 ? a->word[i - words - 1] : 0;
        a->word[i] = (uint32_t)((high << 32 | low) >> (32 - rest));
    }
}

/* Number of bits; 0 for 0. */
static int32_t big_bits(const struct big *a) {
    for (int32_t i = WORDS; i-- > 0;) {
        if (a->word[i] == 0) continue;
        int32_t bits = 0;
        for (uint32_t rest = a->word[i]; rest > 0; rest >>= 1) ++bits;
        return i * 32 + bits;
    }
    return 0;
}

/* digits * 10^exponent, as read; count significant digits. */
struct decimal {
    struct big digits;
    uint32_t count;
    int32_t exponent;
    bool negative, more; /* more: a dropped digit is not 0 */
};

/* Takes one digit of the mantissa. */
static void take_digit(struct decimal *decimal, uint32_t digit, bool after_point) {
    if (decimal->count == MAX_DIGITS) {
        decimal->more = decimal->more || digit != 0;
        decimal->exponent += after_point ? 0 : 1;
        return;
    }
    decimal->exponent -= after_point ? 1 : 0;
    if (decimal->count == 0 && digit == 0) return;
    big_multiply_add(&decimal->digits, 10, digit);
    ++decimal->count;
}

/* in : text[length]: optional sign, then digits
 * out: the exponent; a huge one stays huge, but never overflows */
static int32_t read_exponent(const char *text, uint32_t length) {
    bool negative = false;
    int32_t value = 0;
    for (uint32_t i = 0; i < length; ++i) {
        if (text[i] == '-') negative = true;
        if (text[i] < '0' || value >= HUGE_EXPONENT) continue;
        value = value * 10 + (text[i] - '0');
    }
    return negative ? -value : value;
}

/* in : text[length], a number in the grammar of JSON
 * out: its significant digits and exponent; a digit 1 behind the kept digits stands for dropped
 *      ones */
static void read_decimal(const char *text, uint32_t length, struct decimal *decimal) {
    bool after_point = false;
    memset(decimal, 0, sizeof *decimal);
    for (uint32_t i = 0; i < length; ++i) {
        const char c = text[i];
        if (c == '-') {
            decimal->negative = true;
        } else if (c == '.') {
            after_point = true;
        } else if (c == 'e' || c == 'E') {
            decimal->exponent += read_exponent(text + i + 1, length - i - 1);
            break;
        } else {
            take_digit(decimal, (uint32_t)(c - '0'), after_point);
        }
    }
    if (!decimal->more) return;
    big_multiply_add(&decimal->digits, 10, 1);
    ++decimal->count;
    --decimal->exponent;
}

/* a and b become a / b in [1, 2), both > 0; returns x with old a / b = new a / b * 2^x. */
static int32_t normalise(struct big *a, struct big *b) {
    int32_t power = big_bits(a) - big_bits(b);
    if (power < 0) big_shift(a, (uint32_t)-power);
    if (power > 0) big_shift(b, (uint32_t)power);
    if (big_compare(a, b) >= 0) return power;
    big_shift(a, 1);
    return power - 1;
}

/* in : a / b in [1, 2)
 * out: its first `bits` binary digits as an integer, rounded to nearest even; a is consumed */
static uint32_t divide(struct big *a, const struct big *b, int32_t bits) {
    uint32_t quotient = 0;
    for (int32_t i = 0; i < bits; ++i) {
        quotient <<= 1;
        if (big_compare(a, b) >= 0) {
            big_subtract(a, b);
            quotient |= 1u;
        }
        big_shift(a, 1);
    }
    const int half = big_compare(a, b);
    return quotient + (half > 0 || (half == 0 && (quotient & 1u) != 0) ? 1u : 0u);
}

/* in : digits != 0, magnitude in range
 * out: the bits of the nearest float32 without its sign; 0x7f800000 or more when it overflows */
static uint32_t nearest_bits(struct decimal *decimal) {
    struct big one;
    big_set(&one, 1);
    if (decimal->exponent < 0) big_scale(&one, (uint32_t)-decimal->exponent);
    if (decimal->exponent > 0) big_scale(&decimal->digits, (uint32_t)decimal->exponent);
    const int32_t power = normalise(&decimal->digits, &one) + decimal->exponent;
    const int32_t bits = power >= -126 ? 24 : 150 + power; /* subnormals have fewer */
    if (bits < 0) return 0;
    const uint32_t mantissa = divide(&decimal->digits, &one, bits);
    return power >= -126 ? ((uint32_t)(power + 126) << 23) + mantissa : mantissa;
}

bool cb_decimal_to_float(const char *text, uint32_t length, float *value) {
    struct decimal decimal;
    uint32_t bits = 0;
    read_decimal(text, length, &decimal);
    const int32_t magnitude = (int32_t)decimal.count + decimal.exponent; /* below 10^magnitude */
    if (decimal.count > 0 && magnitude > LARGEST_MAGNITUDE) return false;
    if (decimal.count > 0 && magnitude >= SMALLEST_MAGNITUDE) bits = nearest_bits(&decimal);
    if (bits >= 0x7f800000u) return false;
    if (decimal.negative) bits |= 0x80000000u;
    memcpy(value, &bits, sizeof bits);
    return true;
}

bool cb_decimal_to_uint32(const char *text, uint32_t length, uint32_t *value) {
    uint64_t sum = 0;
    if (length == 0) return false;
    for (uint32_t i = 0; i < length; ++i) {
        if (text[i] < '0' || text[i] > '9') return false;
        sum = sum * 10 + (uint64_t)(text[i] - '0');
        if (sum > UINT32_MAX) return false;
    }
    *value = (uint32_t)sum;
    return true;
}
