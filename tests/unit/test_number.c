/* test_number.c: numbers as text and back, against the C library as the independent witness.
 * SPDX-License-Identifier: GPL-3.0-or-later */
#include "test.h"

#include "io/io.h"

#include <float.h>
#include <locale.h>

static uint64_t seed = 88172645463325252ull;

static uint64_t next_random(void) /* xorshift64* */
{
    seed ^= seed << 13, seed ^= seed >> 7, seed ^= seed << 17;
    return seed * 0x2545f4914f6cdd1dull;
}

static double from_bits(uint64_t bits)
{
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* Does it read as strtod reads it, to the bit and to the same byte? */
static bool reads_like_strtod(const char *text)
{
    char *want_end;
    double want = strtod(text, &want_end), got = 0;
    size_t n = strlen(text);
    char *exact = malloc(n); /* without a terminator, so that a sanitizer sees reading beyond */
    memcpy(exact, text, n);
    const char *end = vgi_parse_double(exact, exact + n, &got);
    bool same = end && end - exact == want_end - text &&
                (!memcmp(&want, &got, sizeof got) || (isnan(want) && isnan(got)));
    free(exact);
    if (!same) printf("'%s' reads %.17g\n", text, got);
    return same;
}

static void reads_chosen_texts(void)
{
    static const char *const texts[] = {
        "0",
        "-0",
        "+1",
        "1.",
        ".5",
        "-.5e-3",
        "1e",
        "1e+",
        "1.5e5x",
        "00012",
        "12345678",
        "123456789",
        "1234567.",
        "0.12345678",
        "1.123456789012345678",
        "nan",
        "-inf",
        "infinity",
        "INF",
        "1e400",
        "-1e-400",
        "4.9e-324",
        "2.4703282292062327e-324",
        "2.4703282292062328e-324",
        "9007199254740993",
        "9007199254740992.99999999999999999999",
        "9007199254740993.00000000000001",
        "1.7976931348623158e308",
        "1.7976931348623159e308",
        "1e23",
        "8.5e22",
        "1e22",
        "1e-22",
        "9007199254740993e-23",
        "18446744073709551615",
        "18446744073709551616",
        "99999999999999999999",
        "0.000000000000000000000000000000000000001",
        "1e99999999999999999999",
        "0e99999999999999",
        "1e-99999999999999999999",
        "2.2250738585072011e-308",
        "00000000000000000000000000000001.5",
        "1/2",
        "3 4",
        "7e5\n",
        "5e-",
        "6e+7",
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) CHECK(reads_like_strtod(texts[i]));
}

static void refuses_what_is_no_number(void)
{
    static const char *const texts[] = {"",   ".",  "-",  "+",   "e5", "-e",   "abc", ".e1",
                                        "-.", "in", "na", "--1", " 1", ".nan", "/"};
    double x;
    int64_t i;
    for (size_t k = 0; k < sizeof texts / sizeof *texts; k++) {
        CHECK(!vgi_parse_double(texts[k], texts[k] + strlen(texts[k]), &x));
        CHECK(!vgi_parse_int(texts[k], texts[k] + strlen(texts[k]), &i));
    }
}

static void reads_random_texts(void)
{
    char text[800];
    for (int i = 0; i < 200000; i++) {
        uint64_t bits = next_random(), more = next_random();
        double x = from_bits(bits);
        switch (i % 6) {
        case 0: snprintf(text, sizeof text, "%.17g", x); break;
        case 1:
            snprintf(text, sizeof text, "%.*f", (int)(more % 12),
                     (double)(int64_t)bits / (double)(1ull << more % 64));
            break;
        case 2:
            snprintf(text, sizeof text, "%llu.%llue%d", (unsigned long long)(bits >> more % 64),
                     (unsigned long long)more, (int)(more % 80) - 40);
            break;
        case 3:
            snprintf(text, sizeof text, "-%llue%d", (unsigned long long)(bits >> more % 64), (int)(more % 60) - 30);
            break;
        case 4: snprintf(text, sizeof text, "%.*e", (int)(more % 30), x); break;
        default: { /* half-way between neighbours, cut off at some digit: the hardest to round */
            x = from_bits((bits & 0x800fffffffffffffull) | (uint64_t)(1023 - 60 + more % 120) << 52);
            long double half_way = ((long double)x + (long double)nextafter(x, INFINITY)) / 2;
            snprintf(text, sizeof text, "%.*Le", (int)(15 + more % 20), half_way);
        }
        }
        if (!reads_like_strtod(text)) {
            CHECK(!"random text");
            return;
        }
    }
}

/* More digits than are kept anywhere: 0.5 + 2^-53 exactly, and a last digit far behind that decides the tie. */
static void reads_very_long_texts(void)
{
    char text[3000];
    int n = snprintf(text, sizeof text, "%.60f", 0.5 + 0x1p-53);
    memset(text + n, '0', 2000);
    text[n + 2000] = 0;
    CHECK(reads_like_strtod(text));
    snprintf(text, sizeof text, "1.%0*d", 1500, 1);
    CHECK(reads_like_strtod(text));
    snprintf(text, sizeof text, "9007199254740993.%0*d", 1500, 0);
    CHECK(reads_like_strtod(text));
    snprintf(text, sizeof text, "9007199254740993.%0*d", 1500, 1);
    CHECK(reads_like_strtod(text));
    snprintf(text, sizeof text, "0.%0*d123e1400", 1400, 0);
    CHECK(reads_like_strtod(text));
    snprintf(text, sizeof text, "1%0*de-1400", 1400, 0);
    CHECK(reads_like_strtod(text));
    n = snprintf(text, sizeof text, "%.1074f",
                 4.9e-324); /* the tie between 0 and the least number, and just above it */
    memcpy(text + n, "5", 2);
    CHECK(reads_like_strtod(text));
}

static void reads_integers(void)
{
    static const struct {
        const char *text;
        int64_t value;
        size_t length;
    } good[] = {{"0", 0, 1},
                {"-0", 0, 2},
                {"+17", 17, 3},
                {"42/7", 42, 2},
                {"9223372036854775807", INT64_MAX, 19},
                {"-9223372036854775808", INT64_MIN, 20},
                {"007", 7, 3},
                {"3.5", 3, 1}};
    static const char *const bad[] = {"9223372036854775808", "-9223372036854775809", "99999999999999999999"};
    int64_t x;
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        x = 99;
        const char *end = vgi_parse_int(good[i].text, good[i].text + strlen(good[i].text), &x);
        CHECK(end == good[i].text + good[i].length && x == good[i].value);
    }
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) CHECK(!vgi_parse_int(bad[i], bad[i] + strlen(bad[i]), &x));
}

