// components.c - connected parts of a picture, and what is within reach of them
// SPDX-License-Identifier: BSD-3-Clause
//
// A part is flooded from its first sure pixel; the stack keeps all of it, so that a part that turns out to be a speck
// can be taken back. Dilation by a square is two passes along lines, whatever the radius.
#include "capture/components.h"
#include <string.h>

enum { SEEN = 4 }; // a pixel of a part that was flooded and found too weak

typedef struct part { // what a flood meets
  size_t size, strong;
  double strength; // sum
} part;

// Floods from `seed` over what is in no part yet and at least `doubtful`; the stack keeps all of it.
static part flood(int width, int height, const uint8_t *strength, uint8_t doubtful, uint8_t sure, size_t seed, uint8_t *parts,
                  uint32_t *stack) {
  part found = {0};
  parts[seed] = SEEN;
  stack[found.size++] = (uint32_t)seed;
  for (size_t next = 0; next < found.size; next++) {
    int x = (int)(stack[next] % (uint32_t)width), y = (int)(stack[next] / (uint32_t)width);
    found.strong += strength[stack[next]] >= sure;
    found.strength += strength[stack[next]];
    for (int j = y > 0 ? y - 1 : 0; j <= y + 1 && j < height; j++)
      for (int i = x > 0 ? x - 1 : 0; i <= x + 1 && i < width; i++) {
        size_t p = (size_t)j * (size_t)width + (size_t)i;
        if (parts[p] || strength[p] < doubtful) continue;
        parts[p] = SEEN;
        stack[found.size++] = (uint32_t)p;
      }
  }
  return found;
}

vt_status vt_find_parts(vt_context *context, int width, int height, const uint8_t *strength, uint8_t doubtful, uint8_t sure,
                        size_t few, double weak, uint8_t *parts) {
  size_t count = (size_t)width * (size_t)height, largest = 0;
  uint32_t *stack = VT_NEW(context, uint32_t, count);
  if (!stack) return VT_OUT_OF_MEMORY;
  double least = 0;
  memset(parts, 0, count);
  for (int pass = weak > 0 ? 0 : 1; pass < 2; pass++) { // first to see what the largest is like
    for (size_t seed = 0; seed < count; seed++) {
      if (strength[seed] < sure || parts[seed]) continue;
      part found = flood(width, height, strength, doubtful, sure, seed, parts, stack);
      double mean = found.strength / (double)found.size;
      if (found.size > largest) largest = found.size, least = pass ? least : weak * mean;
      if (!pass || found.strong < few || mean < least) continue;
      for (size_t i = 0; i < found.size; i++)
        parts[stack[i]] = strength[stack[i]] >= sure ? VT_PART_SURE : VT_PART_DOUBTFUL;
    }
    for (size_t p = 0; p < count; p++)
      if (parts[p] == SEEN) parts[p] = VT_PART_NONE;
  }
  vt_free(context, stack);
  return VT_OK;
}

void vt_dilate(int width, int height, int radius, uint8_t *mask, uint8_t *scratch) {
  for (int pass = 0; pass < 2; pass++) {
    const uint8_t *from = pass ? scratch : mask;
    uint8_t *to = pass ? mask : scratch;
    int length = pass ? height : width, lines = pass ? width : height;
    size_t step = pass ? (size_t)width : 1, next_line = pass ? 1 : (size_t)width;
    for (int line = 0; line < lines; line++) {
      const uint8_t *f = from + (size_t)line * next_line;
      uint8_t *t = to + (size_t)line * next_line;
      int left = 0; // pixels still to set behind the last 1
      for (int i = -radius; i < length; i++) {
        if (i + radius < length && f[(size_t)(i + radius) * step]) left = 2 * radius + 1;
        if (i >= 0) t[(size_t)i * step] = left > 0;
        left -= left > 0;
      }
    }
  }
}
