// mesh_text.c - text files of lines, words and numbers (OBJ, MTL)
// SPDX-License-Identifier: BSD-3-Clause
//
// Numbers are most of such a file, and strtod is slow and minds the locale. Here a number is an integer m of up to 19
// digits and a power of ten k. For m < 2^53 and |k| <= 22 both are exact doubles, so that m * 10^k or m / 10^-k is the
// double next to the text (Clinger 1990, "How to read floating point numbers accurately"). Others are a few last bits
// off, which a float does not see. Writing is the other way round: m is the value scaled and rounded to 6, 7, 8 or at
// most 9 digits, the first of them that gives the same float when it is read; 9 always do.
#include "datasets-synthetic/mesh_text.h"

#include "base/file.h"
#include <math.h>
#include <string.h>

// ---- lines and words

vt_status vt_open_text(vt_context *ctx, const char *path, vt_text *out) {
  uint8_t *bytes;
  size_t size;
  *out = (vt_text){.context = ctx, .path = path};
  vt_status status = vt_read_file(ctx, path, &bytes, &size);
  if (status) return status;
  char *text = (char *)bytes;
  out->begin = text;
  out->end = text + size;
  bool old_mac = !memchr(text, '\n', size);
  for (char *p = text; (p = memchr(p, '\r', (size_t)(out->end - p))); p++) *p = old_mac ? '\n' : ' ';
  // '\v' is a blank that still counts as a line.
  for (char *p = text; (p = memchr(p, '\\', (size_t)(out->end - p))); p++) {
    char *q = p + 1;
    while (*q == ' ') q++; // where the '\r' was
    if (*q == '\n') *p = ' ', *q = '\v';
  }
  return VT_OK;
}

void vt_close_text(vt_text *text) {
  vt_free(text->context, text->begin);
  *text = (vt_text){0};
}

vt_status vt_fail_line(const vt_text *text, const char *at, const char *why) {
  size_t line = 1;
  for (const char *p = text->begin; p < at; p++) line += *p == '\n' || *p == '\v';
  return vt_fail(text->context, VT_BAD_INPUT, "%s: line %zu: %s", text->path, line, why);
}

static bool is_blank(char c) {
  return c == ' ' || c == '\t' || c == '\v';
}

const char *vt_skip_blanks(const char *at) {
  while (is_blank(*at)) at++;
  return at;
}

const char *vt_next_line(const vt_text *text, const char *at) {
  const char *end = at ? memchr(at, '\n', (size_t)(text->end - at)) : NULL;
  if (at && !end) return NULL;
  at = vt_skip_blanks(at ? end + 1 : text->begin);
  return at < text->end ? at : NULL;
}

bool vt_at_line_end(const char *at) {
  return *at == '\n' || *at == 0 || *at == '#';
}

const char *vt_skip_word(const char *at, const char *word) {
  size_t length = strlen(word);
  if (strncmp(at, word, length) || !(is_blank(at[length]) || vt_at_line_end(at + length))) return NULL;
  return vt_skip_blanks(at + length);
}

size_t vt_word_length(const char *at) {
  size_t length = 0;
  while (!is_blank(at[length]) && at[length] != '\n' && at[length]) length++;
  return length;
}

// ---- numbers

static double power_of_ten(int k) { // 0..22: exact
  static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                  1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
  return powers[k];
}

static double scale(double value, int k) {
  for (; k > 22 && value < INFINITY; k -= 22) value *= 1e22;
  for (; k < -22 && value > 0; k += 22) value /= 1e22;
  if (k > 22 || k < -22) return value; // long infinite or zero
  return k < 0 ? value / power_of_ten(-k) : value * power_of_ten(k);
}

const char *vt_scan_number(const char *at, double *value) {
  bool negative = *at == '-';
  at += negative || *at == '+';
  uint64_t m = 0;
  int digits = 0, k = 0, e = 0; // digits that m took
  bool any = false;
  for (; *at >= '0' && *at <= '9'; at++, any = true)
    if (digits < 19)
      m = m * 10 + (uint64_t)(*at - '0'), digits += m > 0;
    else if (k < 100000)
      k++;
  if (*at == '.')
    for (at++; *at >= '0' && *at <= '9'; at++, any = true)
      if (digits < 19 && k > -100000) m = m * 10 + (uint64_t)(*at - '0'), digits += m > 0, k--;
  if (!any) return NULL;
  if (*at == 'e' || *at == 'E') {
    bool down = at[1] == '-';
    at += 1 + (down || at[1] == '+');
    if (*at < '0' || *at > '9') return NULL;
    for (; *at >= '0' && *at <= '9'; at++)
      if (e < 100000) e = e * 10 + (*at - '0');
    k += down ? -e : e;
  }
  if (!is_blank(*at) && !vt_at_line_end(at)) return NULL;
  double v = m ? scale((double)m, k) : 0;
  if (!isfinite(v)) return NULL;
  *value = negative ? -v : v;
  return at;
}

int vt_scan_numbers(const char *at, int limit, double *values) {
  int count = 0;
  for (at = vt_skip_blanks(at); !vt_at_line_end(at); at = vt_skip_blanks(at)) {
    if (count == limit) return -1;
    at = vt_scan_number(at, &values[count++]);
    if (!at) return -1;
  }
  return count;
}

// value as m * 10^-k with m of so many digits; value > 0
static uint64_t round_to_digits(double value, int digits, int *k) {
  *k = digits - 1 - (int)floor(log10(value));
  double m = floor(scale(value, *k) + 0.5);
  if (m >= power_of_ten(digits)) m = floor(scale(value, --*k) + 0.5); // 9.9996 to four digits
  return (uint64_t)m;
}

static char *print_scaled(char *to, uint64_t m, int k) {
  char digits[24];
  int count = 0;
  for (; m && m % 10 == 0; k--) m /= 10;
  if (k > 12 || k < -6) { // as an integer with an exponent
    for (; m; m /= 10) digits[count++] = (char)('0' + m % 10);
    while (count) *to++ = digits[--count];
    return to + sprintf(to, "e%d", -k);
  }
  for (; k < 0; k++) m *= 10;
  for (; m || count <= k; m /= 10) digits[count++] = (char)('0' + m % 10);
  while (count) {
    if (count == k) *to++ = '.';
    *to++ = digits[--count];
  }
  return to;
}

char *vt_print_number(char *to, double value, int digits) {
  int k;
  if (value < 0) *to++ = '-', value = -value;
  if (value == 0) {
    *to++ = '0';
    return to;
  }
  uint64_t m = round_to_digits(value, digits, &k);
  return print_scaled(to, m, k);
}

char *vt_print_float(char *to, float value) {
  double v = value < 0 ? -(double)value : (double)value;
  int k = 0;
  uint64_t m = 0;
  for (int digits = 6; v > 0 && digits <= 9; digits++) {
    m = round_to_digits(v, digits, &k);
    if ((double)(float)scale((double)m, -k) == v) break;
  }
  if (value < 0) *to++ = '-';
  if (!m) {
    *to++ = '0';
    return to;
  }
  return print_scaled(to, m, k);
}
