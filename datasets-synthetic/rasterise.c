// rasterise.c - which triangle each sample of a grid sees, by a z-buffer
// SPDX-License-Identifier: BSD-3-Clause
//
// Pineda, "A parallel algorithm for polygon rasterization", SIGGRAPH 1988: a sample is inside a triangle if its three
// edge functions agree in sign. Vertices are rounded to 1/256 of a sample and edge functions are integers, so that two
// triangles that share an edge share its samples out among them with neither holes nor doubles (a sample on an edge
// belongs to the triangle below or right of it); in floating point, sun would shine through the seams.

#include "datasets-synthetic/rasterise.h"

void vt_clear_band(vt_sample_band *band) {
  size_t count = (size_t)band->width * (size_t)band->row_count;
  for (size_t i = 0; i < count; i++) band->near[i] = -INFINITY;
  for (size_t i = 0; band->triangle && i < count; i++) band->triangle[i] = VT_NO_TRIANGLE;
}

static int32_t min3(int32_t a, int32_t b, int32_t c) {
  return a < b ? (a < c ? a : c) : (b < c ? b : c);
}
static int32_t max3(int32_t a, int32_t b, int32_t c) {
  return a > b ? (a > c ? a : c) : (b > c ? b : c);
}
// First and last sample at or after, and at or before, a place.
static int32_t sample_from(int32_t at) {
  return (at + VT_SAMPLE_UNITS / 2 - 1) >> 8;
}
static int32_t sample_to(int32_t at) {
  return (at - VT_SAMPLE_UNITS / 2) >> 8;
}

int64_t vt_twice_area(const vt_projected *a, const vt_projected *b, const vt_projected *c) {
  return ((int64_t)b->x - a->x) * ((int64_t)c->y - a->y) - ((int64_t)b->y - a->y) * ((int64_t)c->x - a->x);
}

typedef struct edge {
  int64_t value, step_x, step_y;
} edge; // >= 0 inside

// The edge from a to b, at the sample (x, y); y down, the inside on its right hand.
static edge make_edge(const vt_projected *a, const vt_projected *b, int32_t x, int32_t y) {
  int64_t dx = (int64_t)b->x - a->x, dy = (int64_t)b->y - a->y;
  bool owns = dy < 0 || (dy == 0 && dx > 0); // a left or a top edge
  int64_t value = dx * (vt_sample_centre(y) - a->y) - dy * (vt_sample_centre(x) - a->x) - (owns ? 0 : 1);
  return (edge){value, -dy * VT_SAMPLE_UNITS, dx * VT_SAMPLE_UNITS};
}

static void draw_triangle(const vt_projected *a, const vt_projected *b, const vt_projected *c, int64_t area, int32_t id,
                          vt_sample_band *band) {
  int32_t x0 = sample_from(min3(a->x, b->x, c->x)), x1 = sample_to(max3(a->x, b->x, c->x));
  int32_t y0 = sample_from(min3(a->y, b->y, c->y)), y1 = sample_to(max3(a->y, b->y, c->y));
  int32_t last_row = band->first_row + band->row_count - 1;
  x0 = x0 < 0 ? 0 : x0, x1 = x1 >= band->width ? band->width - 1 : x1;
  y0 = y0 < band->first_row ? band->first_row : y0, y1 = y1 > last_row ? last_row : y1;
  if (x0 > x1 || y0 > y1) return;
  edge ab = make_edge(a, b, x0, y0), bc = make_edge(b, c, x0, y0), ca = make_edge(c, a, x0, y0);
  double ux = (double)b->x - a->x, uy = (double)b->y - a->y, vx = (double)c->x - a->x, vy = (double)c->y - a->y;
  double un = (double)b->near - a->near, vn = (double)c->near - a->near, scale = VT_SAMPLE_UNITS / (double)area;
  double near_x = (un * vy - vn * uy) * scale, near_y = (vn * ux - un * vx) * scale; // per sample
  double at_x = (double)(vt_sample_centre(x0) - a->x) / VT_SAMPLE_UNITS,
         at_y = (double)(vt_sample_centre(y0) - a->y) / VT_SAMPLE_UNITS;
  double row_near = a->near + near_x * at_x + near_y * at_y;
  for (int32_t y = y0; y <= y1; y++) {
    size_t row = (size_t)(y - band->first_row) * (size_t)band->width;
    int64_t e0 = ab.value, e1 = bc.value, e2 = ca.value;
    for (int32_t x = x0; x <= x1; x++) {
      if ((e0 | e1 | e2) >= 0) {
        float near = (float)(row_near + near_x * (x - x0));
        size_t at = row + (size_t)x;
        if (near > band->near[at]) {
          band->near[at] = near;
          if (band->triangle) band->triangle[at] = id;
        }
      }
      e0 += ab.step_x, e1 += bc.step_x, e2 += ca.step_x;
    }
    ab.value += ab.step_y, bc.value += bc.step_y, ca.value += ca.step_y;
    row_near += near_y;
  }
}

void vt_draw_mesh(const vt_mesh *mesh, const vt_projected *projected, bool hide_backs, vt_sample_band *band) {
  int32_t top = (int32_t)vt_sample_centre(band->first_row),
          bottom = (int32_t)vt_sample_centre(band->first_row + band->row_count - 1);
  for (size_t t = 0; t < mesh->triangle_count; t++) {
    const uint32_t *index = mesh->triangles[t];
    const vt_projected *a = &projected[index[0]], *b = &projected[index[1]], *c = &projected[index[2]];
    if ((a->y < top && b->y < top && c->y < top) || (a->y > bottom && b->y > bottom && c->y > bottom)) continue;
    int64_t area = vt_twice_area(a, b, c); // with y down, negative for a triangle that faces the eye
    if (area == 0 || (hide_backs && area > 0 && t < mesh->solid_count)) continue;
    if (area > 0)
      draw_triangle(a, b, c, area, (int32_t)t, band);
    else
      draw_triangle(a, c, b, -area, (int32_t)t, band);
  }
}
