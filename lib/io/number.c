/* number.c: numbers as decimal text and back, correctly rounded, independent of the locale. Hexadecimal numbers and
 * digit grouping are not supported.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "io/io.h"

#include <errno.h>
#include <float.h>
#include <math.h>
#include <stdlib.h>

typedef unsigned __int128 wide;

/* 10^k = 5^k 2^k, and 5^27 is the last power of 5 below 2^63. Up to there 128 bits hold every product and quotient
 * exactly, so that rounding is decided with integers alone. */
enum { MOST_FIVES = 27 };
static const uint64_t five[MOST_FIVES + 1] = {
    /* clang-format off */
    1ull, 5ull, 25ull, 125ull,
    625ull, 3125ull, 15625ull, 78125ull,
    390625ull, 1953125ull, 9765625ull, 48828125ull,
    244140625ull, 1220703125ull, 6103515625ull, 30517578125ull,
    152587890625ull, 762939453125ull, 3814697265625ull, 19073486328125ull,
    95367431640625ull, 476837158203125ull, 2384185791015625ull, 11920928955078125ull,
    59604644775390625ull, 298023223876953125ull, 1490116119384765625ull, 7450580596923828125ull,
    /* clang-format on */
};

static const double ten[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                             1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
/* 10^22 is the last power of ten that is a binary64. On machines that compute in a longer format, double rounding
 * would make even these inexact. */
enum { MOST_EXACT_TEN = FLT_EVAL_METHOD == 0 ? 22 : -1 };

/* ------------------------------------------------------------------------------------------- reading -- */

enum {
    MOST_DIGITS = 19,      /* that many always fit in 64 bits */
    EXACT_DIGITS = 780,    /* digits beyond these only decide a tie: 767 suffice for binary64 */
    EXPONENT_LIMIT = 99999 /* exponents are limited here, far beyond where a number is 0 or infinite */
};

static inline bool is_digit(char c)
{
    return (unsigned char)(c - '0') < 10;
}

static inline uint64_t load_eight(const char *s)
{
    uint64_t x;
    memcpy(&x, s, sizeof x);
#if __BYTE_ORDER__ == __ORDER_BIG_ENDIAN__
    x = __builtin_bswap64(x);
#endif
    return x;
}

/* The value of the digits at the start of eight characters, without a branch on their number, which is stored in *n.
 * The first character is the lowest byte; shifting left puts zeros before the digits. */
static inline uint64_t eight_digits(uint64_t text, unsigned *n)
{
    uint64_t x = text ^ 0x3030303030303030ull;
    uint64_t other = ((x + 0x7676767676767676ull) | x) & 0x8080808080808080ull;
    unsigned count = other ? (unsigned)__builtin_ctzll(other) >> 3 : 8;
    *n = count;
    if (count == 0) return 0;
    x <<= 64 - 8 * count;
    x = (x * 10 + (x >> 8)) & 0x00ff00ff00ff00ffull;
    x = (x * 100 + (x >> 16)) & 0x0000ffff0000ffffull;
    return (x * 10000 + (x >> 32)) & 0xffffffffull;
}

/* Append the digits at s to *w (which overflows harmlessly after MOST_DIGITS); returns the address after them. */
static inline const char *take_digits(const char *s, const char *end, uint64_t *w)
{
    static const uint64_t power[9] = {1, 10, 100, 1000, 10000, 100000, 1000000, 10000000, 100000000};
    uint64_t x = *w;
    while (end - s >= 8) {
        unsigned n;
        uint64_t part = eight_digits(load_eight(s), &n);
        x = x * power[n] + part;
        s += n;
        if (n < 8) {
            *w = x;
            return s;
        }
    }
    for (; s < end && is_digit(*s); s++) x = x * 10 + (uint64_t)(*s - '0');
    *w = x;
    return s;
}

/* top has its highest bit set and represents top * 2^power, plus something less than one if `more`. */
static double round_binary(uint64_t top, bool more, int power)
{
    uint64_t m = top >> 11, rest = top & 0x7ff;
    if (rest > 0x400 || (rest == 0x400 && (more || (m & 1)))) m++;
    /* m includes its leading bit, which adds one to the exponent; a carry out of m also goes there */
    return vgi_as_double(((uint64_t)(power + 63 + 1022) << 52) + m);
}

/* w * 10^q correctly rounded, for w > 0 and |q| <= MOST_FIVES. */
static double scale_decimal(uint64_t w, int q)
{
    if (q >= 0) {
        wide product = (wide)w * five[q];
        uint64_t high = (uint64_t)(product >> 64), low = (uint64_t)product;
        if (!high) {
            int up = __builtin_clzll(low);
            return round_binary(low << up, false, q - up);
        }
        int up = __builtin_clzll(high);
        product <<= up;
        return round_binary((uint64_t)(product >> 64), (uint64_t)product != 0, q + 64 - up);
    }
    uint64_t divisor = five[-q];
    int up = __builtin_clzll(w), dup = __builtin_clzll(divisor);
    wide dividend = (wide)(w << up) << 63; /* its upper half is below the divisor's, so the quotient fits */
    divisor <<= dup;
    uint64_t quotient = (uint64_t)(dividend / divisor);
    bool more = (wide)quotient * divisor != dividend;
    int power = q - up - 63 + dup;
    int qup = __builtin_clzll(quotient);
    return round_binary(quotient << qup, more, power - qup);
}

/* The last resort: the digits without a point, which no locale reads differently, for strtod. */
static double read_exactly(const char *s, const char *end, int64_t q)
{
    char text[EXACT_DIGITS + 32];
    size_t n = 0;
    bool more = false;
    int64_t dropped = 0;
    for (; s < end; s++) {
        if (*s == '.' || (n == 0 && *s == '0')) continue;
        if (n < EXACT_DIGITS) text[n++] = *s;
        else dropped++, more |= *s != '0';
    }
    if (n == 0) return 0;
    if (more) text[n++] = '1', dropped--;
    q += dropped;
    if (q > EXPONENT_LIMIT) q = EXPONENT_LIMIT;
    if (q < -EXPONENT_LIMIT) q = -EXPONENT_LIMIT;
    snprintf(text + n, sizeof text - n, "e%d", (int)q);
    int saved = errno; /* out of range is not an error here: the result is 0 or infinity */
    double x = strtod(text, NULL);
    errno = saved;
    return x;
}

/* Digits with an optional point in [s, end), times 10^q, where q already accounts for the digits after the point. */
static double read_decimal(const char *s, const char *end, int64_t q)
{
    uint64_t w = 0;
    int n = 0;
    bool more = false;
    int64_t dropped = 0;
    for (const char *p = s; p < end; p++) {
        if (*p == '.') continue;
        if (n < MOST_DIGITS) {
            w = w * 10 + (uint64_t)(*p - '0');
            n += w != 0;
        } else {
            dropped++, more |= *p != '0';
        }
    }
    if (w == 0) return 0;
    int64_t power = q + dropped;
    if (power < -MOST_FIVES || power > MOST_FIVES) return read_exactly(s, end, q);
    double x = scale_decimal(w, (int)power);
    if (more && scale_decimal(w + 1, (int)power) != x) return read_exactly(s, end, q);
    return x;
}

/* Add "e5", "E-12" at s to *q; returns s itself if there is no exponent. */
static const char *read_exponent(const char *s, const char *end, int64_t *q)
{
    const char *p = s + 1;
    bool negative = false;
    if (p < end && (*p == '-' || *p == '+')) negative = *p++ == '-';
    if (p == end || !is_digit(*p)) return s;
    int64_t x = 0;
    for (; p < end && is_digit(*p); p++)
        if (x < INT64_MAX / 100) x = x * 10 + (*p - '0');
    *q += negative ? -x : x;
    return p;
}

static const char *read_word(const char *s, const char *end, const char *word)
{
    for (; *word; s++, word++)
        if (s == end || (*s | 0x20) != *word) return NULL;
    return s;
}

static const char *read_special(const char *s, const char *end, double *x)
{
    const char *p;
    if ((p = read_word(s, end, "nan"))) {
        *x = NAN;
        return p;
    }
    if ((p = read_word(s, end, "infinity")) || (p = read_word(s, end, "inf"))) *x = INFINITY;
    return p;
}

const char *vgi_parse_double(const char *s, const char *end, double *x)
{
    bool negative = false;
    if (s < end && (*s == '-' || *s == '+')) negative = *s++ == '-';
    uint64_t w = 0;
    const char *p = take_digits(s, end, &w);
    ptrdiff_t n = p - s;
    int64_t q = 0;
    if (p < end && *p == '.') {
        const char *point = p;
        p = take_digits(p + 1, end, &w);
        q = point + 1 - p;
        n -= q;
    }
    double value;
    if (n == 0) {
        p = read_special(s, end, &value);
        if (!p) return NULL;
    } else {
        const char *digits_end = p;
        if (p < end && (*p | 0x20) == 'e') p = read_exponent(p, end, &q);
        if (n > MOST_DIGITS) value = read_decimal(s, digits_end, q);
        else if (w <= 1ull << 53 && q <= 0 && q >= -MOST_EXACT_TEN) /* both exact: one rounding, in the division */
            value = (double)w / ten[-q];
        else if (w <= 1ull << 53 && q > 0 && q <= MOST_EXACT_TEN) value = (double)w * ten[q];
        else if (w != 0 && q >= -MOST_FIVES && q <= MOST_FIVES) value = scale_decimal(w, (int)q);
        else value = w == 0 ? 0 : read_exactly(s, digits_end, q);
    }
    *x = negative ? -value : value;
    return p;
}

const char *vgi_parse_int(const char *s, const char *end, int64_t *x)
{
    bool negative = false;
    if (s < end && (*s == '-' || *s == '+')) negative = *s++ == '-';
    if (s == end || !is_digit(*s)) return NULL;
    int64_t value = 0; /* kept negative, because there is one more negative number */
    for (; s < end && is_digit(*s); s++)
        if (__builtin_mul_overflow(value, 10, &value) || __builtin_sub_overflow(value, *s - '0', &value)) return NULL;
    if (!negative && value == INT64_MIN) return NULL;
    *x = negative ? value : -value;
    return s;
}

/* ------------------------------------------------------------------------------------------- writing -- */

/* A finite number > 0 as m * 2^e, with the parameters of its kind. */
struct binary {
    uint64_t m;
    int e;
    bool narrow_below; /* the gap to the number below is half the gap above */
    int most_digits;   /* this many digits identify every number of the kind: 9 or 17 */
    bool is_float;
};

struct decimal {
    uint64_t digits;
    int power; /* digits * 10^power */
};

/* At most 20 bytes; a call of memcpy would take longer. */
static inline void copy_few(char *to, const char *from, size_t n)
{
    if (n >= 8) {
        memcpy(to, from, 8);
        if (n > 16) memcpy(to + 8, from + 8, 8);
        memcpy(to + n - 8, from + n - 8, 8);
    } else if (n >= 4) {
        memcpy(to, from, 4);
        memcpy(to + n - 4, from + n - 4, 4);
    } else if (n > 0) {
        to[0] = from[0], to[n / 2] = from[n / 2], to[n - 1] = from[n - 1];
    }
}

size_t vgi_print_uint(char *to, uint64_t x)
{
    static const char pair[] = "0001020304050607080910111213141516171819202122232425262728293031323334353637383940"
                               "414243444546474849505152535455565758596061626364656667686970717273747576777879"
                               "8081828384858687888990919293949596979899";
    char text[20], *p = text + sizeof text;
    while (x >= 100) {
        p -= 2;
        memcpy(p, pair + 2 * (x % 100), 2);
        x /= 100;
    }
    if (x >= 10) p -= 2, memcpy(p, pair + 2 * x, 2);
    else *--p = (char)('0' + x);
    size_t n = (size_t)(text + sizeof text - p);
    copy_few(to, p, n);
    return n;
}

/* Among the integers in lo .. hi the one with the most trailing zeros, and among those the nearest to the true value,
 * which is v plus a fraction (v_rounded when rounded). False if there is none. */
static bool shortest_between(uint64_t lo, uint64_t hi, uint64_t v, uint64_t v_rounded, int power, struct decimal *d)
{
    if (lo > hi) return false;
    uint64_t unit = 1;
    for (;;) {
        uint64_t a = (lo + 9) / 10, b = hi / 10;
        if (a > b) break;
        lo = a, hi = b;
        unit *= 10;
        power++;
    }
    uint64_t nearest = unit == 1 ? v_rounded : (v + unit / 2) / unit;
    if (nearest < lo) nearest = lo;
    if (nearest > hi) nearest = hi;
    d->digits = nearest;
    d->power = power;
    return true;
}

/* The shortest decimal by exact integers; false if the number is too large or small. With k such that x * 10^k has
 * most_digits digits before the point, all numbers that read back as x lie between lo and hi, half-way to the
 * neighbours. In quarters of a unit of m these are 4m - 2 (or 4m - 1) and 4m + 2. To scale them, multiply by `up` and
 * divide by `down`, one a power of 2, the other of 5. */
static bool shortest_by_integers(const struct binary *x, struct decimal *d)
{
    int top = 63 - __builtin_clzll(x->m) + x->e; /* x is in [2^top, 2^(top+1)) */
    int tens = (int)((top * 78913ll) >> 18);     /* floor(top * log10(2)), exact for |top| < 1650 */
    int k = x->most_digits - 1 - tens;           /* occasionally one digit too many, which does no harm */
    if (k > MOST_FIVES || k < -MOST_FIVES) return false;
    int shift = x->e - 2 + k;
    if (k >= 0 ? (shift > 0 || shift < -100) : (shift < 0 || shift > 64)) return false;
    wide up = k >= 0 ? five[k] : (wide)1 << shift, lo = (4 * x->m - (x->narrow_below ? 1 : 2)) * up;
    wide v = 4 * x->m * up, hi = (4 * x->m + 2) * up;
    wide first, last, floor, rounded, first_at, last_at; /* first and last integer inside; the same, scaled back */
    if (k >= 0) {
        int down = -shift;
        first = (lo + (((wide)1 << down) - 1)) >> down, last = hi >> down;
        floor = v >> down, rounded = (v + ((wide)1 << down >> 1)) >> down;
        first_at = first << down, last_at = last << down;
    } else {
        uint64_t down = five[-k];
        first = (lo + (down - 1)) / down, last = hi / down;
        floor = v / down, rounded = (v + down / 2) / down;
        first_at = first * down, last_at = last * down;
    }
    if (x->m & 1) { /* a tie goes to the even neighbour, so the bounds are excluded */
        /* A text next to the bound of a float can round to the bound itself when read as a double. Half a unit of a
         * double is 2^-28 of our quarters; exclude that as well. */
        wide margin = x->is_float ? up >> 28 : 0;
        if (first_at - lo <= margin) first++;
        if (hi - last_at <= margin) last--;
    }
    return shortest_between((uint64_t)first, (uint64_t)last, (uint64_t)floor, (uint64_t)rounded, -k, d);
}

static bool reads_back(const struct binary *x, const struct decimal *d)
{
    char text[40];
    snprintf(text, sizeof text, "%llue%d", (unsigned long long)d->digits, d->power);
    double want = ldexp((double)x->m, x->e);
    double got = strtod(text, NULL);
    return x->is_float ? (double)(float)got == want && (double)strtof(text, NULL) == want : got == want;
}

/* The same by trial, for numbers out of reach of the integers. */
static void shortest_by_trial(const struct binary *x, struct decimal *d)
{
    int saved = errno;
    for (int digits = 1; digits <= x->most_digits; digits++) {
        char text[48];
        int n = snprintf(text, sizeof text, "%.*e", digits - 1, ldexp((double)x->m, x->e));
        uint64_t nearest = 0;
        int i = 0;
        for (; i < n && text[i] != 'e'; i++) /* the locale's decimal point, whatever it is, is not a digit */
            if (is_digit(text[i])) nearest = nearest * 10 + (uint64_t)(text[i] - '0');
        int power = (int)strtol(text + i + 1, NULL, 10) - (digits - 1);
        static const int steps[] = {0, 1, -1}; /* at a power of 2 the nearest text need not be the one that reads
                                                  back */
        for (int s = 0; s < 3; s++) {
            *d = (struct decimal){nearest + (uint64_t)(int64_t)steps[s], power};
            if (reads_back(x, d)) goto out;
        }
    }
out:
    errno = saved;
}

/* d in plain notation from 10^-5 to below 10^most_plain, otherwise with an exponent. */
static size_t print_decimal(char *to, const struct decimal *d, int most_plain)
{
    char digits[20];
    int n = (int)vgi_print_uint(digits, d->digits), point = d->power + n; /* digits before the point */
    while (n > 1 && digits[n - 1] == '0') n--;
    char *p = to;
    if (point > most_plain || point < -4) {
        *p++ = digits[0];
        if (n > 1) {
            *p++ = '.';
            copy_few(p, digits + 1, (size_t)n - 1);
            p += n - 1;
        }
        *p++ = 'e';
        int e = point - 1;
        if (e < 0) *p++ = '-', e = -e;
        return (size_t)(p - to) + vgi_print_uint(p, (uint64_t)e);
    }
    if (point <= 0) {
        memcpy(p, "0.0000", 6);
        p += 2 - point;
        copy_few(p, digits, (size_t)n);
        return (size_t)(p + n - to);
    }
    if (n <= point) {
        copy_few(p, digits, (size_t)n);
        memset(p + n, '0', (size_t)(point - n));
        return (size_t)point;
    }
    copy_few(p, digits, (size_t)point);
    p[point] = '.';
    copy_few(p + point + 1, digits + point, (size_t)(n - point));
    return (size_t)n + 1;
}

static size_t print_binary(char *to, const struct binary *x, int most_plain)
{
    struct decimal d = {0};
    if (!shortest_by_integers(x, &d)) shortest_by_trial(x, &d);
    return print_decimal(to, &d, most_plain);
}

/* "0", "inf" or "nan" for such a number; 0 for others. */
static size_t print_special(char *to, bool zero, bool infinite, bool nan)
{
    if (zero) return *to = '0', 1;
    if (!infinite && !nan) return 0;
    memcpy(to, infinite ? "inf" : "nan", 3);
    return 3;
}

size_t vgi_print_float(char *to, double x)
{
    uint32_t bits = vgi_float_bits((float)x), exponent = bits >> 23 & 0xff, m = bits & 0x7fffff;
    size_t sign = bits >> 31;
    if (sign) *to++ = '-';
    size_t n = print_special(to, !exponent && !m, exponent == 0xff && !m, exponent == 0xff && m);
    if (n) return sign + n;
    struct binary b = {exponent ? m | 1u << 23 : m, exponent ? (int)exponent - 150 : -149, exponent > 1 && !m, 9,
                       true};
    return sign + print_binary(to, &b, 15);
}

size_t vgi_print_double(char *to, double x)
{
    uint64_t bits = vgi_double_bits(x), exponent = bits >> 52 & 0x7ff, m = bits & ((1ull << 52) - 1);
    size_t sign = bits >> 63;
    if (sign) *to++ = '-';
    size_t n = print_special(to, !exponent && !m, exponent == 0x7ff && !m, exponent == 0x7ff && m);
    if (n) return sign + n;
    struct binary b = {exponent ? m | 1ull << 52 : m, exponent ? (int)exponent - 1075 : -1074, exponent > 1 && !m, 17,
                       false};
    return sign + print_binary(to, &b, 17);
}
