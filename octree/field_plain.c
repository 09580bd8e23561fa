// field_plain.c - the loops of field.c, one chord at a time, for every processor
// SPDX-License-Identifier: BSD-3-Clause

#include "octree/field.h"
#include "base/fast_exp.h"

static inline double larger(double a, double b) { return a > b ? a : b; }

static void find_middles(const vt_level *cells, const vt_field_ray *ray, const vt_chord *chords, size_t count,
                         vt_field_samples *out) {
  for (size_t k = 0; k < count; k++) {
    size_t cell = chords[k].cell;
    double at[3] = {cells->x[cell], cells->y[cell], cells->z[cell]}, enter = 0;
    for (int a = 0; a < 3; a++) enter = larger((at[a] + ray->ahead[a] - ray->origin[a]) * ray->inverse[a], enter);
    double t = enter + 0.5 * (double)chords[k].length;
    out->along[k] = (float)t;
    for (int a = 0; a < 3; a++) {
      float inside = (float)((ray->origin[a] - at[a]) + t * ray->direction[a]);
      inside = inside > 0 ? inside : 0;
      out->inside[k][a] = inside < 1 ? inside : 1;
    }
    out->inside[k][3] = 0;
  }
}

static inline float mix(float a, float b, float share) { return a + (b - a) * share; }

static void interpolate(const vt_level *cells, const vt_chord *chords, size_t count, vt_field_samples *out) {
  for (size_t k = 0; k < count; k++) {
    const uint32_t *corner = cells->corner_of + 8 * (size_t)chords[k].cell;
    const float *v[8], *f = out->inside[k];
    for (int i = 0; i < 8; i++) v[i] = cells->corner_values + 4 * (size_t)corner[i];
    for (int c = 0; c < 4; c++) { // along x, then z, then y
      float near = mix(mix(v[0][c], v[1][c], f[0]), mix(v[4][c], v[5][c], f[0]), f[2]);
      float far = mix(mix(v[2][c], v[3][c], f[0]), mix(v[6][c], v[7][c], f[0]), f[2]);
      out->value[k][c] = mix(near, far, f[1]);
    }
  }
}

void vt_sample_field_plain(const vt_level *cells, const vt_field_ray *ray, const vt_chord *chords, size_t count,
                           vt_field_samples *out) {
  find_middles(cells, ray, chords, count, out);
  if (cells->corner_count) {
    interpolate(cells, chords, count, out);
    return;
  }
  for (size_t k = 0; k < count; k++) {
    size_t cell = chords[k].cell;
    out->value[k][0] = cells->optical_depth[cell];
    for (size_t c = 0; c < 3; c++) out->value[k][c + 1] = cells->colour[3 * cell + c];
  }
}

// Where R is interpolated: ln of the mean of the four, as a code, counted from the greatest so that nothing is too large.
static float code_of_mean(const uint8_t *p, int next, int below, float u, float v) {
  const uint8_t codes[4] = {p[0], p[next], p[below], p[below + next]};
  const float share[4] = {(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v};
  int most = codes[0];
  for (int i = 1; i < 4; i++) most = codes[i] > most ? codes[i] : most;
  float mean = 0;
  for (int i = 0; i < 4; i++) mean += share[i] * vt_exp_of_negative(VT_LOG_RATIO_STEP * (float)(codes[i] - most));
  float code = (float)most + logf(mean > 1e-4f ? mean : 1e-4f) / VT_LOG_RATIO_STEP;
  return code > 0 ? code : 0;
}

// Code between four pixels' centres; (x, y) from the centre of the first.
static inline float code_at(const vt_field_sight *s, float x, float y) {
  x = x > 0 ? x : 0;
  y = y > 0 ? y : 0;
  x = x < s->right ? x : s->right;
  y = y < s->bottom ? y : s->bottom;
  int column = (int)x, row = (int)y;
  float u = x - (float)column, v = y - (float)row;
  const uint8_t *p = s->codes + (size_t)row * (size_t)s->columns + (size_t)column;
  int next = column + 1 < s->columns, below = row + 1 < s->rows ? s->columns : 0;
  if (s->linear) return code_of_mean(p, next, below, u, v);
  float above = (float)p[0] + u * (float)(p[next] - p[0]);
  float under = (float)p[below] + u * (float)(p[below + next] - p[below]);
  return above + v * (under - above);
}

void vt_sample_ratios_plain(const vt_field_sight *sights, int sight_count, const float *along, size_t count,
                            float *log_ratio) {
  for (size_t k = 0; k < count; k++) {
    float t = along[k], sum = 0, weights = 0;
    for (int v = 0; v < sight_count; v++) {
      const vt_field_sight *s = &sights[v];
      float z = s->a[2] + t * s->b[2], inverse = 1 / (z > VT_NEAREST_DEPTH ? z : VT_NEAREST_DEPTH);
      float x = (s->a[0] + t * s->b[0]) * inverse, y = (s->a[1] + t * s->b[1]) * inverse;
      if (!(z > VT_NEAREST_DEPTH && x >= 0 && y >= 0 && x <= s->width && y <= s->height)) continue;
      weights += s->weight;
      sum += s->weight * code_at(s, x - s->left, y - s->top);
    }
    log_ratio[k] = weights > 0 ? VT_LEAST_LOG_RATIO + VT_LOG_RATIO_STEP * (sum / weights) : 0;
  }
}