static const char *print_float(double x)
{
    static char text[32];
    text[vgi_print_float(text, x)] = 0;
    return text;
}

static const char *print_double(double x)
{
    static char text[32];
    text[vgi_print_double(text, x)] = 0;
    return text;
}

static void prints_plainly(void)
{
    CHECK_TEXT(print_float(0), "0");
    CHECK_TEXT(print_float(-0.0), "-0");
    CHECK_TEXT(print_float(1), "1");
    CHECK_TEXT(print_float(-12.5), "-12.5");
    CHECK_TEXT(print_float(0.1), "0.1");
    CHECK_TEXT(print_float(0.00125), "0.00125");
    CHECK_TEXT(print_float(1e-5), "0.00001");
    CHECK_TEXT(print_float(1e-6), "1e-6");
    CHECK_TEXT(print_float(-1.25e-30), "-1.25e-30");
    CHECK_TEXT(print_float(123456), "123456");
    CHECK_TEXT(print_float(16777216), "16777216");
    CHECK_TEXT(print_float(1e9), "1000000000");
    CHECK_TEXT(print_float(1e20), "1e20");
    CHECK_TEXT(print_float(FLT_MAX), "3.4028235e38");
    CHECK_TEXT(print_float(FLT_MIN), "1.1754944e-38");
    CHECK_TEXT(print_float(FLT_TRUE_MIN), "1e-45");
    CHECK_TEXT(print_float(INFINITY), "inf");
    CHECK_TEXT(print_float(1e300), "inf");
    CHECK_TEXT(print_double(0.1), "0.1");
    CHECK_TEXT(print_double(-0.0), "-0");
    CHECK_TEXT(print_double(0.1 + 0.2), "0.30000000000000004");
    CHECK_TEXT(print_double(1.0 / 3), "0.3333333333333333");
    CHECK_TEXT(print_double(1e22), "1e22");
    CHECK_TEXT(print_double(1e23), "1e23");
    CHECK_TEXT(print_double(9007199254740993.0), "9007199254740992");
    CHECK_TEXT(print_double(DBL_MAX), "1.7976931348623157e308");
    CHECK_TEXT(print_double(DBL_MIN), "2.2250738585072014e-308");
    CHECK_TEXT(print_double(DBL_TRUE_MIN), "5e-324");
    CHECK_TEXT(print_double(-1.2345678901234567e-300), "-1.2345678901234568e-300");
    CHECK_TEXT(print_double(-0.000012345678901234567), "-0.000012345678901234568");
}

static size_t significant_digits(const char *text)
{
    size_t n = 0, zeros = 0;
    for (; *text && *text != 'e'; text++) {
        if (*text < '0' || *text > '9' || (n == 0 && *text == '0')) continue;
        n++;
        zeros = *text == '0' ? zeros + 1 : 0;
    }
    return n - zeros;
}

static bool reads_back_as_float(const char *text, float x)
{
    float direct = strtof(text, NULL), cast = (float)strtod(text, NULL);
    double ours;
    if (vgi_parse_double(text, text + strlen(text), &ours) != text + strlen(text)) return false;
    float by_us = (float)ours;
    return !memcmp(&direct, &x, sizeof x) && !memcmp(&cast, &x, sizeof x) && !memcmp(&by_us, &x, sizeof x);
}

/* Reads back, and with one digit less (either way of rounding) it would not. */
static bool float_is_right(float x)
{
    const char *text = print_float(x);
    if (strlen(text) > 16 || !reads_back_as_float(text, x)) return false;
    size_t n = significant_digits(text);
    if (n < 2) return true;
    char shorter[64];
    snprintf(shorter, sizeof shorter, "%.*e", (int)n - 2, x);
    return !reads_back_as_float(shorter, x);
}

static void prints_floats(void)
{
    for (int i = 0; i < 300000; i++) {
        uint32_t bits = (uint32_t)(next_random() >> 32);
        if (i % 4 == 1) bits = (bits & 0x807fffff) | (uint32_t)(107 + bits % 40) << 23; /* the sizes of coordinates */
        if (i % 4 == 2) bits &= 0xff800000 | 0x7fffffu << bits % 24; /* few bits: powers of 2 too */
        if (i % 4 == 3 && i % 8 == 3) bits &= 0x807fffff;           /* denormal */
        float x;
        memcpy(&x, &bits, sizeof x);
        if (isfinite(x) && !float_is_right(x)) {
            printf("%a prints as %s\n", (double)x, print_float(x));
            CHECK(!"float");
            return;
        }
    }
    for (int e = -149; e < 128; e++)
        CHECK(float_is_right(ldexpf(1, e)) && float_is_right(nextafterf(ldexpf(1, e), 0)));
}

static bool double_is_right(double x)
{
    const char *text = print_double(x);
    double back = strtod(text, NULL), ours;
    if (strlen(text) > 25 || memcmp(&back, &x, sizeof x)) return false;
    if (!vgi_parse_double(text, text + strlen(text), &ours) || memcmp(&ours, &x, sizeof x)) return false;
    size_t n = significant_digits(text);
    char shorter[64];
    snprintf(shorter, sizeof shorter, "%.*e", n < 2 ? 0 : (int)n - 2, x);
    return n < 2 || strtod(shorter, NULL) != x;
}

static void prints_doubles(void)
{
    for (int i = 0; i < 200000; i++) {
        uint64_t bits = next_random();
        if (i % 4 == 1) bits = (bits & 0x800fffffffffffffull) | (uint64_t)(1003 + bits % 40) << 52;
        if (i % 4 == 2) bits &= 0xfff0000000000000ull | 0xfffffffffffffull << bits % 53;
        double x = i % 4 == 3 ? (double)(bits % 100000000) / 1e5 : from_bits(bits);
        if (isfinite(x) && !double_is_right(x)) {
            printf("%a prints as %s\n", x, print_double(x));
            CHECK(!"double");
            return;
        }
    }
    for (int e = -1074; e < 1024; e++) CHECK(double_is_right(ldexp(1, e)));
}

static void prints_integers(void)
{
    char text[32], want[32];
    for (int i = 0; i < 100000; i++) {
        uint64_t x = i == 0 ? UINT64_MAX : i < 1000 ? (uint64_t)i : next_random() >> (i % 64);
        text[vgi_print_uint(text, x)] = 0;
        snprintf(want, sizeof want, "%llu", (unsigned long long)x);
        if (strcmp(text, want)) CHECK_TEXT(text, want);
    }
}

/* With a comma as the decimal point nothing changes: also where the C library helps (very small numbers). */
static void ignores_the_locale(void)
{
    static const char *const names[] = {"de_DE.UTF-8", "de_DE.utf8",  "fr_FR.UTF-8",
                                        "fr_FR.utf8",  "ru_RU.UTF-8", "de_DE"};
    bool found = false;
    for (size_t i = 0; i < sizeof names / sizeof *names && !found; i++) found = setlocale(LC_ALL, names[i]) != NULL;
    if (!found) printf("# no locale with a decimal comma here\n");
    double x = 0;
    const char text[] = "-1.25e-300";
    CHECK(vgi_parse_double(text, text + 10, &x) == text + 10);
    CHECK(x == -1.25e-300);
    CHECK(vgi_parse_double(text + 1, text + 5, &x) && x == 1.25);
    CHECK_TEXT(print_double(-1.25e-300), "-1.25e-300");
    CHECK_TEXT(print_float(1.25e-40f), "1.25e-40");
    CHECK_TEXT(print_float(2.5), "2.5");
    setlocale(LC_ALL, "C");
}

TESTS({"reads chosen texts as strtod does", reads_chosen_texts},
      {"refuses what is no number", refuses_what_is_no_number},
      {"reads random texts as strtod does", reads_random_texts}, {"reads very long texts", reads_very_long_texts},
      {"reads integers", reads_integers}, {"prints plainly", prints_plainly},
      {"prints floats shortest, reading back", prints_floats},
      {"prints doubles shortest, reading back", prints_doubles}, {"prints integers", prints_integers},
      {"ignores the locale", ignores_the_locale})
